"""Step eight environments of one process in parallel threads.

With `--view` the first of them is shown in a browser.
"""

import sys

import gymnasium
import numpy as np

import wbc_suite  # noqa: F401 - registers the environments

envs = gymnasium.make_vec(
    "wbc_suite/Lift-v1",
    num_envs=8,
    vectorization_mode="vector_entry_point",
    robots="Panda",
    reward_shaping=True,
    horizon=20,
    render_mode="human" if "--view" in sys.argv else None,
)
observations, infos = envs.reset(seed=1)  # seeds 1 to 8
envs.action_space.seed(1)
first = envs.unwrapped.envs[0]  # type: ignore[attr-defined]
if first.render_mode:
    first.render()
    input("Open this address in a browser, then press Enter. ")

total, episodes = np.zeros(envs.num_envs), 0
for _ in range(42):  # a finished episode is reset in the next step
    actions = envs.action_space.sample()
    observations, rewards, terminated, truncated, infos = envs.step(actions)
    if first.render_mode:
        first.render()
    total += rewards
    episodes += int((terminated | truncated).sum())
envs.close()

print("cubes at:", np.round(observations["cube_pos"], 3).tolist())
print(f"{episodes} episodes, mean return {total.sum() / episodes:.2f}")
