"""An action that asks for nothing moves nothing, whatever the controller."""

import itertools

import mujoco
import numpy as np
import pytest

from wbc_suite.catalogue import Catalogue
from wbc_suite.control import build_composite_controller
from wbc_suite.control.robot_parts import hands_of
from wbc_suite.envs import Simulation

PERIOD, SECONDS = 0.05, 2.0
MOST = 1e-4  # m

FRAMES = ("world", "base", "eef")
RAMPS = (None, "linear")
UPDATES = ("achieved", "desired")
MODES = ("fixed", "variable_kp", "variable")


def cases():
    """Return every combination of settings that a controller has."""
    found = []
    for ramp, update in itertools.product(RAMPS, UPDATES):
        shared = {"interpolation": ramp, "goal_update_mode": update}
        for frame in FRAMES:
            posed = shared | {"input_ref_frame": frame}
            found.append(posed | {"type": "IK_POSE"})
            for kind, mode in itertools.product(("OSC_POSE", "OSC_POSITION"), MODES):
                found.append(posed | {"type": kind, "impedance_mode": mode})
        for mode in MODES:
            found.append(shared | {"type": "JOINT_POSITION", "impedance_mode": mode})
    for ramp, kind in itertools.product(RAMPS, ("JOINT_VELOCITY", "JOINT_TORQUE")):
        found.append({"type": kind, "interpolation": ramp})
    return found


def name_of(case):
    return "-".join(str(value) for value in case.values())


def drift(rig, case, action):
    """Return how far each hand moves under an action, m, by its part.

    Args:
        rig: The robot; its scene serves many controllers, one after another.
        case: The controller of each part with a hand.
        action: Makes the action of the controllers.
    """
    hands = hands_of(rig.robot)
    config = {
        "type": "BASIC",
        "body_parts": dict.fromkeys(hands, case),
        "may_fall": True,
    }
    data, state = rig.state.data, rig.state
    mujoco.mj_resetData(state.model, data)
    data.qpos[:] = rig.start
    mujoco.mj_forward(state.model, data)
    controller = build_composite_controller(config, state)
    simulation = Simulation(state.model, data, [(state, controller)])
    simulation.start()
    sites = {part: data.site(f"robot0_{hand}") for part, hand in hands.items()}
    start = {part: site.xpos.copy() for part, site in sites.items()}
    furthest = dict.fromkeys(hands, 0.0)
    steps = round(PERIOD / simulation.timestep)
    values = action(controller)
    for _ in range(round(SECONDS / PERIOD)):
        controller.set_goal(values, PERIOD)
        simulation.tick(steps)
        for part, site in sites.items():
            moved = float(np.linalg.norm(site.xpos - start[part]))
            furthest[part] = max(furthest[part], moved)
    return furthest


def hold(controller):
    return controller.hold_action


def zeros(controller):
    """All zeros but for the gripper: without stiffness, where the action tells it."""
    values = np.zeros(controller.layout.size)
    gripper = controller.layout["right_gripper"]
    values[gripper.start :] = controller.hold_action[gripper.start :]
    return values


@pytest.fixture(scope="module")
def robots(alone):
    """Return a robot at `ready`, made once."""
    made = {}

    def robot(name):
        if name not in made:
            made[name] = alone(name, "BASIC", body_parts={}, may_fall=True)
            made[name].start = made[name].state.data.qpos.copy()
        return made[name]

    return robot


def arms():
    """Return all robots with an arm, but the one of the fast set.

    Those that stand on their feet have the arms of others, and settle into the ground.
    """
    standing = ("spot", "spot_with_arm", "b1_z1", "go2_arx5")
    standing += ("g1_free_body", "gr1_free_body", "h1_free_body")
    return [r for r in Catalogue().names("robots") if r not in ("panda", *standing)]


@pytest.mark.parametrize("case", cases(), ids=name_of)
def test_an_action_of_nothing_holds_the_hand_of_a_panda(robots, case):
    assert drift(robots("panda"), case, hold)["right"] < MOST


@pytest.mark.parametrize(
    "case", [c for c in cases() if c.get("goal_update_mode") != "desired"], ids=name_of
)
def test_all_zeros_hold_the_hand_of_a_panda(robots, case):
    assert drift(robots("panda"), case, zeros)["right"] < MOST


@pytest.mark.sample(4)
@pytest.mark.slow
@pytest.mark.parametrize("name", arms())
def test_an_action_of_nothing_holds_every_hand(robots, name):
    rig = robots(name)
    moved = {
        (part, name_of(case)): far
        for case in cases()
        for part, far in drift(rig, case, hold).items()
    }
    assert {key: far for key, far in moved.items() if not far < MOST} == {}
