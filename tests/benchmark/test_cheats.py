"""Ways to a success or a reward without the deed, which were found and are closed."""

import itertools
import math

import pytest
from conftest import penetration, put
from test_tool_hang import INSERTED

import wbc_suite

TOP = 0.82  # m, of the table of NutAssembly


@pytest.mark.parametrize(
    ("name", "half", "peg"), [("SquareNut", 0.0445, 0.016), ("RoundNut", 0.045, 0.02)]
)
def test_a_nut_on_its_edge_beside_its_peg_is_not_placed(name, half, peg):
    env = wbc_suite.make("NutAssembly", robots="Panda")
    for way, side in itertools.product(range(4), (0.0098, 0.0105)):
        env.reset(seed=0)
        x, y = env.benchmark.goal(name)
        turn = way * math.pi / 2
        away = min(peg + side, 0.0298)
        at = x + away * math.cos(turn), y + away * math.sin(turn), TOP + half + 1e-4
        nuts = put(env, **{name: (at, on_edge(turn))})
        assert 0.0 < nuts.sorting._offset(name)[2] < nuts.config.height
        assert math.hypot(*nuts.sorting._offset(name)[:2]) < nuts.config.aside
        for _ in range(30):
            assert not nuts.sorting.is_placed(name)
            env.step(env.hold_action)


def on_edge(turn):
    """Return w x y z of a nut whose axis is horizontal, along an angle."""
    half = math.sqrt(0.5)
    w, x, y, z = half, 0.0, half, 0.0  # its axis along +x, its handle down
    c, s = math.cos((turn) / 2), math.sin((turn) / 2)
    product = (c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w)
    flip = (0.0, 0.0, 0.0, 1.0)  # half a turn about its axis: its handle up
    a, b = product, flip
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@pytest.mark.parametrize("torque", [5.0, 20.0])
def test_the_lever_has_a_hard_stop_and_pays_for_one_direction_only(torque):
    env = wbc_suite.make("Door", robots="Panda", reward_shaping=True)
    env.reset(seed=0)
    data = env.simulation.data
    lever = data.joint("door_handle_joint")
    rewards = []
    for _ in range(40):
        lever.qfrc_applied[0] = -torque
        rewards.append(env.step(env.hold_action)[1])
    assert lever.qpos[0] > -0.05  # -2.4 before
    assert max(rewards) <= rewards[0] + 1e-3


def test_a_pressed_frame_does_not_sink_into_its_stand():
    env = wbc_suite.make("ToolHang", robots="Panda")
    env.reset(seed=0)
    task = put(env, frame=INSERTED)
    for _ in range(5):
        env.step(env.hold_action)
    data, body = env.simulation.data, task.states["frame"].body
    height = task.site("frame_tip")[2]
    for _ in range(20):
        data.xfrc_applied[body, :3] = 60.0, 0.0, -80.0
        env.step(env.hold_action)
    assert penetration(env) < 0.001  # 0.021 before
    assert abs(task.site("frame_tip")[2] - height) < 0.001


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["GR1FreeBody", "SpotWithArm"])
def test_a_robot_that_falls_ends_the_episode_and_says_so(robot):
    env = wbc_suite.make(
        "Lift", robots=robot, controller_configs="WHOLE_BODY_IK", horizon=400
    )
    env.reset(seed=0)
    for _ in range(40):
        assert "failure" not in env.step(env.hold_action)[-1]
    trunk = env.simulation.data.body(f"robot0_{env.robots[0].links[0].name}")
    for _ in range(100):
        trunk.xfrc_applied[:] = 600.0, 400.0, 0.0, 0.0, 0.0, 0.0
        _, _, terminated, truncated, info = env.step(env.hold_action)
        if terminated or truncated:
            break
    assert terminated
    assert robot in info["failure"]
    assert "fell" in info["failure"]
