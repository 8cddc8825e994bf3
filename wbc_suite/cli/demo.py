"""`wbc-suite demo`: a humanoid reaches with both hands, without a browser."""

from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    import numpy as np

    from wbc_suite.typing import Matrix, Vector
    from wbc_suite.viewers.offscreen import Image

HANDS = ("right_hand", "left_hand")
RATE = 50  # Hz, of actions
PERIOD = 4.0  # s, of one figure
REST = 1.0  # s, standing still at the end
FRAMES_PER_SECOND = 10


def demo(
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder for the pictures.")
    ] = Path("artifacts/demo"),
    figures: Annotated[int, typer.Option(min=1, max=20, help="How many.")] = 2,
    controller: Annotated[
        str, typer.Option(help="WHOLE_BODY_IK or WHOLE_BODY_MINK_IK.")
    ] = "WHOLE_BODY_IK",
) -> None:
    """Move both hands of GR1 along curves; print tracking errors, write pictures."""
    from PIL import Image

    import wbc_suite
    from wbc_suite.recording.plots import save_picture
    from wbc_suite.recording.video import write_video

    seconds = figures * PERIOD + REST
    horizon = round(seconds * RATE) + 1
    made = {"controller_configs": controller, "control_freq": RATE, "horizon": horizon}
    env = wbc_suite.make("Lift", robots="GR1", **made)
    errors, step_times, pictures = _reach(env.unwrapped, seconds)
    _report(controller, errors, step_times)
    still, film = output / "reach.png", output / "reach.gif"
    save_picture(Image.fromarray(pictures[len(pictures) // 4]), still)
    write_video(pictures, film, rate=FRAMES_PER_SECOND)
    print(f"Wrote {still} and {film}.")


def _reach(env: Any, seconds: float) -> "tuple[Matrix, Vector, list[Image]]":
    """Move both hands along figures; return errors (n, 2) m, times (n,) s, pictures."""
    import numpy as np

    from wbc_suite.viewers.offscreen import Camera, Mark

    env.reset(seed=0)
    layout = env.action_layout
    start = layout.unpack(env.hold_action)
    model, data = env.simulation.model, env.simulation.data
    errors, step_times, pictures = [], [], []
    with Camera(model, data, width=480, height=480, subject="robot0_") as camera:
        for step in range(round(seconds * RATE)):
            goals = {
                hand: np.concatenate([start[hand][:3] + offset, start[hand][3:]])
                for hand, offset in _figure(min(step / RATE, seconds - REST)).items()
            }
            action, begin = layout.pack(goals, base=env.hold_action), perf_counter()
            *_, info = env.step(action)
            step_times.append(perf_counter() - begin)
            frames = info["ik"]["frames"]
            errors.append([frames[hand]["position_error"] for hand in HANDS])
            if step % (RATE // FRAMES_PER_SECOND) == 0:
                marks = [Mark(position=goals[hand][:3]) for hand in HANDS]
                pictures.append(camera.take(data, marks))
    return np.array(errors), np.array(step_times), pictures


def _figure(time: float) -> "dict[str, np.ndarray]":
    """Return each hand's way from where it started, m: a Lissajous figure, mirrored."""
    import numpy as np

    phase = 2.0 * np.pi * time / PERIOD
    forward, side = 0.06 * (1.0 - np.cos(phase)), 0.10 * np.sin(phase)
    up = 0.10 * (1.0 - np.cos(2.0 * phase))
    return {
        "right_hand": np.array([forward, side, up]),
        "left_hand": np.array([forward, -side, up]),
    }


def _report(controller: str, errors: "Matrix", step_times: "Vector") -> None:
    import numpy as np

    print(f"GR1 reaches with both hands by {controller}, simulated by MuJoCo:")
    for hand, column in zip(HANDS, 1e3 * errors.T, strict=True):
        moving = column[: -round(REST * RATE)]
        print(
            f"  {hand:<11} behind its moving target by {np.median(moving):5.2f} mm "
            f"(median), {moving.max():5.2f} mm (worst); at rest {column[-1]:.3f} mm"
        )
    median, slowest = np.percentile(1e3 * step_times, [50, 99])
    print(f"  step time   median {median:5.2f} ms, 99 % under {slowest:.2f} ms")
