"""A gripper alone on a carriage: it picks an object from a table, and is shaken.

Try one gripper, with figures and a picture:

    python tests/robot/grasp_rig.py panda_gripper cube.png
    python tests/robot/grasp_rig.py fourier_right_hand can.png --can
"""

import sys
from dataclasses import dataclass

import mujoco
import numpy as np
import pinocchio as pin

import wbc_suite
from wbc_suite.control import RobotState
from wbc_suite.control.part.gripper import GripperController
from wbc_suite.scene import TableConfig, add_table, attach_robot, empty_arena
from wbc_suite.scene.objects import box

PREFIX = "robot0_"
TABLE = 0.4  # m, height of the table's top
CARRIAGE = 200.0  # kg, much heavier than a gripper of 2 kg
STIFFNESS = 2500.0  # 1/s^2, of the carriage's position
CLEAR = 0.002  # m, between fingertips and table
AWAY = 0.12  # m, from which the open gripper comes
LIFT = 0.15  # m
SHAKE = 5.0  # m/s^2
FREQUENCY = 3.0  # Hz; 5 m/s^2 are 14 mm to either side
GRIPPED = 0.9  # s, to close and to squeeze


@dataclass(frozen=True, kw_only=True, slots=True)
class SceneObject:
    """What is gripped.

    Attributes:
        grasp: The grasp that it needs; a gripper without takes its only one.
        approach: R_wt of the tool that grips it.
        half: Half its height, m.
        mass: In kg.
    """

    grasp: str
    approach: np.ndarray
    half: float
    mass: float


DOWN = np.diag([1.0, -1.0, -1.0])
SIDEWAYS = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
"""z ahead and x up."""
CUBE = SceneObject(grasp="pinch", approach=DOWN, half=0.02, mass=0.1)
CAN = SceneObject(grasp="wrap", approach=SIDEWAYS, half=0.08, mass=0.3)
CAN_RADIUS = 0.03  # m


@dataclass(frozen=True, kw_only=True, slots=True)
class Hold:
    """How an object was held from the lift to the end.

    Attributes:
        slip: Largest way of the object in the tool's frame, m.
        turn: Largest turn in the tool's frame, rad.
        links: Links that touched it at the end.
        depth: Deepest penetration at the end, m.
        rise: Height above the place where it stood, at the end, m.
        force: Sum of normal forces at the end, N.
    """

    slip: float
    turn: float
    links: frozenset[str]
    depth: float
    rise: float
    force: float

    def __str__(self):
        return (
            f"slip {1e3 * self.slip:.2f} mm, turn {self.turn:.3f} rad, sunk "
            f"{1e3 * self.depth:.2f} mm, {self.force:.1f} N, rise {self.rise:.3f} m, "
            f"touched by {', '.join(sorted(self.links))}"
        )


