"""robosuite's `control_freq` at a rate that does not divide 500."""

import pytest

RATE, STEPS = 30, 17


@pytest.fixture(scope="module")
def env(suite):
    made = suite.make(
        "Lift",
        robots="Panda",
        control_freq=RATE,
        has_offscreen_renderer=False,
        use_camera_obs=False,
    )
    yield made
    made.close()


def test_a_step_takes_a_control_period(env):
    env.reset()
    start = env.sim.data.time
    for _ in range(3):
        env.step([0.0] * env.action_dim)
    assert env.sim.data.time - start == pytest.approx(3.0 / RATE, abs=1e-12)
    assert env.cur_time == pytest.approx(3.0 / RATE)
    assert env.sim.model.opt.timestep == env.model_timestep


def test_a_loop_of_ones_own_takes_as_many_steps(env):
    """As robosuite's `step` is written."""
    assert int(env.control_timestep / env.model_timestep) == STEPS


def test_parts_get_the_time_between_actions(env):
    controller = env.robots[0].composite_controller
    assert controller.period == 1.0 / RATE
    part, periods = controller.part_controllers["right"], []
    own = part._part.set_goal

    def set_goal(values, period):
        periods.append(period)
        own(values, period)

    part._part.set_goal = set_goal
    try:
        part.set_goal([0.0] * 6)
        controller.set_goal([0.0] * env.action_dim)
    finally:
        del part._part.set_goal
    assert periods == [1.0 / RATE] * 2
