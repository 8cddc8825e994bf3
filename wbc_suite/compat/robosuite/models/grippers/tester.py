"""A gripper alone in a world with a table and a box, as robosuite tests grippers."""

import xml.etree.ElementTree as ET
from typing import Any

import numpy as np

from wbc_suite.compat.robosuite.models.arenas import TableArena
from wbc_suite.compat.robosuite.models.objects import BoxObject
from wbc_suite.compat.robosuite.models.tasks import MujocoWorldBase
from wbc_suite.compat.robosuite.renderers import Viewer
from wbc_suite.compat.robosuite.utils.binding_utils import MjSim
from wbc_suite.compat.robosuite.utils.mjcf_utils import new_actuator, new_joint

TOP = 0.1  # height of the table, m
PLAN = ((False, False), (True, False), (True, True), (False, True))
"""Whether the gripper is low, and closed: it lowers, closes, and lifts."""


class GripperTester:
    """Lowers a gripper onto a box, closes it and lifts.

    `pos` and `quat` place it, as MJCF has them; `gripper_low_pos` and
    `gripper_high_pos` are positions of its vertical slide, m; `step_time` is the number
    of physics steps of each move.
    """

    def __init__(
        self,
        gripper: Any,
        pos: str,
        quat: str,
        gripper_low_pos: float,
        gripper_high_pos: float,
        box_size: Any = None,
        box_density: float = 10000,
        step_time: int = 400,
        render: bool = True,
    ) -> None:
        if gripper_low_pos > gripper_high_pos:
            raise ValueError(
                f"gripper_low_pos {gripper_low_pos} is above gripper_high_pos "
                f"{gripper_high_pos}."
            )
        self.gripper, self.render, self.step_time = gripper, render, step_time
        self.heights = gripper_high_pos, gripper_low_pos
        self.world = world = MujocoWorldBase()
        world.merge(TableArena((0.4, 0.4, 0.05), table_offset=(0, 0, TOP)))
        carrier = ET.SubElement(world.worldbody, "body", name="gripper_base")
        carrier.attrib |= {"pos": pos, "quat": quat}
        slide = {"type": "slide", "axis": "0 0 -1", "damping": "50"}
        carrier.append(new_joint("gripper_z_joint", **slide))
        world.merge(gripper, merge_body="gripper_base")
        kp = {"act_type": "position", "kp": "500"}
        world.actuator.append(new_actuator("gripper_z", "gripper_z_joint", **kp))
        size = np.full(3, 0.02) if box_size is None else np.asarray(box_size)
        self.cube = BoxObject("object", size=size, density=box_density)
        box = self.cube.get_obj()
        box.set("pos", f"0 0 {TOP + size[2]}")
        world.worldbody.append(box)

    def start_simulation(self) -> None:
        """Compile the world, with the gripper up and as it starts an episode."""
        self.sim = MjSim.from_xml_string(self.world.get_xml())
        self.viewer = Viewer(self.sim)
        model = self.sim.model
        self._z = model.actuator_name2id("gripper_z")
        self._z_dof = model.get_joint_qvel_addr("gripper_z_joint")
        self._fingers = [model.actuator_name2id(n) for n in self.gripper.actuators]
        self._box = model.body_name2id(self.cube.root_body)
        data = self.sim.data
        data.set_joint_qpos("gripper_z_joint", self.heights[0])
        for joint, value in zip(
            self.gripper.joints, self.gripper.init_qpos, strict=True
        ):
            data.set_joint_qpos(joint, value)
        self._start = self.sim.get_state()
        self.reset()

    def reset(self) -> None:
        """Start again."""
        self.sim.set_state(self._start)
        self.sim.forward()
        self._height = self.sim.data.body_xpos[self._box][2]
        self.gripper_z_is_low, self.gripper_is_closed = PLAN[0]

    def step(self) -> None:
        """Advance physics by one step.

        Raises:
            RuntimeError: If the simulation was not started.
        """
        if not hasattr(self, "sim"):
            raise RuntimeError("Call start_simulation before calling step.")
        data, model = self.sim.data, self.sim.model
        data.ctrl[self._z] = self.heights[self.gripper_z_is_low]
        action = np.full(self.gripper.dof, 1.0 if self.gripper_is_closed else -1.0)
        low, high = model.actuator_ctrlrange[self._fingers].T
        share = (np.asarray(self.gripper.format_action(action)) + 1.0) / 2.0
        data.ctrl[self._fingers] = low + (high - low) * share
        data.qfrc_applied[self._z_dof] = data.qfrc_bias[self._z_dof]
        self.sim.step()

    def loop(
        self, total_iters: int = 1, test_y: bool = False, y_baseline: float = 0.01
    ) -> None:
        """Grasp and lift.

        Raises:
            ValueError: With `test_y`, if the box is not lifted by `y_baseline`, m.
        """
        for _ in range(total_iters):
            for self.gripper_z_is_low, self.gripper_is_closed in PLAN:
                for _ in range(self.step_time):
                    self.step()
            if test_y and self.object_height <= y_baseline:
                raise ValueError(
                    f"The box is lifted by {self.object_height:.4f} m, less than "
                    f"{y_baseline} m."
                )

    @property
    def object_height(self) -> float:
        """How far the box is lifted, m."""
        return float(self.sim.data.body_xpos[self._box][2] - self._height)

    def close(self) -> None:
        """Do nothing: there is no window."""
