"""Random trees of links: both engines, the URDF text and the IK agree on them."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wbc_suite.config_files import parse_model
from wbc_suite.kinematics import Configuration, Conversion
from wbc_suite.qp import FrameTask, PostureTask, TaskStack
from wbc_suite.robot.assembly import describe_component
from wbc_suite.robot.robot_file import Component

TOLERANCE = 1e-9  # two independent loaders of one robot agree to 1e-13


def unit(rng, size):
    vector = rng.normal(size=size)
    return (vector / np.linalg.norm(vector)).tolist()


def random_inertia(rng, mass, size):
    """Return the inertia of a solid ellipsoid in random axes: always physical."""
    a, b, c = size**2 * rng.uniform(0.2, 1.0, 3)
    moments = np.diag([b + c, a + c, a + b]) * mass / 5.0
    R = pin.exp3(rng.normal(size=3))
    tensor = R @ moments @ R.T
    return tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist()


def random_shape(rng, size):
    kinds = {
        "box": {"size": (size * rng.uniform(0.5, 1.0, 3)).tolist()},
        "sphere": {"radius": size},
        "capsule": {"from": [0, 0, -size], "to": [0, 0, size], "radius": size / 2},
        "cylinder": {"from": [0, 0, -size], "to": [0, 0, size], "radius": size},
        "ellipsoid": {"size": (size * rng.uniform(0.5, 1.0, 3)).tolist()},
        "hull": {"spheres": [[0, 0, -size, size / 2], [0, 0, size, size / 2]]},
    }
    kind = rng.choice(list(kinds))
    return {"shape": str(kind), **kinds[str(kind)]}


def random_joint(rng, k, leaders):
    lower = float(rng.uniform(-3.0, 0.0))
    joint = {
        "name": f"joint{k}",
        "type": str(rng.choice(["hinge", "hinge", "slide"])),
        "axis": unit(rng, 3),
        "range": [lower, lower + float(rng.uniform(0.5, 4.0))],
        "velocity": float(rng.uniform(0.5, 5.0)),
        "effort": 100.0,
        "armature": float(rng.choice([0.0, 0.1])),
    }
    if joint["type"] == "hinge" and rng.random() < 0.2:
        del joint["range"]  # turns without end
    if leaders and rng.random() < 0.2:
        ratio = float(rng.uniform(-2.0, 2.0))
        joint["mimic"] = {"joint": str(rng.choice(leaders)), "ratio": ratio}
    return joint


def random_robot(seed):
    """Describe a tree of 1 to 12 links on a fixed, planar or free root."""
    rng = np.random.default_rng(seed)
    links, leaders = [], []
    for k in range(rng.integers(1, 13)):
        size, mass = rng.uniform(0.03, 0.3), rng.uniform(0.1, 20.0)
        link = {
            "name": f"link{k}",
            "mass": mass,
            "com": (0.3 * size * rng.uniform(-1.0, 1.0, 3)).tolist(),
            "inertia": random_inertia(rng, mass, size),
            "visual": [random_shape(rng, size)],
            "collision": [random_shape(rng, size)] if rng.random() < 0.5 else [],
        }
        if k:
            link["parent"] = f"link{rng.integers(k)}"
            link["pos"], link["quat"] = rng.normal(size=3).tolist(), unit(rng, 4)
            if rng.random() < 0.85:
                link["joint"] = random_joint(rng, k, leaders)
                if "mimic" not in link["joint"]:
                    leaders.append(f"joint{k}")
        links.append(link)
    frame = {"name": "tip", "link": links[-1]["name"], "pos": [0.1, 0, 0]}
    component = {
        "format": 1,
        "component": {"name": "Random", "kind": "body"},
        "link": links,
        "frame": [frame | {"quat": unit(rng, 4)}],
        "root": {"kind": str(rng.choice(["fixed", "planar", "free"]))},
    }
    read = parse_model(Component, component, source=f"seed {seed}")
    return describe_component(read, source=f"seed {seed}")


def random_state(model, rng):
    q = pin.neutral(model)
    for joint in list(model.joints)[1:]:
        if joint.nq == 1:
            q[joint.idx_q] = rng.uniform(-2.0, 2.0)
    if model.nv and model.joints[1].nq == 7:
        q[:3], q[3:7] = rng.normal(size=3), unit(rng, 4)
    return q, rng.normal(size=model.nv)


def dense(m, d):
    full = np.zeros((m.nv, m.nv))
    if m.nv:
        mujoco.mj_fullM(m, d, full)
    return full


def check_engines(robot, rng):
    """Compare poses, mass matrix and bias of both exports at a random state."""
    m, model = robot.to_mjspec().compile(), robot.to_pinocchio()
    assert m.nv == model.nv
    d, data = mujoco.MjData(m), model.createData()
    q, v = random_state(model, rng)
    d.qpos[:], d.qvel[:] = q, v
    B = np.eye(m.nv)
    a = np.zeros(m.nv)
    if robot.root.kind == "free":
        d.qpos[3:7] = q[[6, 3, 4, 5]]
        R = pin.Quaternion(*q[[6, 3, 4, 5]]).matrix()
        B[:3, :3] = R.T
        d.qvel[:3] = R @ v[:3]
        a[:3] = -np.cross(v[3:6], v[:3])
    mujoco.mj_forward(m, d)
    pin.framesForwardKinematics(model, data, q)
    for link in robot.links:
        frame = model.getFrameId(link.name, pin.FrameType.BODY)
        body = d.body(link.name)
        assert np.abs(body.xpos - data.oMf[frame].translation).max() < TOLERANCE
        turned = body.xmat.reshape(3, 3) - data.oMf[frame].rotation
        assert np.abs(turned).max() < TOLERANCE
    M = pin.crba(model, data, q)
    M = np.triu(M) + np.triu(M, 1).T
    scale = max(1.0, float(np.abs(M).max(initial=0.0)))
    assert np.abs(dense(m, d) - B.T @ M @ B).max(initial=0.0) < TOLERANCE * scale
    bias = B.T @ pin.rnea(model, data, q, v, a)
    scale = max(1.0, float(np.abs(bias).max(initial=0.0)))
    assert np.abs(d.qfrc_bias - bias).max(initial=0.0) < TOLERANCE * scale


def check_urdf(robot, rng):
    """Compare our model with Pinocchio's reading of our URDF, at one configuration."""
    ours, theirs = robot.to_pinocchio(), pin.buildModelFromXML(robot.to_urdf())
    q, p = pin.neutral(ours), pin.neutral(theirs)
    for joint in robot.joints:
        value = rng.uniform(-2.0, 2.0)
        q[ours.joints[ours.getJointId(joint.name)].idx_q] = value
        entry = theirs.joints[theirs.getJointId(joint.name)]
        if entry.nq == 2:
            p[entry.idx_q : entry.idx_q + 2] = np.cos(value), np.sin(value)
        else:
            p[entry.idx_q] = value
    data, other = ours.createData(), theirs.createData()
    pin.framesForwardKinematics(ours, data, q)
    pin.framesForwardKinematics(theirs, other, p)
    for name in (*(x.name for x in robot.links), "tip"):
        mine = [i for i, f in enumerate(ours.frames) if f.name == name][-1]
        its = theirs.getFrameId(name, pin.FrameType.BODY)
        difference = data.oMf[mine].homogeneous - other.oMf[its].homogeneous
        assert np.abs(difference).max() < TOLERANCE
    masses = pin.computeTotalMass(ours), pin.computeTotalMass(theirs)
    assert masses[0] == pytest.approx(masses[1])


