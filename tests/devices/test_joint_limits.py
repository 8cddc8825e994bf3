"""Joint targets of a real controller under a device that does its worst."""

from typing import NamedTuple

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import wbc_suite
from wbc_suite.control.ik.qp_of_config import accelerations
from wbc_suite.devices import DeviceState, LimbInput, Pipeline, PipelineConfig

RATE = 100.0


@pytest.fixture(scope="module")
def env():
    """Panda under whole-body control, one solve for each step."""
    made = wbc_suite.make(
        "Lift",
        robots="Panda",
        controller_configs="WHOLE_BODY_IK",
        control_freq=RATE,
        horizon=10_000,
    )
    made.reset(seed=0)
    assert made.unwrapped.controllers[0].config.solve_hz == RATE
    yield made
    made.close()


class Said(NamedTuple):
    """What a device says for some ticks, and what is wrong with it."""

    place: tuple[float, float, float]
    turn: tuple[float, float, float]
    ticks: int
    fault: str


SAID = st.builds(
    Said,
    place=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    turn=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    ticks=st.integers(1, 25),
    fault=st.sampled_from(
        ("none", "jump", "stall", "back", "repeat", "nan", "let go", "trembles")
    ),
)


def states(story):
    """Yield one state for each tick of a story; its clock has the device's faults."""
    clock = 0.0
    for said in story:
        for k in range(said.ticks):
            clock += {"stall": 0.0, "back": -0.5}.get(said.fault, 1.0 / RATE)
            sign = -1.0 if said.fault in ("jump", "trembles") and k % 2 else 1.0
            size = 0.02 if said.fault == "trembles" else 1.0
            pose = pin.SE3(
                pin.exp3(sign * size * np.array(said.turn)),
                sign * size * np.array(said.place),
            )
            limb = LimbInput(pose=pose, engaged=said.fault != "let go")
            if said.fault == "nan":
                limb = LimbInput(twist=np.full(6, np.nan))
            state = DeviceState(time=clock, limbs={"right": limb})
            yield from [state] * (2 if said.fault == "repeat" else 1)


def run(env, story):
    """Return the targets of the law at every step of physics, (n, 3, joints)."""
    env.reset(seed=0)
    controller = env.unwrapped.controllers[0]
    pipeline = Pipeline(env, PipelineConfig(ramp=0.0, jump=None, jump_angle=None))
    dt, steps = env.unwrapped.simulation.timestep, controller._steps_per_solve
    sampled = []
    for state in states(story):
        env.step(pipeline.update(state))
        p, v, a, j = controller._reference.motion
        for s in dt * np.arange(1, steps + 1):
            sampled.append(
                (
                    p + s * (v + s * (a / 2 + s * j / 6)),
                    v + s * (a + s * j / 2),
                    a + s * j,
                )
            )
    return np.array(sampled), dt


@pytest.mark.slow
@settings(max_examples=12)
@given(story=st.lists(SAID, min_size=2, max_size=8))
def test_joint_targets_keep_every_limit_whatever_the_device_says(env, story):
    sampled, dt = run(env, story)
    controller = env.unwrapped.controllers[0]
    robot, limits = env.unwrapped.robots[0], controller.config.limits
    names = list(controller.joint_targets)
    position, velocity, acceleration = np.swapaxes(sampled, 0, 1)
    low, high = np.array([robot.joint(name).range for name in names]).T
    assert (position >= low - 1e-9).all()
    assert (position <= high + 1e-9).all()
    speeds = np.array([robot.joint(name).velocity for name in names])
    assert (np.abs(velocity).max(axis=0) <= speeds * (1.0 + 1e-9)).all()
    most = accelerations(controller.robot, controller.config, controller._configuration)
    assert (np.abs(acceleration).max(axis=0) <= most + 1e-6).all()
    jerk = np.diff(acceleration, axis=0) / dt
    assert np.abs(jerk).max(initial=0.0) <= limits.jerk * (1.0 + 1e-6)


def test_a_story_of_jumps_does_move_the_robot(env):
    story = [
        Said((x, 0.3, 0.4), (0.0, x, 1.0), 25, "none") for x in (1.0, -1.0, 1.0, -1.0)
    ]
    position, velocity, acceleration = np.swapaxes(run(env, story)[0], 0, 1)
    assert np.ptp(position, axis=0).max() > 0.1
    assert np.abs(velocity).max() > 0.3
    assert np.abs(acceleration).max() > 3.0
