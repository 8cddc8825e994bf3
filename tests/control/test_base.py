import numpy as np
import pytest

from wbc_suite.control import load_composite_controller_config
from wbc_suite.errors import ConfigError

PERIOD = 0.05


def base(alone, robot="Tiago", **settings):
    parts = {"base": {"type": "BASE_VELOCITY"} | settings}
    rig = alone(robot, "BASIC", body_parts=parts)
    rig.simulation.start()
    return rig


def run(rig, action, seconds):
    for _ in range(round(seconds / PERIOD)):
        rig.controller.set_goal(np.array(action, dtype=float), PERIOD)
        rig.simulation.tick(round(PERIOD / rig.simulation.timestep))


@pytest.mark.parametrize(
    ("robot", "labels"),
    [
        ("Tiago", ("forward", "sideways", "turn")),
        ("PandaOmron", ("forward", "sideways", "turn")),
        ("TiagoDifferential", ("forward", "turn")),
    ],
)
def test_full_input_is_the_speed_of_the_base(alone, robot, labels):
    rig = base(alone, robot)
    part = rig.controller.layout["base"]
    linear, angular = rig.robot.root.velocity
    assert part.labels == labels
    assert part.high == (1.0,) * len(labels)
    assert tuple(map(str, part.units)) == tuple(
        f"{angular:g} rad/s" if x == "turn" else f"{linear:g} m/s" for x in labels
    )
    action = np.zeros(rig.controller.layout.size)
    action[0] = 1.0
    run(rig, action, 1.5)
    assert rig.state.data.qvel[:3] == pytest.approx([linear, 0.0, 0.0], abs=0.02)


def test_speeds_turn_with_the_base(alone):
    rig = base(alone)
    run(rig, [0.3, 0.0, 0.5], 1.0)
    x, y, yaw = rig.state.data.qpos[:3].copy()
    v = rig.state.data.qvel[:3].copy()
    assert yaw > 0.3
    assert v[:2] == pytest.approx(0.3 * np.array([np.cos(yaw), np.sin(yaw)]), abs=0.01)
    # An arc: after the ramps, radius v / w about a centre to the left.
    run(rig, [0.3, 0.0, 0.5], 0.5)
    radius = 0.3 / 0.75
    centre = np.array([x - radius * np.sin(yaw), y + radius * np.cos(yaw)])
    place = rig.state.data.qpos[:2]
    assert np.linalg.norm(place - centre) == pytest.approx(radius, abs=2e-3)


def test_a_differential_base_never_slides_sideways(alone):
    rig = base(alone, "TiagoDifferential")
    for _ in range(40):
        run(rig, [0.5, 1.0], PERIOD)
        yaw = rig.state.data.qpos[2]
        v_x, v_y = rig.state.data.qvel[:2]
        assert abs(v_y * np.cos(yaw) - v_x * np.sin(yaw)) < 0.01


def test_accelerations_are_limited_both_ways(alone):
    rig = base(alone, acceleration=0.8, turning_acceleration=1.5)
    speeds = []
    for action in ([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]):
        rig.controller.set_goal(np.array(action), PERIOD)
        for _ in range(1000):
            rig.simulation.tick(1)
            speeds.append(rig.state.data.qvel[0])
    acceleration = np.diff(speeds) / rig.simulation.timestep
    assert np.abs(acceleration).max() < 0.8 * 1.1
    assert max(speeds) < rig.robot.root.velocity[0] * 1.01
    assert min(speeds) < -0.5


@pytest.mark.parametrize("robot", ["Tiago", "TiagoDifferential", "PandaOmron"])
@pytest.mark.parametrize("kind", ["delta", "absolute"])
def test_zero_keeps_the_base_where_it_is(alone, robot, kind):
    rig = base(alone, robot, input_type=kind)
    start = rig.state.data.qpos[:3].copy()
    run(rig, np.zeros(rig.controller.layout.size), 2.0)
    assert np.abs(rig.state.data.qpos[:3] - start).max() < 1e-4


def test_a_base_told_to_stop_stays_there_when_pushed(alone):
    rig = base(alone)
    run(rig, [0.5, 0.0, 0.0], 0.5)
    run(rig, [0.0, 0.0, 0.0], 1.5)
    stopped = rig.state.data.qpos[:3].copy()
    assert stopped[0] > 0.1
    body = rig.state.model.body("robot0_" + rig.robot.links[0].name).id
    rig.state.data.xfrc_applied[body, 0] = 20.0
    run(rig, [0.0, 0.0, 0.0], 1.0)
    rig.state.data.xfrc_applied[:] = 0.0
    run(rig, [0.0, 0.0, 0.0], 1.0)
    assert rig.state.data.qpos[:3] == pytest.approx(stopped, abs=1e-4)


def test_a_blocked_base_does_not_wind_up(alone):
    rig = base(alone, windup_limit=0.02)
    body = rig.state.model.body("robot0_" + rig.robot.links[0].name).id
    rig.state.data.xfrc_applied[body, 0] = -1e4  # more than its motors
    rig.state.data.qpos[0] = 0.0
    law = rig.controller.parts["base"].law
    for _ in range(20):
        rig.controller.set_goal(np.array([1.0, 0.0, 0.0]), PERIOD)
        rig.simulation.tick(1)
    gap = law.drives["position"][0] - rig.state.data.qpos[0]
    assert gap <= 0.02 + 1e-2


def test_a_robot_without_a_base_says_so():
    config = {
        "format": 1,
        "type": "BASIC",
        "body_parts": {"base": {"type": "BASE_VELOCITY"}},
    }
    with pytest.raises(ConfigError, match="base"):
        load_composite_controller_config(config, "Panda")
    config = config | {"body_parts": {"torso": {"type": "BASE_VELOCITY"}}}
    with pytest.raises(ConfigError, match="BASE_VELOCITY"):
        load_composite_controller_config(config, "Tiago")
