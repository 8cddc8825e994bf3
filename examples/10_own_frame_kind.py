"""A kind of controlled frame of your own: only the height of a hand is commanded."""

import numpy as np

import wbc_suite
from wbc_suite.control import FrameKind, SliceKind, register_frame_kind


@register_frame_kind
class Height(FrameKind):
    """Height of a frame; it moves freely to the sides, and turns freely."""

    name = "height"
    labels = ("z",)
    slice_kind = SliceKind.POSITION


config = wbc_suite.load_composite_controller_config("WHOLE_BODY_IK", robot="Panda")
config["frame"] = [{"name": "right_hand", "frame": "right_tcp", "kind": "height"}]
env = wbc_suite.make("Lift", robots="Panda", controller_configs=config)
env.reset(seed=0)
print(env.action_layout)

site = env.simulation.data.site("robot0_right_tcp")
goal = env.action_layout.pack({"right_hand": site.xpos[2:] + 0.1}, base=env.hold_action)
for _ in range(29):
    env.step(goal)
*_, info = env.step(goal)
print("height:", np.round(site.xpos[2], 3), "m of", np.round(goal[0], 3), "m")
print(info["ik"]["frames"]["right_hand"])
env.close()
