"""An arm from a URDF file, which states neither servos nor friction, lifts a cube."""

import numpy as np
import pytest

import wbc_suite
from wbc_suite.experts.registry import expert


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Panda", "XArm7"])
def test_the_expert_of_lift_lifts_with_an_imported_gripper(tmp_path, name):
    file = tmp_path / "arm.urdf"
    file.write_text(wbc_suite.load_robot(name, base="none").to_urdf(), encoding="utf-8")
    robot = wbc_suite.load_robot(file)
    assert robot.synergies
    place = robot.root.model_copy(update={"pos": (0.0, 0.0, 0.8)})
    env = wbc_suite.make("Lift", robots=robot.model_copy(update={"root": place}))
    lifted = 0
    for seed in range(3):
        observation, _ = env.reset(seed=seed)
        drive = expert(env.unwrapped, np.random.default_rng(seed))
        for _ in range(200):
            observation, *_, info = env.step(drive(observation))
            if info["success"]:
                lifted += 1
                break
    assert lifted == 3
