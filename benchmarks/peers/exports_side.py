"""What one reader makes of exported robots; it runs in the reader's own environment.

Usage: PYTHON exports_side.py READER FOLDER

The folder has one `NAME.npz` for each robot, made by `benchmarks/exports.py`: names of
joints and frames, joint positions, poses, the mass and pairs that can collide. One JSON
object is printed: by robot the largest deviation of poses and of the mass, and how many
pairs differ where the file has them; or an error.
"""

import itertools
import json
import logging
import sys
from pathlib import Path

import numpy as np

Poses = dict[str, np.ndarray]


class PyBullet:
    """Followers are set too: PyBullet reads no mimic."""

    def __init__(self, path: Path) -> None:
        import pybullet

        self._p = pybullet
        pybullet.connect(pybullet.DIRECT)
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE
        self._robot = pybullet.loadURDF(str(path), flags=flags)
        indices = range(pybullet.getNumJoints(self._robot))
        found = [pybullet.getJointInfo(self._robot, i) for i in indices]
        self._joints = {row[1].decode(): row[0] for row in found}
        self._links = {row[12].decode(): row[0] for row in found}
        self._base = pybullet.getBodyInfo(self._robot)[0].decode()
        masses = [pybullet.getDynamicsInfo(self._robot, i)[0] for i in (-1, *indices)]
        self.mass = sum(masses)

    def poses(self, values: dict[str, float]) -> Poses:
        p, robot = self._p, self._robot
        for name, value in values.items():
            if name in self._joints:
                p.resetJointState(robot, self._joints[name], value)
        com, quat = p.getBasePositionAndOrientation(robot)
        lever, turn = p.getDynamicsInfo(robot, -1)[3:5]
        base = p.multiplyTransforms(com, quat, *p.invertTransform(lever, turn))
        found = {self._base: self._matrix(*base)}
        for name, index in self._links.items():
            state = p.getLinkState(robot, index, computeForwardKinematics=True)
            found[name] = self._matrix(*state[4:6])
        return found

    def _matrix(self, pos: tuple, quat: tuple) -> np.ndarray:
        T = np.eye(4)
        T[:3, :3] = np.reshape(self._p.getMatrixFromQuaternion(quat), (3, 3))
        T[:3, 3] = pos
        return T


class Yourdfpy:
    """Sets the joints that it calls actuated; it places followers itself."""

    def __init__(self, path: Path) -> None:
        import yourdfpy

        self._robot = yourdfpy.URDF.load(str(path), load_meshes=False)
        links = self._robot.robot.links
        self.mass = sum(x.inertial.mass for x in links if x.inertial is not None)
        self._links = [link.name for link in links]

    def poses(self, values: dict[str, float]) -> Poses:
        actuated = self._robot.actuated_joint_names
        self._robot.update_cfg({n: v for n, v in values.items() if n in actuated})
        return {name: self._robot.get_transform(name) for name in self._links}


class Placo:
    def __init__(self, path: Path) -> None:
        import placo

        flags = placo.Flags.ignore_collisions
        self._robot = placo.RobotWrapper(str(path), flags)
        self.mass = self._robot.total_mass()
        self._joints = set(self._robot.joint_names())

    def poses(self, values: dict[str, float]) -> Poses:
        for name, value in values.items():
            if name in self._joints:
                self._robot.set_joint(name, value)
        self._robot.update_kinematics()
        names = self._robot.frame_names()
        return {name: self._robot.get_T_world_frame(name) for name in names}


