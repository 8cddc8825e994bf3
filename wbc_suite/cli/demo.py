"""`wbc-suite demo`: a robot reaches with its hands, without a browser."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wbc_suite.cli import options
from wbc_suite.cli.output import print
from wbc_suite.errors import WbcError

if TYPE_CHECKING:
    import numpy as np

    from wbc_suite.robot import RobotDescription
    from wbc_suite.typing import Matrix, Vector
    from wbc_suite.viewers.offscreen import Image

RATE = 50  # Hz, of actions
PERIOD = 4.0  # s, of one figure
POINTS = 90  # of a drawn figure
REST = 1.0  # s, standing still at the end
FRAMES_PER_SECOND = 10
ARM = 0.6  # m; length of an arm that moves through the whole figure
MEDIAN, MEDIAN_OF_FEW = 0.02, 0.04
"""m; greatest median error in motion, and of hands whose arms have few joints."""
SLOW = 3  # exit status of a robot that lags more
LATE = 0.02  # m; error at rest from which on causes are looked for
ON_FEET = 0.15  # of the figure, by what moves a robot without hands: its trunk
STANDING = 0.5  # of the figure, by hands of a robot that stands on its feet


def demo(
    robot: options.RobotArgument = "GR1",
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder for the pictures.")
    ] = Path("artifacts/demo"),
    figures: Annotated[int, typer.Option(min=1, max=20, help="Number of curves.")] = 2,
    controller: Annotated[
        str, typer.Option(help="WHOLE_BODY_IK or WHOLE_BODY_MINK_IK.")
    ] = "WHOLE_BODY_IK",
    gripper: options.GripperOption = None,
    base: options.BaseOption = None,
    root: options.RootOption = None,
    mesh_root: options.MeshRootOption = None,
    catalogue: options.CatalogueOption = None,
) -> None:
    """Move a robot's hands along curves; print tracking errors, write pictures.

    The robot is alone on the floor. Without hands, it moves its trunk or last link. One
    on wheels also drives 2 m ahead, and turns by 90 degrees. The exit status is 3 if
    the median error in motion is over 20 mm, or over 40 mm for a hand whose arm has
    less than six joints.
    """
    from PIL import Image

    from wbc_suite.atomic_files import check_folder, replace_file
    from wbc_suite.control import load_composite_controller_config
    from wbc_suite.envs.drive_check import drive_check
    from wbc_suite.envs.hold_check import alone, hold_faults
    from wbc_suite.recording.video import write_video
    from wbc_suite.robot import load_robot
    from wbc_suite.robot.wheel_drive import WheelDrive
    from wbc_suite.viewers.offscreen import render_robot

    chosen = options.chosen(gripper)
    loaded = load_robot(
        robot, gripper=chosen, base=base, root=root, mesh_root=mesh_root
    )
    config = load_composite_controller_config(controller, loaded)
    sizes = dict(_sizes(loaded, config))
    if loaded.wheels:
        print(f"{loaded.name}, {WheelDrive(loaded)}: {drive_check(loaded)}.")
    check_folder(output)
    if not sizes:
        still = output / "drive.png"
        replace_file(still, Image.fromarray(render_robot(loaded)).save)
        print(f"Wrote {still}.")
        return
    env = alone(loaded, controller_configs=config, control_freq=RATE)
    seconds = figures * PERIOD + REST
    errors, step_times, pictures = _reach(env, sizes, seconds)
    _report(f"{loaded.name} by {controller}", sizes, errors, step_times)
    for fault in hold_faults(loaded) if errors[-1].max() > LATE else ():
        print(f"  at `ready`: {fault}")
    still, film = output / "reach.png", output / "reach.gif"
    replace_file(still, Image.fromarray(pictures[len(pictures) // 4]).save)
    write_video(pictures, film, rate=FRAMES_PER_SECOND)
    print(f"Wrote {still} and {film}.")
    if slow := [*_slow(loaded, config, sizes, errors)]:
        print(f"Behind by more than a hand should be: {', '.join(slow)}.")
        raise typer.Exit(SLOW)


def _sizes(
    robot: "RobotDescription", config: dict[str, Any]
) -> "Iterator[tuple[str, float]]":
    """Yield each frame that moves and the size of its figure, 1 for a long arm."""
    from wbc_suite.robot.arms import arm_length

    feet = any(frame.role == "foot" for frame in robot.frames)
    most = STANDING if feet and robot.root.kind == "free" else 1.0
    for frame in config["frame"]:
        if frame.get("kind", "pose") not in ("pose", "position"):
            continue
        length = arm_length(robot, frame["frame"])
        yield frame["name"], min(most, length / ARM) if length else ON_FEET


def _slow(
    robot: "RobotDescription",
    config: dict[str, Any],
    names: "Iterable[str]",
    errors: "Matrix",
) -> Iterator[str]:
    """Yield each frame whose median error in motion is too large, with its bound."""
    import numpy as np

    from wbc_suite.robot.arms import has_few_joints

    frames = {frame["name"]: frame.get("frame") for frame in config["frame"]}
    medians = np.median(errors[: -round(REST * RATE)], axis=0)
    for name, median in zip(names, medians.tolist(), strict=True):
        most = MEDIAN_OF_FEW if has_few_joints(robot, frames[name]) else MEDIAN
        if median > most:
            yield f"{name} {1e3 * median:.0f} mm (at most {1e3 * most:.0f})"


def _reach(
    env: Any, sizes: dict[str, float], seconds: float
) -> "tuple[Matrix, Vector, list[Image]]":
    """Move frames along figures; return errors (n, frames) m, times (n,) s, pictures.

    Raises:
        WbcError: If the robot falls.
    """
    import numpy as np

    from wbc_suite.viewers.offscreen import Camera, Mark

    env.reset(seed=0)
    layout = env.action_layout
    start = layout.unpack(env.hold_action)
    model, data = env.simulation.model, env.simulation.data
    curves = [
        Mark(
            position=start[name][:3] + size * _mirrored(_figure(t), name), radius=0.006
        )
        for name, size in sizes.items()
        for t in np.linspace(0.0, PERIOD, POINTS)
    ]
    errors, step_times, pictures = [], [], []
    with Camera(model, data, width=480, height=480, subject="robot0_") as camera:
        for step in range(round(seconds * RATE)):
            offset = _figure(min(step / RATE, seconds - REST))
            goals = {
                name: start[name]
                + np.pad(size * _mirrored(offset, name), (0, len(start[name]) - 3))
                for name, size in sizes.items()
            }
            action, begin = layout.pack(goals, base=env.hold_action), perf_counter()
            *_, info = env.step(action)
            step_times.append(perf_counter() - begin)
            if fault := info.get("failure") or info.get("physics_error"):
                raise WbcError(f"{fault} `wbc-suite check` names likely causes.")
            frames = info["ik"]["frames"]
            errors.append([frames[name]["position_error"] for name in sizes])
            if step % (RATE // FRAMES_PER_SECOND) == 0:
                marks = [Mark(position=goal[:3]) for goal in goals.values()]
                pictures.append(camera.take(data, [*curves, *marks]))
    return np.array(errors), np.array(step_times), pictures


def _figure(time: float) -> "np.ndarray":
    """Return the way of a right hand from where it started, m: a Lissajous figure."""
    import numpy as np

    phase = 2.0 * np.pi * time / PERIOD
    forward, side = 0.06 * (1.0 - np.cos(phase)), 0.10 * np.sin(phase)
    return np.array([forward, side, 0.10 * (1.0 - np.cos(2.0 * phase))])


def _mirrored(offset: "np.ndarray", name: str) -> "np.ndarray":
    return offset * (1.0, -1.0, 1.0) if name.startswith("left") else offset


def _report(
    title: str, names: "Iterable[str]", errors: "Matrix", step_times: "Vector"
) -> None:
    import numpy as np

    print(f"{title}, simulated by MuJoCo:")
    for name, column in zip(names, 1e3 * errors.T, strict=True):
        moving = column[: -round(REST * RATE)]
        print(
            f"  {name:<11} at rest {column[-1]:.3f} mm from its target; while it moves "
            f"{np.median(moving):.2f} mm behind (median), {moving.max():.2f} mm (worst)"
        )
    median, slowest = np.percentile(1e3 * step_times, [50, 99])
    print(f"  step time   median {median:5.2f} ms, 99 % under {slowest:.2f} ms")
