"""A gripper alone on a carriage: it picks a thing from a table, and is shaken.

Try one gripper, with figures and a picture:

    python tests/robot/grasp_rig.py panda_gripper cube.png
"""

import sys
from dataclasses import dataclass

import mujoco
import numpy as np
import pinocchio as pin

import wbc_suite
from wbc_suite.control import RobotState
from wbc_suite.control.part.gripper import GripperController
from wbc_suite.scene import TableConfig, add_box, add_table, attach_robot, empty_arena

PREFIX = "robot0_"
TABLE = 0.4  # m, height of the table's top
CARRIAGE = 200.0  # kg, moves as it is told whatever a gripper of 2 kg does
STIFFNESS = 2500.0  # 1/s^2, of the carriage's position
DROP = 0.10  # m, from which the open gripper comes
LIFT = 0.15  # m
SHAKE = 5.0  # m/s^2
FREQUENCY = 3.0  # Hz; 5 m/s^2 are 14 mm to either side
CUBE = 0.02  # m, half an edge
CUBE_MASS = 0.1  # kg
CLEAR = 0.002  # m, between fingertips and table
GRIPPED = 0.9  # s, to close and to squeeze


@dataclass(frozen=True, kw_only=True, slots=True)
class Hold:
    """How a thing was held from the lift to the end.

    Attributes:
        slip: Largest way of the thing in the tool's frame, m.
        turn: Largest turn in the tool's frame, rad.
        links: Links that touched it at the end.
        depth: Deepest penetration at the end, m.
        clearance: Height above the table at the end, m.
        force: Sum of normal forces at the end, N.
    """

    slip: float
    turn: float
    links: frozenset[str]
    depth: float
    clearance: float
    force: float


