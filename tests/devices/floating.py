"""An environment with nothing in it: limbs that stand wherever a test puts them."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin

from wbc_suite.control.action import ActionLayout, ActionPart, SliceKind, Unit
from wbc_suite.control.ik.config import ControlledFrame

AXES = ("x", "y", "z", "rx", "ry", "rz")
BODIES = """<mujoco><worldbody>
  {}
</worldbody></mujoco>"""
HAND = """<body name="{0}palm" pos="0.4 {1} 1">
  <freejoint/><geom size="0.05"/><site name="{0}hand"/>
</body>"""


def part(name, kind, labels, bound):
    return ActionPart(
        name=name,
        kind=SliceKind(kind),
        labels=labels,
        units=(Unit("m"),) * len(labels),
        low=(-bound,) * len(labels),
        high=(bound,) * len(labels),
    )


class FloatingEnv:
    """Hands that are at their targets at once, unless `stuck`."""

    def __init__(self, robots=1, rate=100.0, stuck=False):
        import mujoco

        self.stuck = stuck
        sides = {"right": -0.2, "left": 0.2}
        bodies = [
            HAND.format(f"robot{i}_{side}_", y)
            for i in range(robots)
            for side, y in sides.items()
        ]
        model = mujoco.MjModel.from_xml_string(BODIES.format("\n".join(bodies)))
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        self.simulation = SimpleNamespace(model=model, data=data)
        frames = [ControlledFrame(name=f"{s}_hand", frame=f"{s}_hand") for s in sides]
        config = SimpleNamespace(
            input_type="absolute", input_ref_frame="world", frames=frames
        )
        self.controllers = [SimpleNamespace(config=config)] * robots
        prefixes = [f"robot{i}_" if robots > 1 else "" for i in range(robots)]
        self.action_layout = ActionLayout(
            p
            for prefix in prefixes
            for p in (
                part(f"{prefix}right_hand", "pose", AXES, 10.0),
                part(f"{prefix}left_hand", "pose", AXES, 10.0),
                part(f"{prefix}right_gripper", "gripper", ("thumb", "rest"), 1.0),
            )
        )
        self.config = SimpleNamespace(control_freq=rate)
        self.unwrapped = self

    @property
    def hold_action(self):
        action = np.zeros(self.action_layout.size)
        for s in self.action_layout.slices:
            if s.kind == "gripper":
                action[s.start : s.stop] = -1.0
        return action

    def reset(self, seed=None):
        import mujoco

        mujoco.mj_resetData(self.simulation.model, self.simulation.data)
        mujoco.mj_forward(self.simulation.model, self.simulation.data)
        return {}, {}

    def step(self, action):
        import mujoco

        values = self.action_layout.unpack(action)
        data = self.simulation.data
        hands = [s.name for s in self.action_layout.slices if s.kind == "pose"]
        for k, name in enumerate(hands):
            if self.stuck:
                break
            turn = pin.Quaternion(pin.exp3(values[name][3:])).coeffs()
            data.qpos[7 * k : 7 * k + 3] = values[name][:3]
            data.qpos[7 * k + 3 : 7 * k + 7] = np.roll(turn, 1)
        mujoco.mj_forward(self.simulation.model, data)
        return {}, 0.0, False, False, {"success": False}


def hand(x=0.0, y=0.0, z=0.0, *, turn=(0.0, 0.0, 0.0)):
    return pin.SE3(pin.exp3(np.array(turn, dtype=float)), np.array([x, y, z]))
