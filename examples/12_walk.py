"""GR1 on its own feet: it walks, is pushed, and stands still again.

The action of WHOLE_BODY_ID has hand poses, `walk` (m/s, m/s, rad/s) and `height`.
"""

import wbc_suite

env = wbc_suite.make("Lift", robots="GR1FreeBody", controller_configs="WHOLE_BODY_ID")
env.reset(seed=0)
layout = env.action_layout
stand = env.hold_action
walk = layout.pack({"walk": [-0.3, 0.0, 0.2]}, base=stand)

trunk = env.simulation.data.body("robot0_base_link")
start = trunk.xpos.copy()
for i in range(160):
    action = walk if 20 <= i < 100 else stand
    trunk_force = [0.0, 250.0, 0.0] if 110 <= i < 112 else [0.0, 0.0, 0.0]
    env.simulation.data.xfrc_applied[trunk.id, :3] = trunk_force
    *_, info = env.step(action)
    if i % 20 == 19:
        balance = info["balance"]
        way = trunk.xpos - start
        print(
            f"{way[0]:6.2f} {way[1]:6.2f} m, stands on {balance['stance']}, "
            f"capture point {100 * balance['margin']:.0f} cm inside, "
            f"fell: {balance['fell']}"
        )