class GraspRig:
    """A table with a thing on it, below a gripper that points down.

    Args:
        name: Catalogue name of the gripper.
    """

    def __init__(self, name):
        self.robot = wbc_suite.load_robot(f"gripper/{name}")
        (self.gripper,) = self.robot.synergies
        tool = self.pose_of("tcp")
        spec = empty_arena()
        add_table(spec, TableConfig(size=(0.8, 0.8, 0.05), center=(0, 0, TABLE)))
        volume = (2 * CUBE) ** 3
        add_box(
            spec,
            "thing",
            half_size=(CUBE, CUBE, CUBE),
            rgba=(0.85, 0.25, 0.15, 1),
            density=CUBE_MASS / volume,
        )
        spec.body("thing").pos = (0, 0, TABLE + CUBE)
        self._add_carriage(spec, tool)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.state = RobotState(self.model, self.data, self.robot, prefix=PREFIX)
        self.hand = GripperController(
            "gripper", self.robot.synergies[self.gripper], self.state
        )
        self.start = self.target = np.array([0.0, 0.0, DROP])
        self._begin()

    def pose_of(self, name):
        """Return T_rf of a frame of the gripper at its zero posture."""
        model = self.robot.to_pinocchio()
        data = model.createData()
        q = pin.neutral(model)
        pin.framesForwardKinematics(model, data, q)
        return data.oMf[model.getFrameId(name)].copy()

    def _add_carriage(self, spec, tool):
        """Hang the gripper so that at zero its tool is at the thing's centre."""
        body = spec.worldbody.add_body(name="carriage", gravcomp=1)
        body.explicitinertial = True
        body.mass, body.inertia = CARRIAGE, (1.0, 1.0, 1.0)
        for axis in np.eye(3):
            body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        down = pin.SE3(
            pin.Quaternion(0.0, 1.0, 0.0, 0.0).matrix(), np.array([0, 0, TABLE + CUBE])
        )
        root = down * tool.inverse()
        x, y, z, w = pin.Quaternion(root.rotation).normalized().coeffs()
        self.robot = self.robot.with_root(
            "fixed", pos=tuple(root.translation), quat=(w, x, y, z)
        )
        attach_robot(spec, self.robot, PREFIX, frame=body.add_frame())

    def _begin(self):
        model, data = self.model, self.data
        joints = [j for j in range(model.njnt) if not model.joint(j).name]
        self.carriage = model.jnt_dofadr[joints], model.jnt_qposadr[joints]
        synergies = self.robot.synergies[self.gripper]
        lowest = self._sweep()
        self.above = max(0.0, TABLE + CLEAR - lowest)
        self.start = self.target = self.start + np.array([0.0, 0.0, self.above])
        data.qpos[self.carriage[1]] = self.start
        self._set_posture({s.name: -1.0 for s in synergies})
        self.command({s.name: -1.0 for s in synergies})
        mujoco.mj_forward(model, data)

    def _set_posture(self, command):
        for joint, value in self.posture(command).items():
            self.data.joint(PREFIX + joint).qpos = value

    def _sweep(self):
        """Return the height of the lowest point that closing fingers reach, m.

        Above the place where the tool's frame is at the thing's centre.
        """
        model, data = self.model, self.data
        geoms = [g for g in range(model.ngeom) if model.geom(g).name.startswith(PREFIX)]
        geoms = [g for g in geoms if model.geom_contype[g]]
        lowest = np.inf
        for closed in np.linspace(-1.0, 1.0, 21):
            synergies = self.robot.synergies[self.gripper]
            self._set_posture({s.name: closed for s in synergies})
            mujoco.mj_kinematics(model, data)
            rows = data.geom_xmat[geoms].reshape(-1, 3, 3)[:, 2]
            middle = data.geom_xpos[geoms, 2]
            middle += np.sum(rows * model.geom_aabb[geoms, :3], axis=1)
            half = np.sum(np.abs(rows) * model.geom_aabb[geoms, 3:], axis=1)
            lowest = min(lowest, float((middle - half).min()))
        return lowest

    def posture(self, command):
        """Return the joint values that a command asks for, with followers."""
        values = {}
        for synergy in self.robot.synergies[self.gripper]:
            closed = (command[synergy.name] + 1.0) / 2.0
            for joint, low in synergy.open.items():
                values[joint] = low + closed * (synergy.closed[joint] - low)
        for joint in self.robot.joints:
            if joint.mimic is not None and joint.mimic.joint in values:
                leader = values[joint.mimic.joint]
                values[joint.name] = joint.mimic.ratio * leader + joint.mimic.offset
        return values

    def command(self, command):
        """Set the gripper's action by synergy."""
        names = [s.name for s in self.robot.synergies[self.gripper]]
        self.hand.set_goal(np.array([command[name] for name in names]))

    def step(self, position, velocity, acceleration):
        """Advance one step with the carriage on its way."""
        model, data = self.model, self.data
        mujoco.mj_step1(model, data)
        dofs, places = self.carriage
        wanted = acceleration + STIFFNESS * (position - data.qpos[places])
        wanted += 2.0 * np.sqrt(STIFFNESS) * (velocity - data.qvel[dofs])
        data.qfrc_applied[dofs] = CARRIAGE * wanted
        data.ctrl[self.state.actuator_ids[self.hand.outputs]] = self.hand.set_points()
        mujoco.mj_step2(model, data)
        assert not data.warning.number.any()

    def wait(self, seconds):
        """Stay where the carriage is meant to be."""
        zero = np.zeros(3)
        for _ in range(round(seconds / self.model.opt.timestep)):
            self.step(self.target, zero, zero)

    def move(self, change, seconds):
        """Move the carriage by a vector on a quintic."""
        begin, change = self.target, np.asarray(change, dtype=np.float64)
        dt = self.model.opt.timestep
        for k in range(round(seconds / dt)):
            s = (k + 1) * dt / seconds
            way = s**3 * (10 - 15 * s + 6 * s**2)
            speed = 30 * s**2 * (1 - s) ** 2 / seconds
            rate = 60 * s * (1 - s) * (1 - 2 * s) / seconds**2
            self.step(begin + way * change, speed * change, rate * change)
        self.target = begin + change

    def shake(self, axis, seconds, amplitude=SHAKE):
        """Accelerate by `amplitude cos(w t)` along an axis, over whole periods."""
        axis = np.asarray(axis, dtype=np.float64)
        w, dt = 2 * np.pi * FREQUENCY, self.model.opt.timestep
        for k in range(round(seconds / dt)):
            t = (k + 1) * dt
            way = amplitude / w**2 * (1 - np.cos(w * t))
            rates = amplitude / w * np.sin(w * t), amplitude * np.cos(w * t)
            self.step(self.target + way * axis, rates[0] * axis, rates[1] * axis)
            self._note()

    def held(self):
        """Return T_ft, the thing in the tool's frame."""
        site, body = self.data.site(PREFIX + "tcp"), self.data.body("thing")
        tool = pin.SE3(site.xmat.reshape(3, 3), site.xpos)
        return tool.inverse() * pin.SE3(body.xmat.reshape(3, 3), body.xpos)

    def grip(self):
        """Come down, close, lift; remember how the thing lies in the hand."""
        self.wait(0.1)
        self.move((0, 0, -DROP), 0.5)
        self.command({s.name: 1.0 for s in self.robot.synergies[self.gripper]})
        self.wait(GRIPPED)
        self.gripped = self.held()
        self.slip = self.turn = 0.0
        self.move((0, 0, LIFT), 0.6)
        self._note()

    def _note(self):
        moved = self.gripped.actInv(self.held())
        self.slip = max(self.slip, float(np.linalg.norm(moved.translation)))
        self.turn = max(self.turn, float(np.linalg.norm(pin.log3(moved.rotation))))

    def result(self):
        """Return how the thing was held, and how it is held now."""
        model, data = self.model, self.data
        thing, links, depth, total = model.geom("thing").id, set(), 0.0, 0.0
        force = np.zeros(6)
        for k, contact in enumerate(data.contact):
            if thing not in contact.geom:
                continue
            (other,) = (g for g in contact.geom if g != thing)
            body = model.body(model.geom_bodyid[other]).name
            mujoco.mj_contactForce(model, data, k, force)
            links.add(body.removeprefix(PREFIX))
            depth, total = max(depth, -float(contact.dist)), total + force[0]
        return Hold(
            slip=self.slip,
            turn=self.turn,
            links=frozenset(links),
            depth=depth,
            clearance=float(data.body("thing").xpos[2] - TABLE - CUBE),
            force=total,
        )


def main(name, picture=None):
    """Try one gripper: print how it held, and draw it; then shake it loose."""
    rig = GraspRig(name)
    rig.grip()
    print("lifted:", rig.result())
    if picture:
        from PIL import Image

        from wbc_suite.viewers.offscreen import Camera

        with Camera(rig.model, rig.data, subject=PREFIX) as camera:
            Image.fromarray(camera.take(rig.data)).save(picture)
    amplitude = SHAKE
    while amplitude < 200.0 and "table" not in rig.result().links:
        for axis in np.eye(3):
            rig.shake(axis, seconds=2.0, amplitude=amplitude)
        print(f"shaken at {amplitude:g} m/s^2:", rig.result())
        amplitude *= 2.0


if __name__ == "__main__":
    main(*sys.argv[1:])
