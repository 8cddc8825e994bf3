"""TSID's side of `whole_body_dynamics.py`; runs in .venv-tsid, without wbc_suite.

Reads robot.urdf and job.json from a folder. A biped stands with the tasks of
WHOLE_BODY_ID: soles at rest in friction pyramids, centre of mass, trunk, hands on
circles of 5 cm, posture, torque limits. Prints the microseconds of each tick, in which
TSID computes the dynamics, states the QP and solves it, as JSON.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
import pinocchio as pin
import tsid  # pyright: ignore[reportMissingImports]

WEIGHTS = {"com": 10.0, "trunk": 4.0, "hand": 2.0, "posture": 0.02, "force": 1e-5}
ROUND = 0.5 * np.pi  # rad/s
RADIUS = 0.05  # m
TASKS = 1  # level; that of contacts and limits is 0


class Standing:
    """A formulation of TSID, and its state."""

    def __init__(self, folder: Path, job: dict) -> None:
        file = str(folder / "robot.urdf")
        model = pin.buildModelFromUrdf(file, pin.JointModelFreeFlyer())
        floating = tsid.RootJointType.FLOATING_BASE_SYSTEM
        self.robot = tsid.RobotWrapper(model, floating, False)
        self.model = model
        self.q, self.v = pin.neutral(model), np.zeros(model.nv)
        for name, value in job["joints"].items():
            self.q[model.joints[model.getJointId(name)].idx_q] = value
        self.dt, self.time = job["dt"], 0.0
        self.problem = tsid.InverseDynamicsFormulationAccForce(
            "tsid", self.robot, False
        )
        self.problem.computeProblemData(0.0, self.q, self.v)
        self.kept = []  # the bindings keep no reference
        for foot in job["feet"]:
            self.add_foot(foot, job["friction"], job["weight"])
        self.hands = [
            self.add_frame(n, WEIGHTS["hand"], np.ones(6)) for n in job["hands"]
        ]
        turning = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
        self.add_frame(job["trunk"], WEIGHTS["trunk"], turning)
        self.add_com()
        self.add_posture(job["torques"])
        self.solver = tsid.SolverHQuadProgFast("solver")
        self.solver.resize(self.problem.nVar, self.problem.nEq, self.problem.nIn)

    def add_foot(self, foot: dict, friction: float, weight: float) -> None:
        heel, toes, right, left = foot["sole"]
        x, y, z = np.array([heel, toes]), np.array([right, left]), -foot["height"]
        corners = np.array([[a, b, z] for a in x for b in y]).T
        contact = tsid.Contact6d(
            *(foot["frame"], self.robot, foot["frame"], corners),
            *(np.array([0.0, 0.0, 1.0]), friction, 0.1, weight),
        )
        contact.setKp(100.0 * np.ones(6))
        contact.setKd(20.0 * np.ones(6))
        contact.setReference(self.pose(foot["frame"]))
        self.problem.addRigidContact(contact, WEIGHTS["force"])
        self.kept.append(contact)

    def pose(self, frame: str) -> pin.SE3:
        return self.robot.framePosition(
            self.problem.data(), self.model.getFrameId(frame)
        )

    def add_frame(self, frame: str, weight: float, mask: np.ndarray) -> tuple:
        task = tsid.TaskSE3Equality(frame, self.robot, frame)
        task.setMask(mask)
        task.setKp(600.0 * np.ones(6))
        task.setKd(2.0 * np.sqrt(600.0) * np.ones(6))
        start = self.pose(frame)
        path = tsid.TrajectorySE3Constant(frame, start)
        task.setReference(path.computeNext())
        self.problem.addMotionTask(task, weight, TASKS, 0.0)
        self.kept.append((task, path))
        return task, path, start

    def add_com(self) -> None:
        task = tsid.TaskComEquality("com", self.robot)
        task.setKp(40.0 * np.ones(3))
        task.setKd(2.0 * np.sqrt(40.0) * np.ones(3))
        start = self.robot.com(self.problem.data())
        path = tsid.TrajectoryEuclidianConstant("com", start)
        task.setReference(path.computeNext())
        self.problem.addMotionTask(task, WEIGHTS["com"], TASKS, 0.0)
        self.kept.append((task, path))

    def add_posture(self, torques: dict) -> None:
        joints = self.model.nv - 6
        task = tsid.TaskJointPosture("posture", self.robot)
        task.setKp(50.0 * np.ones(joints))
        task.setKd(2.0 * np.sqrt(50.0) * np.ones(joints))
        path = tsid.TrajectoryEuclidianConstant("posture", self.q[7:])
        task.setReference(path.computeNext())
        self.problem.addMotionTask(task, WEIGHTS["posture"], TASKS, 0.0)
        bounds = tsid.TaskActuationBounds("torques", self.robot)
        most = np.zeros(joints)
        for name, torque in torques.items():
            most[self.model.joints[self.model.getJointId(name)].idx_v - 6] = torque
        bounds.setBounds(-most, most)
        self.problem.addActuationTask(bounds, 1.0, 0, 0.0)
        self.kept.append((task, path, bounds))

    def tick(self) -> int:
        """Solve a tick, move on by it, and return its time, ns."""
        for task, path, start in self.hands:
            goal, angle = start.copy(), ROUND * self.time
            goal.translation += RADIUS * np.array(
                [0.0, np.sin(angle), 1 - np.cos(angle)]
            )
            path.setReference(goal)
            task.setReference(path.computeNext())
        begin = time.thread_time_ns()
        data = self.problem.computeProblemData(self.time, self.q, self.v)
        found = self.solver.solve(data)
        end = time.thread_time_ns()
        if found.status != 0:
            raise RuntimeError(f"TSID finds no solution at {self.time:.3f} s")
        a = self.problem.getAccelerations(found)
        self.q = pin.integrate(self.model, self.q, self.dt * (self.v + self.dt * a / 2))
        self.v = self.v + self.dt * a
        self.time += self.dt
        return end - begin


def main(folder: Path) -> None:
    job = json.loads((folder / "job.json").read_text())
    standing = Standing(folder, job)
    times = [standing.tick() / 1e3 for _ in range(job["ticks"])]
    print(json.dumps({"us": times}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
