"""Draw what `saturation = "qp"` keeps and `"clip"` loses: docs/images/saturation.png.

A Panda is asked for a step of 20 cm, aside and ahead, while its motors may add
8 N m to what carries the arm.
"""

from pathlib import Path

import matplotlib as mpl
import mujoco
import numpy as np

from wbc_suite.control import RobotState, build_composite_controller
from wbc_suite.envs import Simulation
from wbc_suite.robot import load_robot
from wbc_suite.scene import attach_robot, empty_arena
from wbc_suite.typing import Matrix

STEP = np.array([0.12, 0.16, 0.0])  # m
SPARE = 8.0  # N m
SECONDS = 1.2
PICTURE = Path(__file__).parent / "images" / "saturation.png"


def follow(saturation: str) -> Matrix:
    """Return where the hand is after each step, relative to the start, (n, 3), m."""
    robot, spec = load_robot("Panda"), empty_arena()
    attach_robot(spec, robot, "robot0_")
    model = spec.compile()
    data = mujoco.MjData(model)
    state = RobotState(model, data, robot, prefix="robot0_")
    posture = robot.keyframe("ready")
    data.qpos[state.joint_addresses(tuple(posture))[0]] = list(posture.values())
    mujoco.mj_forward(model, data)
    part = {"type": "OSC_POSE", "input_type": "absolute", "input_ref_frame": "world"}
    part |= {"saturation": saturation}
    controller = build_composite_controller(
        {"type": "BASIC", "body_parts": {"right": part}}, state
    )
    simulation = Simulation(model, data, [(state, controller)])
    simulation.start()
    drives = controller.laws[0].drives
    hand = data.site(state.prefix + robot.hands["right"])
    start, places = hand.xpos.copy(), []
    action = controller.hold_action
    action[:3] += STEP
    controller.set_goal(action)
    for _ in range(round(SECONDS / simulation.timestep)):
        carried = data.qfrc_bias[drives["dof"]]
        drives["command_min"], drives["command_max"] = carried - SPARE, carried + SPARE
        simulation.tick(1)
        places.append(hand.xpos - start)
    return np.array(places)


def main() -> None:
    """Draw the way of the hand from above, and its distance from the straight line."""
    mpl.use("agg")
    from matplotlib import pyplot

    figure, (way, aside) = pyplot.subplots(1, 2, figsize=(9.0, 3.8))
    way.plot(*(100 * np.outer([0, 1], STEP[:2])).T, "--", color="0.6", label="asked")
    way.plot(*(100 * STEP[:2]), "o", color="0.6")
    along = STEP / np.linalg.norm(STEP)
    for k, saturation in enumerate(("clip", "qp")):
        places = follow(saturation)
        off = places - np.outer(places @ along, along)
        time = np.linspace(0.0, SECONDS, len(places))
        way.plot(*(100 * places[:, :2]).T, color=f"C{1 - k}", label=saturation)
        aside.plot(
            time, 1e3 * np.linalg.norm(off, axis=1), color=f"C{1 - k}", label=saturation
        )
    way.set(title="Way of the hand from above", xlabel="x, cm", ylabel="y, cm")
    way.set_aspect("equal", "datalim")
    aside.set(title="Distance from the straight way", xlabel="s", ylabel="mm")
    for axes in (way, aside):
        axes.legend()
        axes.grid(alpha=0.3)
    figure.tight_layout()
    PICTURE.parent.mkdir(exist_ok=True)
    figure.savefig(PICTURE, dpi=80)


if __name__ == "__main__":
    main()