class Drake:
    """Followers are set too: Drake couples them by constraints of its solver."""

    def __init__(self, path: Path) -> None:
        from pydrake.multibody.parsing import Parser
        from pydrake.multibody.plant import (
            AddMultibodyPlantSceneGraph,
            DiscreteContactApproximation,
        )
        from pydrake.systems.framework import DiagramBuilder

        self._plant, scene = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
        self._plant.set_discrete_contact_approximation(
            DiscreteContactApproximation.kSap
        )
        (own,) = Parser(self._plant).AddModels(str(path))
        self._plant.Finalize()
        self._context = self._plant.CreateDefaultContext()
        self.mass = self._plant.CalcTotalMass(self._context)
        indices = self._plant.GetJointIndices()
        joints = [self._plant.get_joint(i) for i in indices]
        self._joints = {j.name(): j for j in joints if j.num_positions() == 1}
        shapes = scene.model_inspector()
        first: dict[str, object] = {}
        for index in self._plant.GetBodyIndices(own):
            body = self._plant.get_body(index)
            for shape in self._plant.GetCollisionGeometriesForBody(body):
                first.setdefault(body.name(), shape)
        self.pairs = {
            frozenset(pair)
            for pair in itertools.combinations(first, 2)
            if not shapes.CollisionFiltered(*(first[name] for name in pair))
        }

    def poses(self, values: dict[str, float]) -> Poses:
        q = self._plant.GetPositions(self._context)
        for name, value in values.items():
            if name in self._joints:
                q[self._joints[name].position_start()] = value
        self._plant.SetPositions(self._context, q)
        found: Poses = {}
        for index in range(self._plant.num_frames()):
            frame = self._frame(index)
            pose = frame.CalcPoseInWorld(self._context)
            found.setdefault(frame.name(), pose.GetAsMatrix4())
        return found

    def _frame(self, index: int):
        from pydrake.multibody.tree import FrameIndex

        return self._plant.get_frame(FrameIndex(index))


class Usd:
    """The USD that `mujoco-usd-converter` makes of an MJCF; its joints stand at 0."""

    def __init__(self, path: Path) -> None:
        import mujoco_usd_converter
        from pxr import Usd as usd
        from pxr import UsdGeom, UsdPhysics

        folder = str(path.parent / "usd")
        asset = mujoco_usd_converter.Converter().convert(str(path), folder)
        stage, cache = usd.Stage.Open(asset.path), UsdGeom.XformCache()
        self._poses: Poses = {}
        self.mass = 0.0
        for prim in stage.Traverse():
            T = np.array(cache.GetLocalToWorldTransform(prim)).T
            self._poses.setdefault(prim.GetName(), T)
            if prim.HasAPI(UsdPhysics.MassAPI):
                self.mass += UsdPhysics.MassAPI(prim).GetMassAttr().Get() or 0.0

    def poses(self, values: dict[str, float]) -> Poses:
        assert not any(values.values())
        return self._poses


READERS = {
    "usd": Usd,
    "pybullet": PyBullet,
    "yourdfpy": Yourdfpy,
    "placo": Placo,
    "drake": Drake,
}


def measure(case: Path, reader: str) -> dict[str, object]:
    """Return the largest deviations of one robot in one reader."""
    data = np.load(case)
    model = READERS[reader](case.with_suffix("") / str(data[f"file_{reader}"]))
    rooted = bool(data[f"rooted_{reader}"])
    worst, first = 0.0, str(data["frames"][0])
    rows = "values", "poses"
    if reader == "usd":
        rows = "zeros", "poses_at_zero"
    for values, expected in zip(data[rows[0]], data[rows[1]], strict=True):
        found = model.poses(dict(zip(data["joints"].tolist(), values, strict=True)))
        base = np.eye(4) if rooted else np.linalg.inv(found[first])
        own = np.eye(4) if rooted else np.linalg.inv(expected[0])
        for name, T in zip(data["frames"].tolist(), expected, strict=True):
            if name not in found:
                return {"error": f"no frame '{name}'"}
            worst = max(worst, float(np.abs(base @ found[name] - own @ T).max()))
    found = {"pose": worst, "mass": abs(model.mass - float(data["mass"]))}
    if hasattr(model, "pairs"):
        ours = set(map(frozenset, data["pairs"].tolist()))
        found["pairs"] = len(model.pairs ^ ours)
    return found


def main() -> None:
    logging.disable()
    reader, folder = sys.argv[1], Path(sys.argv[2])
    found = {}
    for case in sorted(folder.glob("*.npz")):
        try:
            found[case.stem] = measure(case, reader)
        except Exception as error:  # noqa: BLE001 - the table shows what a reader says
            found[case.stem] = {"error": str(error)[:300]}
    print("\n" + json.dumps(found))


if __name__ == "__main__":
    main()