class GraspRig:
    """A table with an object on it, and an open gripper before it.

    Args:
        name: Catalogue name of the gripper.
        item: Object to grip.
    """

    def __init__(self, name, item=CUBE):
        self.robot, self.item = wbc_suite.load_robot(f"gripper/{name}"), item
        (self.synergies,) = self.robot.synergies.values()
        frames = [frame.name for frame in self.robot.frames]
        self.tool = item.grasp if item.grasp in frames else "tcp"
        self.model = self._scene().compile()
        self.data = mujoco.MjData(self.model)
        self.state = RobotState(self.model, self.data, self.robot, prefix=PREFIX)
        self.hand = GripperController("gripper", self.synergies, self.state)
        joints = [self.model.joint(f"carriage_{axis}") for axis in "xyz"]
        self._dofs = [joint.dofadr[0] for joint in joints]
        self._places = [joint.qposadr[0] for joint in joints]
        self._begin()

    def _scene(self):
        spec = empty_arena()
        add_table(spec, TableConfig(size=(0.4, 0.4, 0.05), center=(0, 0, TABLE)))
        if self.item is CAN:
            _add_can(spec)
        else:
            half = self.item.half
            density = self.item.mass / (2 * half) ** 3
            size, red = (half, half, half), (0.85, 0.25, 0.15, 1)
            box("object", size, color=red, density=density).add_to(spec)
        centre = np.array([0.0, 0.0, TABLE + self.item.half])
        spec.body("object").pos = centre
        body = spec.worldbody.add_body(name="carriage", gravcomp=1)
        body.explicitinertial = True
        body.mass, body.inertia = CARRIAGE, (1.0, 1.0, 1.0)
        slide = mujoco.mjtJoint.mjJNT_SLIDE
        for letter, axis in zip("xyz", np.eye(3), strict=True):
            body.add_joint(name=f"carriage_{letter}", type=slide, axis=axis)
        root = pin.SE3(self.item.approach, centre) * self._tool_pose().inverse()
        x, y, z, w = pin.Quaternion(root.rotation).normalized().coeffs()
        pose = {"pos": tuple(root.translation), "quat": (w, x, y, z)}
        self.robot = self.robot.with_root("fixed", **pose)
        attach_robot(spec, self.robot, PREFIX, frame=body.add_frame())
        return spec

    def _tool_pose(self):
        """Return T_rt, the tool in the gripper's first link; no joint moves it."""
        model = self.robot.to_pinocchio()
        data = model.createData()
        pin.framesForwardKinematics(model, data, pin.neutral(model))
        return data.oMf[model.getFrameId(self.tool)].copy()

    def _begin(self):
        """Place the open gripper, so high that closing never reaches the table."""
        lowest = min(self._lowest(share) for share in np.linspace(0.0, 1.0, 21))
        self.above = max(0.0, TABLE + CLEAR - lowest)
        self.target = -AWAY * self.item.approach[:, 2]
        self.target[2] += self.above
        self._set_posture(self.commands(0.0))
        self.data.qpos[self._places] = self.target
        self.close(0.0)
        mujoco.mj_forward(self.model, self.data)

    def _lowest(self, share):
        """Return the height of the lowest point of the gripper at the object, m."""
        model, data = self.model, self.data
        names = [model.geom(g).name for g in range(model.ngeom)]
        own = [g for g, n in enumerate(names) if n.startswith(PREFIX)]
        own = [g for g in own if model.geom_contype[g]]
        self._set_posture(self.commands(share))
        mujoco.mj_kinematics(model, data)
        rows = data.geom_xmat[own].reshape(-1, 3, 3)[:, 2]
        middle = data.geom_xpos[own, 2]
        middle = middle + np.sum(rows * model.geom_aabb[own, :3], axis=1)
        half = np.sum(np.abs(rows) * model.geom_aabb[own, 3:], axis=1)
        return float((middle - half).min())

    def commands(self, share):
        """Return the synergies' commands, share 0 before and 1 after closing."""
        ends = np.array(
            [s.grasps.get(self.item.grasp, (-1.0, 1.0)) for s in self.synergies]
        )
        return (1.0 - share) * ends[:, 0] + share * ends[:, 1]

    def _set_posture(self, commands):
        values = {}
        for synergy, command in zip(self.synergies, commands, strict=True):
            for joint, low in synergy.open.items():
                values[joint] = low + (command + 1) / 2 * (synergy.closed[joint] - low)
        for joint in self.robot.joints:
            if joint.mimic is not None and joint.mimic.joint in values:
                leader = values[joint.mimic.joint]
                values[joint.name] = joint.mimic.ratio * leader + joint.mimic.offset
        for joint, value in values.items():
            self.data.joint(PREFIX + joint).qpos = value

    def close(self, share=1.0):
        """Command the gripper, from 0, open, to 1, closed."""
        self.hand.set_goal(self.commands(share), 0.05)

    def step(self, position, velocity, acceleration):
        """Advance one step with the carriage on its way."""
        model, data = self.model, self.data
        mujoco.mj_step1(model, data)
        wanted = acceleration + STIFFNESS * (position - data.qpos[self._places])
        wanted += 2.0 * np.sqrt(STIFFNESS) * (velocity - data.qvel[self._dofs])
        data.qfrc_applied[self._dofs] = CARRIAGE * wanted
        law = self.hand.law
        data.ctrl[law.drives["ctrl"]] = law.target()[0]
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

    def grip(self):
        """Go to the object, close, lift; remember how it lies in the hand."""
        self.wait(0.1)
        self.move(AWAY * self.item.approach[:, 2], 0.5)
        self.close()
        self.wait(GRIPPED)
        self.gripped = self._held()
        self.slip = self.turn = 0.0
        self.move((0, 0, LIFT), 0.6)
        self._note()

    def shake(self, axis, seconds=2.0, amplitude=SHAKE):
        """Accelerate by `amplitude cos(w t)` along an axis, over whole periods."""
        axis = np.asarray(axis, dtype=np.float64)
        w, dt = 2 * np.pi * FREQUENCY, self.model.opt.timestep
        for k in range(round(seconds / dt)):
            t = (k + 1) * dt
            way = amplitude / w**2 * (1 - np.cos(w * t))
            rates = amplitude / w * np.sin(w * t), amplitude * np.cos(w * t)
            self.step(self.target + way * axis, rates[0] * axis, rates[1] * axis)
            self._note()

    def _held(self):
        """Return the object's pose in the tool's frame."""
        site, body = self.data.site(PREFIX + self.tool), self.data.body("object")
        tool = pin.SE3(site.xmat.reshape(3, 3), site.xpos)
        return tool.inverse() * pin.SE3(body.xmat.reshape(3, 3), body.xpos)

    def _note(self):
        moved = self.gripped.actInv(self._held())
        self.slip = max(self.slip, float(np.linalg.norm(moved.translation)))
        self.turn = max(self.turn, float(np.linalg.norm(pin.log3(moved.rotation))))

    def result(self):
        """Return how the object was held, and how it is held now."""
        model, data = self.model, self.data
        held, links, depth, total = model.geom("object").id, set(), 0.0, 0.0
        force = np.zeros(6)
        for k, contact in enumerate(data.contact):
            if held not in contact.geom:
                continue
            (other,) = (g for g in contact.geom if g != held)
            body = model.body(model.geom_bodyid[other]).name
            mujoco.mj_contactForce(model, data, k, force)
            links.add(body.removeprefix(PREFIX))
            depth, total = max(depth, -float(contact.dist)), total + float(force[0])
        return Hold(
            slip=self.slip,
            turn=self.turn,
            links=frozenset(links),
            depth=depth,
            rise=float(data.body("object").xpos[2] - TABLE - self.item.half),
            force=total,
        )


