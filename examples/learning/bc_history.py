"""Behaviour cloning with history: the last observations give a chunk of actions.

Used like bc.py, which has the network and the commands. History tells apart moments
that look alike, such as closing fingers before and after the grasp, and shows
velocities; a chunk of actions is decided once.

Sources: Mandlekar et al. (2021), "What Matters in Learning from Offline Human
Demonstrations", CoRL (history); Zhao et al. (2023), "Learning Fine-Grained Bimanual
Manipulation with Low-Cost Hardware", RSS (chunks).
"""

from bc import METHOD
from imitation import last_policy, main
from training import arguments

Policy = last_policy(METHOD, "artifacts/learning/bc_history")

if __name__ == "__main__":
    main(arguments(__file__), METHOD)
