"""Move a mobile manipulator to a target in reach and to one out of reach.

With `--view` the motion is shown in a browser.
"""

import sys

import numpy as np

import wbc_suite

VIEW = "--view" in sys.argv

env = wbc_suite.make(
    "Lift",
    robots="Tiago",
    controller_configs="WHOLE_BODY_IK",
    horizon=1000,
    render_mode="human" if VIEW else None,
)
env.reset(seed=0)
if VIEW:
    input("Open this address in a browser, then press Enter. ")
layout = env.action_layout
print(layout)

start = layout.unpack(env.hold_action)


def move(offset: list[float], seconds: float) -> dict:
    """Move the right hand by an offset from its start; return its report."""
    hand = start["right_hand"] + np.array([*offset, 0.0, 0.0, 0.0])
    action = layout.pack({"right_hand": hand}, base=env.hold_action)
    info = {}
    for _ in range(round(seconds * 20)):
        *_, info = env.step(action)
    return info["ik"]["frames"]["right_hand"]


near = move([0.10, 0.05, 0.10], seconds=3.0)
print(f"within reach: {1e3 * near['position_error']:.2f} mm away")

far = move([0.0, 0.0, 3.0], seconds=3.0)
print(f"3 m up: {far['position_error']:.2f} m away:", *far["reasons"][:2])
env.close()