def _add_can(spec):
    body = spec.worldbody.add_body(name="object")
    body.add_joint(name="thing_joint", type=mujoco.mjtJoint.mjJNT_FREE)
    body.add_geom(
        name="object",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=(CAN_RADIUS, CAN.half, 0.0),
        rgba=(0.85, 0.25, 0.15, 1),
        mass=CAN.mass,
        condim=4,
    )


def main(name, picture=None, *options):
    """Try one gripper: print how it holds and draw it; then shake it loose."""
    rig = GraspRig(name, CAN if "--can" in options else CUBE)
    rig.grip()
    print(f"lifted, {1e3 * rig.above:.1f} mm above the centre: {rig.result()}")
    if picture:
        from PIL import Image

        from wbc_suite.viewers.offscreen import Camera

        with Camera(rig.model, rig.data, subject=PREFIX) as camera:
            Image.fromarray(camera.take(rig.data)).save(picture)
    amplitude = SHAKE
    while amplitude < 100.0 and rig.result().rise > LIFT / 2:
        for axis in np.eye(3):
            rig.shake(axis, amplitude=amplitude)
        print(f"shaken at {amplitude:g} m/s^2: {rig.result()}")
        amplitude *= 2.0


if __name__ == "__main__":
    main(*sys.argv[1:])
