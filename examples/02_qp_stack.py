"""Move a humanoid's hand with a stack of QP tasks; the other hand stays in place.

With `--view` the motion is shown in a browser.
"""

import sys
import time

import mujoco
import numpy as np

import wbc_suite
from wbc_suite.kinematics import Configuration, Conversion
from wbc_suite.qp import FrameTask, PostureTask, TaskStack
from wbc_suite.viewers.watch_page import WatchPage

DT = 0.01  # s

robot = wbc_suite.load_robot("GR1")
model = robot.to_pinocchio()
configuration = Configuration(model, model.referenceConfigurations["ready"])

right, left = FrameTask("right_eef"), FrameTask("left_eef")
stack = TaskStack(
    configuration,
    tasks=[right, left, PostureTask(1e-2)],
)

target = configuration.frame_pose("right_eef")
target.translation += np.array([0.05, -0.05, 0.20])
right.set_target(target)

drawn = robot.to_mjspec().compile()
data, conversion = mujoco.MjData(drawn), Conversion(drawn, model)
page = WatchPage(drawn) if "--view" in sys.argv else None
if page is not None:
    input("Open this address in a browser, then press Enter. ")

solution = stack.solve(DT)
for _ in range(300):
    configuration.update(configuration.integrate(solution.dq))
    solution = stack.solve(DT)
    if page is not None:
        data.qpos[:] = conversion.q_to_mujoco(configuration.q)
        mujoco.mj_kinematics(drawn, data)
        page.show(data.xpos, data.xquat)
        time.sleep(DT)

for task in (right, left):
    error = np.linalg.norm(task.error(configuration)[:3])
    print(f"{task.frame}: {1e3 * error:.3f} mm from its target")
if page is not None:
    page.stop()
print("active limits:", ", ".join(map(str, solution.active)) or "none")
