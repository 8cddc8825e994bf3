"""Every single-arm benchmark with every robot that can do something in it."""

import mujoco
import pytest
from conftest import penetration
from posing import act_at_random

import wbc_suite
from wbc_suite.catalogue import Catalogue
from wbc_suite.robot import load_robot

BENCHMARKS = ("Stack", "PickPlace", "NutAssembly", "Door", "Wipe", "ToolHang")
ROBOTS = [load_robot(path).name for path in Catalogue().files("robots")]
REACHING = [name for name in ROBOTS if name != "Spot"]  # it has no arm


def robot_and_furniture(model):
    """Return the robot's solid geoms, its pedestal's too, and the furniture's."""
    solid = (model.geom_contype | model.geom_conaffinity) > 0
    own, room = [], []
    for g in range(model.ngeom):
        body = int(model.geom_bodyid[g])
        fixed = model.body_weldid[body] == 0
        if not solid[g] or model.geom(g).name == "floor":
            continue
        if model.body(body).name.startswith("robot0_"):
            own.append(g)
        elif fixed:
            room.append(g)
    return own, room


@pytest.mark.sample(24)
@pytest.mark.slow
@pytest.mark.parametrize("name", BENCHMARKS)
@pytest.mark.parametrize("robot", REACHING)
def test_robots_start_clear_of_everything_and_act(name, robot):
    env = wbc_suite.make(name, robots=robot, reward_shaping=True)
    model, data = env.simulation.model, env.simulation.data
    own, room = robot_and_furniture(model)
    for seed in range(5):
        env.reset(seed=seed)
        gaps = [
            mujoco.mj_geomDistance(model, data, i, k, 0.05, None)
            for i in own
            for k in room
        ]
        assert min(gaps) > 0.0, seed
        assert penetration(env) < 5e-4
    act_at_random(env, 50, seed=0)
    env.close()
