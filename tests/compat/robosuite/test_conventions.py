"""Grip sites, fingers and cameras as in robosuite 1.5.2, or on request as ours."""

import json

import numpy as np
import pytest

import wbc_suite
import wbc_suite.compat.robosuite as suite
from wbc_suite.compat.robosuite.environments import make_from_env_args
from wbc_suite.errors import ConfigError

PLAIN = {"use_camera_obs": False, "initialization_noise": None, "seed": 0}
GRIPPERS = {
    "Panda": 0.097,
    "Sawyer": 0.109,
    "UR5e": 0.145,
    "IIWA": 0.2075,
    "Jaco": 0.1775,
    "XArm7": 0.147,
}
"""Distance of the site from the last body in robosuite, m."""


@pytest.fixture(scope="module")
def lift():
    env = suite.make("Lift", robots="Panda", **PLAIN)
    return env, env.reset()


@pytest.mark.slow
@pytest.mark.parametrize("name", GRIPPERS)
def test_the_site_between_the_fingers_is_robosuites(name):
    env = suite.make("Lift", robots=name, **PLAIN)
    seen = env.reset()
    robot = env.robots[0]
    site = robot.eef_site_id["right"]
    place, pose = env.sim.data.site_xpos[site], robot._hand_pose["right"]
    place = robot.base_ori.T @ (place - robot.base_pos)
    offset = pose[:3, :3].T @ (place - pose[:3, 3])
    np.testing.assert_allclose(offset, [0, 0, GRIPPERS[name]], atol=1e-9)
    np.testing.assert_array_equal(seen["robot0_eef_pos"], env.sim.data.site_xpos[site])
    one, other = (seen[f"robot0_eef_quat{k}"] for k in ("", "_site"))
    turn = 1.0 if name == "XArm7" else 0.5**0.5  # cosine of half the angle between them
    assert abs(one @ other) == pytest.approx(turn, abs=1e-6)


@pytest.mark.slow
def test_the_right_finger_of_a_panda_counts_down(lift):
    env, seen = lift
    expected = [0.020833, -0.020833]
    np.testing.assert_allclose(seen["robot0_gripper_qpos"], expected, atol=1e-9)
    for action, width in ((-1.0, 0.08), (1.0, 0.0)):
        for _ in range(30):
            seen = env.step([0.0] * 6 + [action])[0]
        left, right = seen["robot0_gripper_qpos"]
        assert left - right == pytest.approx(width, abs=2e-3)
        assert left + right == pytest.approx(0.0, abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("task", "place"),
    [
        ("Lift", (0.5, 0.0, 1.35)),
        ("PickPlace", (1.0, 0.0, 1.75)),
        ("Door", (0.598613, 0.0, 1.59035)),
        ("ToolHang", (0.483728, 0.250558, 1.263938)),
    ],
)
def test_cameras_are_where_robosuites_are(task, place):
    env = suite.make(task, robots="Panda", **PLAIN)
    env.reset()
    np.testing.assert_allclose(
        env.sim.data.get_camera_xpos("agentview"), place, atol=1e-6
    )
    turned = env.sim.data.get_camera_xmat("agentview")
    np.testing.assert_allclose(turned @ turned.T, np.eye(3), atol=1e-12)


@pytest.mark.slow
def test_our_conventions_are_those_of_our_own_environment():
    theirs = suite.make("Lift", robots="Panda", conventions="wbc_suite", **PLAIN)
    arguments = {"robots": "Panda", "initialization_noise": None}
    own = wbc_suite.make("Lift", **arguments)
    seen, expected = theirs.reset(), own.reset(seed=0)[0]
    for key in ("eef_pos", "eef_quat"):
        one, other = seen[f"robot0_{key}"], expected[f"robot0_{key}"]
        np.testing.assert_allclose(one, other, atol=1e-9)
    np.testing.assert_allclose(seen["robot0_gripper_qpos"], [0.04, 0.04])
    cameras = (e.model.camera("agentview").pos for e in (theirs.sim, own.simulation))
    np.testing.assert_array_equal(*cameras)
    fields = {"env_name": "Lift", "package": "wbc_suite", "env_kwargs": arguments}
    again = make_from_env_args(json.dumps(fields)).reset()
    np.testing.assert_allclose(again["robot0_gripper_qpos"], [0.04, 0.04])


def test_unknown_conventions_are_refused():
    with pytest.raises(
        ConfigError, match="`conventions` is 'wbc_suite' or 'robosuite'"
    ):
        suite.make("Lift", robots="Panda", conventions="other")


@pytest.mark.slow
def test_with_our_conventions_a_robot_moves_as_in_our_recordings():
    own = wbc_suite.make("Lift", robots="Panda")
    env = suite.make("Lift", robots="Panda", conventions="wbc_suite", **PLAIN)
    ours, there = own.unwrapped.simulation.model, env.env.simulation.model
    for name in ("dof_armature", "dof_damping", "dof_frictionloss", "jnt_range"):
        np.testing.assert_array_equal(getattr(there, name), getattr(ours, name))
    of_robot = [b for b in range(ours.nbody) if ours.body(b).name.startswith("robot0")]
    assert len(of_robot) > 10  # the cube's mass is drawn
    for name in ("body_mass", "body_inertia", "body_ipos", "body_pos"):
        one, other = (getattr(model, name)[of_robot] for model in (there, ours))
        np.testing.assert_allclose(one, other, atol=1e-12)
    assert (there.opt.density, there.opt.viscosity) == (0.0, 0.0)
    own.close()
    env.close()
