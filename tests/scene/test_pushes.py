"""Pushes: drawn in bounds, and written at the right physics steps."""

import mujoco
import numpy as np
import pytest
from pydantic import ValidationError

from wbc_suite.scene import Push, PushConfig, draw_pushes
from wbc_suite.scene.pushes import PushSchedule

BALL = """<mujoco><option gravity="0 0 0" timestep="0.002" integrator="Euler"/>
<worldbody><body><freejoint/><geom size=".1" mass="2"/></body></worldbody></mujoco>"""
CONFIG = PushConfig(force=(50.0, 80.0), interval=(1.0, 2.0))


def drawn(seed, **more):
    arguments = {"body": 1, "until": 30.0} | more
    return draw_pushes(CONFIG, np.random.default_rng(seed), **arguments)


def test_forces_times_and_directions_are_as_configured():
    pushes = [push for seed in range(20) for push in drawn(seed)]
    force = np.array([push.force for push in pushes])
    size = np.linalg.norm(force, axis=1)
    assert (force[:, 2] == 0.0).all()
    assert 50.0 <= size.min() < 55.0
    assert 75.0 < size.max() <= 80.0
    assert {(x > 0, y > 0) for x, y, _ in force.tolist()} == {
        *((True, True), (True, False), (False, True), (False, False))
    }
    for seed in range(20):
        starts = np.array([0.0, *(push.start for push in drawn(seed))])
        assert np.diff(starts).min() >= 1.0
        assert np.diff(starts).max() <= 2.0
        assert all(push.stop - push.start == pytest.approx(0.1) for push in pushes)
        assert drawn(seed)[-1].stop <= 30.0


def test_the_seed_decides():
    assert drawn(1) == drawn(1)
    assert drawn(1) != drawn(2)


@pytest.mark.parametrize(
    "wrong", [{"force": (2.0, 1.0)}, {"interval": (0.0, 1.0)}, {"force": (-1.0, 1.0)}]
)
def test_wrong_figures_are_refused(wrong):
    with pytest.raises(ValidationError):
        PushConfig(**({"force": (0.0, 1.0), "interval": (1.0, 1.0)} | wrong))


@pytest.mark.parametrize("period", [1, 7, 25, 50, 200])
def test_the_impulse_does_not_depend_on_how_steps_are_grouped(period):
    model = mujoco.MjModel.from_xml_string(BALL)
    data = mujoco.MjData(model)
    pushes = (
        Push(body=1, force=(10.0, 0.0, 0.0), start=0.05, stop=0.15),
        Push(body=1, force=(4.0, 3.0, 0.0), start=0.1, stop=0.2),  # both at 0.1 .. 0.15
    )
    schedule = PushSchedule(pushes, data, model.opt.timestep)
    for first in range(0, 200, period):
        last = min(first + period, 200)
        taken = 0
        for n in schedule.spans(first, last):
            mujoco.mj_step(model, data, n)
            taken += n
        assert taken == last - first
    impulse = np.array([10.0 * 0.1 + 4.0 * 0.1, 3.0 * 0.1, 0.0])
    np.testing.assert_allclose(2.0 * data.qvel[:3], impulse, atol=1e-12)
    assert not data.xfrc_applied.any()


def test_pushes_come_from_one_side_within_the_spread():
    for spread in (0.0, 0.5, 1.0):
        config = CONFIG.model_copy(update={"spread": spread})
        for seed in range(5):
            rng = np.random.default_rng(seed)
            pushes = draw_pushes(config, rng, body=1, until=60.0)
            force = np.array([push.force[:2] for push in pushes])
            directions = force / np.linalg.norm(force, axis=1, keepdims=True)
            least = (directions @ directions.T).min()
            assert least >= np.cos(2.0 * spread) - 1e-9
            assert (least < 0.999) == (spread > 0.0)


def test_without_pushes_other_forces_are_left_alone():
    model = mujoco.MjModel.from_xml_string(BALL)
    data = mujoco.MjData(model)
    data.xfrc_applied[1, 0] = 5.0
    assert list(PushSchedule((), data, 0.002).spans(0, 25)) == [25]
    assert data.xfrc_applied[1, 0] == 5.0