def check_ik(robot, rng):
    """Chase random targets: limits are kept, nothing raises, nothing is not finite."""
    model = robot.to_pinocchio()
    if not model.nv:
        return
    configuration = Configuration(model, random_state(model, rng)[0])
    task = FrameTask("tip")
    stack = TaskStack(configuration, [task, PostureTask(level=1)])
    bounds = stack.bounds
    bounded = bounds.q_index >= 0
    places = bounds.q_index[bounded]
    for _ in range(12):
        target = pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(size=3))
        task.set_target(target)
        before = configuration.q[places]
        solution = stack.solve(0.01)
        assert (np.abs(solution.v) <= bounds.v_max + 1e-9).all()
        configuration.update(configuration.integrate(solution.dq))
        after = configuration.q[places]
        assert np.isfinite(configuration.q).all()
        low = np.minimum(before, bounds.q_lower[bounded])
        high = np.maximum(before, bounds.q_upper[bounded])
        assert (after <= high + 1e-9).all()
        assert (after >= low - 1e-9).all()
    Conversion(robot.to_mjspec().compile(), model).q_to_mujoco(configuration.q)


def check(seed):
    robot, rng = random_robot(seed), np.random.default_rng(seed)
    check_engines(robot, rng)
    check_urdf(robot, rng)
    check_ik(robot, rng)


@pytest.mark.slow
@settings(max_examples=25)
@given(seed=st.integers(0, 2**32))
def test_random_robots_agree_everywhere(seed):
    check(seed)


@pytest.mark.slow
@settings(max_examples=500)
@given(seed=st.integers(0, 2**32))
def test_many_random_robots_agree_everywhere(seed):
    check(seed)
