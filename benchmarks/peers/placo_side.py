"""placo's side of `whole_body_ik.py`; runs in .venv-placo, which has no wbc_suite.

Reads robot.urdf, job.json and in.npz from a folder. Each line of its input is a number
of ticks to run, which it answers with a line; at the end it writes out.npz.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
import placo  # pyright: ignore[reportMissingImports]

clock = time.thread_time_ns


def base_of(robot) -> list[float]:
    """Return position and quaternion x y z w of the floating base."""
    T = np.array(robot.get_T_world_fbase())
    w = 0.5 * np.sqrt(max(1e-12, 1.0 + np.trace(T[:3, :3])))  # it hardly turns here
    x = (T[2, 1] - T[1, 2]) / (4 * w)
    y = (T[0, 2] - T[2, 0]) / (4 * w)
    z = (T[1, 0] - T[0, 1]) / (4 * w)
    return [*T[:3, 3], x, y, z, w]


def in_turns(targets):
    """Yield targets, as many as each line asks for, and answer the line."""
    k = 0
    print("ready", flush=True)
    for line in sys.stdin:
        last = k + int(line)
        while k < last:
            yield targets[k]
            k += 1
        print("done", flush=True)


def main(folder: Path) -> None:
    job = json.loads((folder / "job.json").read_text())
    data = np.load(folder / "in.npz")
    targets, q = data["targets"], data["q"]
    robot = placo.RobotWrapper(
        str(folder / "robot.urdf"), placo.Flags.ignore_collisions
    )
    first = 7 if job["free"] else 0
    if job["free"]:
        base = np.eye(4)
        base[:3, 3] = q[:3]
        robot.set_T_world_fbase(base)
    for name, value in zip(job["joints"], q[first:], strict=True):
        robot.set_joint(name, float(value))
    robot.update_kinematics()
    solver = placo.KinematicsSolver(robot)
    solver.dt = job["dt"]
    solver.mask_fbase(not job["free"])
    solver.enable_joint_limits(True)
    solver.enable_velocity_limits(True)
    frames = []
    for name, target in zip(job["frames"], targets[0], strict=True):
        frames.append(solver.add_frame_task(name, target))
        frames[-1].configure(name, "soft", 1.0, 1.0)
    if job["com"]:
        com = solver.add_com_task(robot.com_world())
        com.configure("com", "soft", 1.0)
    posture = solver.add_joints_task()
    start = dict(zip(job["joints"], map(float, q[first:]), strict=True))
    posture.set_joints(start)
    posture.configure("posture", "soft", job["posture_cost"] ** 2)
    solver.add_regularization_task(job["damping"])
    out = {"kinematics": [], "solve": [], "total": [], "q": [], "failed": 0}
    for poses in in_turns(targets):
        t0 = clock()
        robot.update_kinematics()
        t1 = clock()
        for task, target in zip(frames, poses, strict=True):
            task.T_world_frame = target
        try:
            solver.solve(True)
        except RuntimeError:
            out["failed"] += 1
        t2 = clock()
        out["kinematics"].append((t1 - t0) / 1e3)
        out["solve"].append((t2 - t1) / 1e3)
        out["total"].append((t2 - t0) / 1e3)
        joints = [robot.get_joint(name) for name in job["joints"]]
        out["q"].append([*base_of(robot), *joints] if job["free"] else joints)
    names = ("kinematics", "solve", "total", "q", "failed")
    kinematics, solve, total, states, failed = (np.array(out[n]) for n in names)
    np.savez(
        folder / "out.npz",
        kinematics=kinematics,
        solve=solve,
        total=total,
        q=states,
        failed=failed,
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
