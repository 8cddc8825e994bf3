"""Enclosing capsules really enclose, and pairs follow the simulator's rules."""

import mujoco
import numpy as np
import pytest

from wbc_suite.catalogue import Catalogue
from wbc_suite.robot import load_robot
from wbc_suite.robot.collision_capsules import (
    _capsules,
    _gripper_links,
    collision_pairs,
    enclosing_capsules,
)
from wbc_suite.robot.shapes import Box, Capsule, Cylinder, Ellipsoid, Hull, Sphere


def surface_points(shape, rng, n=4000):
    u = rng.normal(size=(n, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    match shape:
        case Sphere():
            return shape.radius * u
        case Ellipsoid():
            return u * np.array(shape.size)
        case Box():
            cube = u / np.abs(u).max(axis=1, keepdims=True)
            return cube * np.array(shape.size)
        case Hull():
            centres = np.array(shape.spheres)[:, :3]
            radii = np.array(shape.spheres)[:, 3]
            pick = rng.integers(len(radii), size=n)
            return centres[pick] + radii[pick, None] * u
        case _:
            a, b = np.array(shape.start), np.array(shape.end)
            points = a + rng.uniform(size=(n, 1)) * (b - a)
            axis = (b - a) / np.linalg.norm(b - a)
            ring = np.cross(u, axis)
            return points + shape.radius * ring / np.linalg.norm(
                ring, axis=1, keepdims=True
            )


SHAPES = [
    Sphere(shape="sphere", radius=0.1),
    Ellipsoid(shape="ellipsoid", size=(0.1, 0.3, 0.2)),
    Box(shape="box", size=(0.3, 0.02, 0.2)),
    Box(shape="box", size=(0.1, 0.1, 0.1)),
    Capsule(shape="capsule", start=(0, 0, 0), end=(0.1, 0.2, 0.3), radius=0.05),
    Cylinder(shape="cylinder", start=(0, 0, 0), end=(0, 0.2, 0.1), radius=0.05),
    Hull(
        shape="hull", spheres=((0, 0, 0, 0.1), (0.3, 0, 0, 0.05), (0.1, 0.2, 0, 0.02))
    ),
]


@pytest.mark.parametrize("shape", SHAPES, ids=lambda s: s.shape)
def test_every_surface_point_is_inside_a_capsule(shape):
    points = surface_points(shape, np.random.default_rng(1))
    depth = np.full(len(points), np.inf)
    for start, end, radius in _capsules(shape):
        d = end - start
        t = np.clip((points - start) @ d / max(d @ d, 1e-12), 0, 1)
        distance = np.linalg.norm(points - start - t[:, None] * d, axis=1)
        depth = np.minimum(depth, distance - radius)
    slack = 2e-3 if isinstance(shape, Hull) else 1e-9  # a hull is meshed to 162 points
    assert depth.max() < slack


def test_flat_drives_do_not_grow_by_their_radius():
    """A capsule with the whole axis as segment would reach 100 mm beyond each face."""
    drive = Cylinder(shape="cylinder", start=(0, 0, 0), end=(0, 0, 0.1), radius=0.1)
    ((start, end, radius),) = _capsules(drive)
    assert end[2] + radius - 0.1 < 0.07
    assert start[2] - radius > -0.07
    assert radius < 0.12


@pytest.mark.parametrize("name", Catalogue().names("robots"))
def test_pairs_are_those_that_the_simulator_may_collide(name):
    robot = load_robot(name)
    pairs = collision_pairs(robot)
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    rng = np.random.default_rng(3)
    links = {link.name for link in robot.links}
    hands = [j for s in robot.synergies for j in robot.groups[s]]
    fingers = _gripper_links(robot)
    for _ in range(100):
        for joint in robot.joints:
            low, high = joint.range or (-3, 3)
            still = joint.name in hands or joint.mimic is not None
            value = 0.0 if still else rng.uniform(low, high)
            data.joint(joint.name).qpos = np.clip(value, low, high)
        mujoco.mj_forward(model, data)
        for contact in data.contact:
            bodies = [model.body(model.geom_bodyid[g]).name for g in contact.geom]
            hand = {fingers.get(body) for body in bodies}
            if links.issuperset(bodies) and (len(hand) > 1 or hand == {None}):
                assert frozenset(bodies) in pairs
    assert len(enclosing_capsules(robot)) >= sum(bool(x.collision) for x in robot.links)
