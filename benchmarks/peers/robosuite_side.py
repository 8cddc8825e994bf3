"""robosuite's side of the benchmarks; runs in .venv-robosuite.

Of wbc_suite it imports the clock alone, which needs MuJoCo and NumPy only.

Reads one request a line from standard input, as JSON, and answers one line on standard
output. See `Side` for the requests.
"""

import copy
import json
import os
import sys
from pathlib import Path

BENCHMARKS = Path(__file__).parent.parent
sys.path[:0] = [str(BENCHMARKS), str(BENCHMARKS.parent)]
answers = os.fdopen(os.dup(1), "w")  # robosuite prints: keep its words off this line
os.dup2(2, 1)

import harness  # noqa: E402, F401  (one BLAS thread)
import mujoco  # noqa: E402
import numpy as np  # noqa: E402
import robosuite  # noqa: E402
from harness.motion import RATE  # noqa: E402
from robosuite.controllers import (  # noqa: E402
    load_composite_controller_config,
    load_part_controller_config,
)
from scipy.spatial.transform import Rotation  # noqa: E402

from wbc_suite.timing import time_block, time_frames, times  # noqa: E402


def composite(robot, controller, options):
    """Return a composite config with one kind of part controller on every arm."""
    if controller == "WHOLE_BODY_IK":
        return load_composite_controller_config(controller=controller, robot=robot)
    config = load_composite_controller_config(controller=None, robot=robot)
    for arm in ("right", "left"):
        if arm not in config["body_parts"]:
            continue
        part = copy.deepcopy(load_part_controller_config(default_controller=controller))
        if controller == "IK_POSE":
            part["input_type"] = "absolute"  # its default drifts away at zero action
        part["gripper"] = {"type": "GRIP"}
        config["body_parts"][arm] = part | options
    return config


class Side:
    """One environment at a time, and what is asked of it."""

    def versions(self):
        return {
            "robosuite": robosuite.__version__,
            "robosuite's mujoco": mujoco.__version__,
        }

    def make(
        self,
        robot,
        controller,
        task="Lift",
        rate=20,
        options=None,
        pictures=False,
        **more,
    ):
        """Make an environment; return its number of physics steps per action."""
        self.env = robosuite.make(
            task,
            robots=robot,
            controller_configs=composite(robot, controller, options or {}),
            has_renderer=False,
            has_offscreen_renderer=pictures,
            use_camera_obs=False,
            control_freq=rate,
            ignore_done=True,
            hard_reset=False,
            **more,
        )
        self.env.reset()
        self.rng = np.random.default_rng(0)
        self.whole_body = controller == "WHOLE_BODY_IK"
        return self.substeps

    @property
    def substeps(self):
        return round(1.0 / (self.env.control_freq * self.env.model_timestep))

    @property
    def model(self):
        return self.env.sim.model._model

    @property
    def data(self):
        return self.env.sim.data._data

    def hold(self):
        """Return the action that holds: present poses and positions, or no change."""
        robot, action = self.env.robots[0], np.zeros(self.env.action_dim)
        if self.whole_body:
            for k, arm in enumerate(robot.arms):
                action[6 * k : 6 * k + 6] = pose_of(
                    self.data.site(grip_site(robot, arm))
                )
            return action
        composite = robot.composite_controller
        for part, (first, last) in composite._action_split_indexes.items():
            controller = composite.part_controllers[part]
            if getattr(controller, "input_type", "delta") != "absolute":
                continue
            if part in robot.arms and controller.name.startswith("OSC"):
                action[first:last] = pose_of(self.data.site(grip_site(robot, part)))
            elif not controller.name.startswith("IK"):
                action[first:last] = self.data.qpos[controller.qpos_index]
        return action

    def begin(self, count, size):
        """Reset, and draw random actions around the one that holds."""
        self.env.reset()
        offsets = self.rng.uniform(-size, size, (count, self.env.action_dim))
        self.actions = list(self.hold() + offsets)

    def turn(self, count):
        """Time the next steps."""
        actions, self.actions = self.actions[:count], self.actions[count:]
        block = time_block(
            self.env.step,
            actions,
            model=self.model,
            data=self.data,
            substeps=self.substeps,
        )
        return {"step": block.step, "raw": block.raw}

    def reset(self, hard, count):
        """Return times of resets, us."""
        self.env.hard_reset = hard
        found = times(count, self.env.reset)
        self.env.hard_reset = False
        return found

    def frames(self, kind, size, count):
        """Time pictures of the camera agentview: image, depth or segmentation."""

        def draw():
            view = {"camera_name": "agentview", "width": size, "height": size}
            if kind == "depth":
                _, depth = self.env.sim.render(depth=True, **view)
                extent, planes = self.model.stat.extent, self.model.vis.map
                near, far = planes.znear * extent, planes.zfar * extent
                return near / (1.0 - depth * (1.0 - near / far))  # in metres, as ours
            return self.env.sim.render(segmentation=kind == "segmentation", **view)

        frames = time_frames(count, draw)
        return {"cpu": frames.cpu, "wall": frames.wall}

    def follow(self, goals, force):
        """Let the right hand follow a motion; see `harness/motion.py`.

        The environment takes 500 actions a second, each goal as often as it lasts, so
        that the hand is seen after every physics step; the law is the same.

        Args:
            goals: One per action at RATE.
            force: Weight hung on the grip point, N.
        """
        self.env.reset()
        robot = self.env.robots[0]
        site = self.data.site(grip_site(robot, "right"))
        body = self.model.site(site.name).bodyid[0]
        first, _ = robot.composite_controller._action_split_indexes["right"]
        action, start = self.hold(), rotation_and_position(site)
        found = []
        for goal in goals:
            action[first : first + 6] = moved(start, np.array(goal))
            for _ in range(round(self.env.control_freq / RATE)):
                pull = np.array([0.0, 0.0, -force])
                lever = site.xpos - self.data.xipos[body]
                self.data.xfrc_applied[body] = [*pull, *np.cross(lever, pull)]
                self.env.step(action)
                found.append(offset(start, rotation_and_position(site)))
        self.data.xfrc_applied[body] = 0.0
        return found


def grip_site(robot, arm):
    return robot.gripper[arm].important_sites["grip_site"]


def rotation_and_position(site):
    return site.xmat.reshape(3, 3).copy(), site.xpos.copy()


def moved(start, goal):
    """Return a pose, position and rotation vector, at an offset in world axes."""
    turn = Rotation.from_rotvec(goal[3:]) * Rotation.from_matrix(start[0])
    return [*(start[1] + goal[:3]), *turn.as_rotvec()]


def offset(start, now):
    """Return position and rotation vector relative to the start, world axes."""
    turn = Rotation.from_matrix(now[0] @ start[0].T).as_rotvec()
    return [*(now[1] - start[1]), *turn]


def pose_of(site):
    """Return position and rotation vector of a site."""
    return moved(rotation_and_position(site), np.zeros(6))


def main():
    side = Side()
    for line in sys.stdin:
        request = json.loads(line)
        try:
            result = getattr(side, request.pop("request"))(**request)
            answer = {"result": result}
        except Exception as error:  # noqa: BLE001  (told to the other side)
            answer = {"error": f"{type(error).__name__}: {error}"}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
