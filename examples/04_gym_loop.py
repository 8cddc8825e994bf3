"""Run the standard Gymnasium loop with random actions."""

import gymnasium

import wbc_suite  # noqa: F401 - registers the environments

env = gymnasium.make("wbc_suite/Lift-v1", robots="Panda", reward_shaping=True)
observation, info = env.reset(seed=1)
env.action_space.seed(1)

total, steps, over = 0.0, 0, False
while not over and steps < 100:
    action = env.action_space.sample()
    observation, reward, terminated, truncated, info = env.step(action)
    total, steps, over = total + float(reward), steps + 1, terminated or truncated
env.close()

print("observed:", ", ".join(sorted(observation)))
print(
    f"random actions for {steps} steps: return {total:.2f}, lifted: {info['success']}"
)
