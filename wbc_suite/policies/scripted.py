"""A policy that succeeds, to try recordings and rollouts with."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from wbc_suite.envs import RobotEnv
from wbc_suite.errors import ConfigError
from wbc_suite.policies.policy import Policy
from wbc_suite.typing import Vector

__all__ = ["scripted"]

GAIN = 8.0  # of the full action, per metre
ABOVE = 0.08  # m over the cube, on the way to it
NEAR, CLOSED = 0.008, 25  # m; actions until fingers have closed


def scripted(env: RobotEnv, rng: np.random.Generator) -> Policy:
    """Make a policy that picks the cube up: over it, down, close, up.

    It works by differences of position, as `OSC_POSE` takes them, for one arm.
    """
    names = [part.name for part in env.action_layout.slices]
    if env.benchmark.name != "Lift" or names != ["right", "right_gripper"]:
        raise ConfigError(
            "The scripted policy picks up the cube of Lift, with one arm by OSC_POSE; "
            f"it does not know {env.benchmark.name} with {', '.join(names)}."
        )
    del rng
    grasped = 0

    def drive(seen: Mapping[str, Any]) -> Vector:
        nonlocal grasped
        action = env.hold_action
        away = seen["cube_pos"] - seen["robot0_eef_pos"]
        aside = float(np.linalg.norm(away[:2]))
        if grasped == 0 and aside > NEAR:
            away[2] += ABOVE
        elif grasped == 0 and abs(away[2]) > NEAR:
            pass
        else:
            grasped += 1
            away = np.array([0.0, 0.0, 0.1 if grasped > CLOSED else 0.0])
        action[:3] = np.clip(GAIN * away, -1.0, 1.0)
        action[env.action_layout.slices[1].start :] = 1.0 if grasped else -1.0
        return action

    return drive
