"""placo's side of `whole_body_dynamics.py`; runs in .venv-placo, without wbc_suite.

Reads robot.urdf and job.json from a folder, and has the same tasks as `tsid_side.py`.
placo centres the rectangle of a sole at its frame. Prints the microseconds of each
tick, in which it computes kinematics and dynamics and solves the QP, as JSON.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
import placo  # pyright: ignore[reportMissingImports]

ROUND = 0.5 * np.pi  # rad/s
RADIUS = 0.05  # m


def main(folder: Path) -> None:
    job = json.loads((folder / "job.json").read_text())
    robot = placo.RobotWrapper(
        str(folder / "robot.urdf"), placo.Flags.ignore_collisions
    )
    for name, value in job["joints"].items():
        robot.set_joint(name, value)
    robot.update_kinematics()
    solver = placo.DynamicsSolver(robot)
    solver.dt = job["dt"]
    solver.enable_torque_limits(True)
    for foot in job["feet"]:
        frame, (heel, toes, right, left) = foot["frame"], foot["sole"]
        task = solver.add_frame_task(frame, robot.get_T_world_frame(frame))
        task.configure(frame, "soft", 100.0, 100.0)
        contact = solver.add_planar_contact(task)
        contact.length, contact.width = 2.0 * min(-heel, toes), left - right
        contact.mu = job["friction"]
    hands = []
    for frame in job["hands"]:
        start = robot.get_T_world_frame(frame)
        task = solver.add_frame_task(frame, start)
        task.configure(frame, "soft", 2.0, 2.0)
        hands.append((task, start))
    trunk = robot.get_T_world_frame(job["trunk"])[:3, :3]
    solver.add_orientation_task(job["trunk"], trunk).configure("trunk", "soft", 4.0)
    solver.add_com_task(robot.com_world()).configure("com", "soft", 10.0)
    posture = solver.add_joints_task()
    posture.set_joints(job["joints"])
    posture.configure("posture", "soft", 0.02)
    times = []
    for k in range(job["ticks"]):
        angle = ROUND * k * job["dt"]
        way = RADIUS * np.array([0.0, np.sin(angle), 1.0 - np.cos(angle)])
        for task, start in hands:
            goal = start.copy()
            goal[:3, 3] += way
            task.position().target_world = goal[:3, 3]
        begin = time.thread_time_ns()
        robot.update_kinematics()
        found = solver.solve(True)
        times.append((time.thread_time_ns() - begin) / 1e3)
        if not found.success:
            raise RuntimeError(f"placo finds no solution in tick {k}")
    print(json.dumps({"us": times}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
