"""Every two-arm benchmark with pairs of arms, both ways round, and two-armed robots."""

import pytest
from conftest import penetration
from posing import act_at_random

import wbc_suite

BENCHMARKS = ("TwoArmHandover", "TwoArmLift", "TwoArmPegInHole", "TwoArmTransport")
ARMS = ("Panda", "Sawyer", "IIWA", "IIWA14", "UR5e", "Jaco", "Kinova3", "XArm7")
ARMS += ("PandaOmron", "PandaDexLH", "PandaDexRH")
TWO_ARMED = ("Baxter", "Tiago", "GR1", "GR1ArmsOnly")
CASES = [(name, "single-robot") for name in TWO_ARMED] + [
    ([name, name], way) for name in ARMS for way in ("opposed", "parallel")
]


@pytest.mark.sample(12)
@pytest.mark.slow
@pytest.mark.parametrize("name", BENCHMARKS)
@pytest.mark.parametrize(("robots", "way"), CASES)
def test_robots_start_clear_of_everything_and_act(name, robots, way):
    env = wbc_suite.make(
        name, robots=robots, env_configuration=way, reward_shaping=True
    )
    for seed in range(8):
        env.reset(seed=seed)  # else a PlacementError
        assert penetration(env) < 5e-4, seed
    act_at_random(env, 20, seed=0)
    env.close()


@pytest.mark.parametrize("robot", ["PandaDexLH", "PandaDexRH"])
def test_long_hands_start_clear_of_the_pot(robot):
    env = wbc_suite.make("TwoArmLift", robots=[robot, robot])
    for seed in range(20):
        env.reset(seed=seed)  # else a PlacementError
        assert not any(map(env.benchmark.scene.grasped, env.benchmark.states))
