"""Two-arm benchmarks are not solved by one arm, however the robots stand."""

import pytest
from conftest import put

import wbc_suite

WAYS = [
    pytest.param(["Panda", "Panda"], "opposed", id="opposed"),
    pytest.param(["Panda", "Panda"], "parallel", id="parallel"),
    pytest.param("Baxter", "single-robot", id="one-robot"),
]
HOLDING = [(True, True), (True, False), (False, True), (False, False)]


def hold(monkeypatch, task, holding):
    for hand, holds in zip(task.hands, holding, strict=True):
        for measure in ("grasps", "clamps", "bears"):
            monkeypatch.setattr(hand, measure, lambda *_, holds=holds: holds)
        force = 100.0 if holds else 0.0
        monkeypatch.setattr(hand, "friction", lambda *_, force=force: force)
    holders = [hand for hand, holds in zip(task.hands, holding, strict=True) if holds]
    monkeypatch.setattr(task.scene, "hands_at", lambda _: holders)


@pytest.mark.parametrize(("robots", "way"), WAYS)
def test_a_pot_is_lifted_by_both(robots, way, monkeypatch):
    env = wbc_suite.make("TwoArmLift", robots=robots, env_configuration=way)
    env.reset(seed=0)
    task = put(env, pot=((0.0, 0.0, 0.8 + 0.07 + 0.105), None))
    assert len(task.hands) == 2
    for holding in HOLDING:
        hold(monkeypatch, task, holding)
        assert task.success() == all(holding), holding
        assert task.reward(shaped=False) == float(all(holding))


@pytest.mark.slow
@pytest.mark.parametrize(("robots", "way"), WAYS)
def test_a_hammer_is_handed_over_before_the_second_arm_has_it(robots, way, monkeypatch):
    env = wbc_suite.make("TwoArmHandover", robots=robots, env_configuration=way)
    for handed in (False, True):
        env.reset(seed=0)
        task = put(env, hammer=((0.0, 0.0, 1.0), None))
        if handed:
            hold(monkeypatch, task, (True, True))
            task.after_step()
        for holding in HOLDING:
            hold(monkeypatch, task, holding)
            done = handed and holding == (False, True)
            assert task.success() == done, (handed, holding)


@pytest.mark.parametrize(("robots", "way"), WAYS)
def test_a_payload_or_trash_alone_is_no_transport(robots, way):
    env = wbc_suite.make("TwoArmTransport", robots=robots, env_configuration=way)
    z = 0.81 - 1e-4
    inside = {
        "payload": ((0.21, 0.45, z + 0.018), (0.5, 0.5, 0.5, 0.5)),
        "trash": ((-0.24, 0.45, z + 0.02), None),
    }
    for names in (["payload"], ["trash"], ["payload", "trash"]):
        env.reset(seed=0)
        task = put(env, **{name: inside[name] for name in names})
        for _ in range(5):  # until they are at rest
            env.step(env.hold_action)
        assert task.success() == (len(names) == 2), names
