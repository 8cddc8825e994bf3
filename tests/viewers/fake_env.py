"""A tiny stand-in for an environment: two hands that float, with a bounded reach."""

from types import SimpleNamespace

import gymnasium
import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.control.action import ActionLayout, ActionPart, SliceKind, Unit
from wbc_suite.control.ik.config import ControlledFrame
from wbc_suite.qp import ActiveLimit, LimitKind

MJCF = """
<mujoco>
  <visual><headlight active="0"/></visual>
  <worldbody>
    <light pos="0 0 3"/>
    <geom name="floor" type="plane" size="5 5 0.1" rgba="0.8 0.8 0.8 1"/>
    <body name="robot0_trunk" pos="0 0 0.9">
      <geom type="box" size="0.1 0.15 0.3" rgba="0.9 0.9 0.92 1"/>
      <geom type="capsule" size="0.12 0.2" group="3" rgba="0.9 0.3 0.3 1"/>
    </body>
    <body name="robot0_right_palm" pos="0.4 -0.2 1.0">
      <freejoint/>
      <geom type="ellipsoid" size="0.06 0.03 0.09" rgba="0.3 0.3 0.35 1"/>
      <site name="robot0_right_hand" pos="0 0 0"/>
    </body>
    <body name="robot0_left_palm" pos="0.4 0.2 1.0">
      <freejoint/>
      <geom type="capsule" size="0.04 0.05" rgba="0.3 0.3 0.35 1"/>
      <site name="robot0_left_hand" pos="0 0 0"/>
    </body>
  </worldbody>
</mujoco>
"""
REACH = 0.8  # m, from the trunk
STRIDE = 0.02  # m, furthest that a hand moves in a step


def part(name, kind, labels, bound):
    return ActionPart(
        name=name,
        kind=SliceKind(kind),
        labels=labels,
        units=(Unit("m"),) * len(labels),
        low=(-bound,) * len(labels),
        high=(bound,) * len(labels),
    )


AXES = ("x", "y", "z", "rx", "ry", "rz")
LAYOUT = ActionLayout(
    [
        part("right_hand", "pose", AXES, 10.0),
        part("left_hand", "pose", AXES, 10.0),
        part("right_gripper", "gripper", ("thumb", "fingers"), 1.0),
    ]
)


def upper_limit(joint):
    return ActiveLimit(
        kind=LimitKind.POSITION,
        subject=joint,
        side="upper",
        is_joint=True,
        unit="rad",
        multiplier=1.0,
    )


class FakeEnv(gymnasium.Env):
    def __init__(self):
        self.model = mujoco.MjModel.from_xml_string(MJCF)
        self.data = mujoco.MjData(self.model)
        self.simulation = SimpleNamespace(model=self.model, data=self.data)
        self.action_layout = LAYOUT
        self.hold_action = np.append(np.zeros(12), [-1.0, -1.0])
        self.config = SimpleNamespace(control_freq=50.0)
        frames = [
            ControlledFrame(name=side + "_hand", frame=side + "_hand")
            for side in ("right", "left")
        ]
        config = SimpleNamespace(
            input_type="absolute", input_ref_frame="world", frames=frames
        )
        self.controllers = [SimpleNamespace(config=config)]
        self.actions = []

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        mujoco.mj_resetData(self.model, self.data)
        mujoco.mj_forward(self.model, self.data)
        return {}, {}

    def step(self, action):
        self.actions.append(np.array(action))
        values = self.action_layout.unpack(action)
        frames = {
            name: self._follow(name, values[name], 7 * i)
            for i, name in enumerate(("right_hand", "left_hand"))
        }
        self.data.time += 0.02
        mujoco.mj_forward(self.model, self.data)
        reached = all(f["reached"] for f in frames.values())
        ik = {"reached": reached, "frames": frames}
        return {}, 0.0, False, False, {"ik": ik, "success": False}

    def _follow(self, name, command, address):
        trunk = np.array([0.0, 0.0, 0.9])
        goal = command[:3] - trunk
        distance = np.linalg.norm(goal)
        goal = trunk + goal * min(1.0, REACH / max(distance, 1e-9))
        here = self.data.qpos[address : address + 3]
        here += np.clip(goal - here, -STRIDE, STRIDE)
        quat = pin.Quaternion(pin.exp3(command[3:6])).coeffs()
        self.data.qpos[address + 3 : address + 7] = np.roll(quat, 1)
        side = name.split("_")[0]
        return {
            "reached": bool(distance <= REACH),
            "position_error": float(np.linalg.norm(command[:3] - here)),
            "orientation_error": 0.0,
            "reasons": []
            if distance <= REACH
            else [upper_limit(f"{side}_elbow_pitch_joint")],
        }
