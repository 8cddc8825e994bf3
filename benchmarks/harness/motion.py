"""Motions that hands are asked for, and how well they were followed.

A motion is a list of goals, one per action: shape (n, 6), position and rotation vector
relative to where the hand stood at first, in world axes. What was measured has the same
form, one row per physics step. NumPy only: peers import this in their own environments.
"""

import numpy as np

__all__ = [
    "DIRECTIONS",
    "RATE",
    "circle",
    "circle_motion",
    "hold_motion",
    "judge_circle",
    "judge_step",
    "step_motion",
]

RATE = 20.0  # actions per second
SECONDS = 2.0  # of a step
STEP = (0.05, np.deg2rad(20.0))  # m, rad
BAND = 0.02  # share of the step within which the hand has settled
RADIUS, FREQUENCY, TURNS = 0.10, 0.25, 1.0  # m, Hz

DIRECTIONS = np.vstack([np.eye(3), -np.eye(3)])


def step_motion(direction: int) -> np.ndarray:
    """Return a step of 5 cm and 20 degrees, held; six directions, 0 to 5."""
    goal = np.zeros(6)
    goal[:3] = STEP[0] * DIRECTIONS[direction]
    goal[3:] = STEP[1] * DIRECTIONS[(direction + 1) % 6]
    return np.tile(goal, (round(SECONDS * RATE), 1))


def circle(times: np.ndarray) -> np.ndarray:
    """Return an upright circle that begins and ends where the hand stands, (n, 6)."""
    phase = 2.0 * np.pi * FREQUENCY * times
    goals = np.zeros((len(times), 6))
    goals[:, 1] = RADIUS * np.sin(phase)
    goals[:, 2] = RADIUS * (1.0 - np.cos(phase))
    return goals


def circle_motion() -> np.ndarray:
    """Return the goals of the circle: each is where to be when its action ends."""
    actions = round(TURNS / FREQUENCY * RATE)
    return circle(np.arange(1, actions + 1) / RATE)


def hold_motion(seconds: float) -> np.ndarray:
    """Return goals that hold."""
    return np.zeros((round(seconds * RATE), 6))


def judge_step(
    goals: np.ndarray, found: np.ndarray, dt: float
) -> dict[str, float | None]:
    """Return settling time (s; None if never), overshoot (share) and last errors.

    Args:
        goals: The motion.
        found: Where the hand was, shape (steps, 6).
        dt: Time between two rows of that, s.
    """
    goal, settled, overshoot, errors = goals[0], 0.0, 0.0, []
    for half in (slice(0, 3), slice(3, 6)):
        size = float(np.linalg.norm(goal[half]))
        along = found[:, half] @ (goal[half] / size)
        error = np.linalg.norm(found[:, half] - goal[half], axis=1)
        outside = np.flatnonzero(error > BAND * size)
        last = outside[-1] + 1 if outside.size else 0
        settled = max(settled, np.inf if last == len(found) else dt * last)
        overshoot = max(overshoot, float(along.max()) / size - 1.0)
        errors.append(float(error[-1]))
    return {
        "settling_s": settled if np.isfinite(settled) else None,
        "overshoot": max(overshoot, 0.0),
        "error_mm": 1e3 * errors[0],
        "error_deg": float(np.rad2deg(errors[1])),
    }


def judge_circle(found: np.ndarray, dt: float) -> dict[str, float]:
    """Return the worst and median distance from the circle's moving point, mm."""
    times = dt * np.arange(1, len(found) + 1)
    error = np.linalg.norm(found[:, :3] - circle(times)[:, :3], axis=1)
    late = error[times >= 1.0]
    return {
        "worst_mm": 1e3 * float(late.max()),
        "median_mm": 1e3 * float(np.median(late)),
    }
