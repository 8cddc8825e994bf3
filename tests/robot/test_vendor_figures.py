"""Kinematics and gravity against the vendors' own models, computed elsewhere.

`oracles/*.json` hold 25 configurations each, evaluated on the source's description by
two loaders that agree to 1e-13; the figures are rounded to 10 digits. Where our file
corrects a mass (a listed deviation), `source_masses` gives the source's own mass and
centre of that link, which are put back before gravity is compared. `root_quat` turns a
first link that is not the source's, so that the source's own stands upright.
"""

import json
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import wbc_suite

ORACLES = sorted((Path(__file__).parent / "oracles").glob("*.json"))
POSE_TOLERANCE = 1e-8
GRAVITY_TOLERANCE = 1e-7


@pytest.fixture(scope="module", params=ORACLES, ids=lambda p: p.stem)
def oracle(request):
    return json.loads(request.param.read_text())


@pytest.fixture(scope="module")
def model(oracle):
    load = dict(oracle["load"])
    robot = wbc_suite.load_robot(load.pop("robot"), **load)
    home = oracle.get("root_quat", (1.0, 0.0, 0.0, 0.0))
    robot = robot.with_root(robot.root.kind, pos=(0.0, 0.0, 0.0), quat=tuple(home))
    return robot.to_pinocchio()


def configuration(model, oracle, row):
    q = pin.neutral(model)
    if "base" in row:
        x, y, z, w, *vector = row["base"]
        q[:7] = (x, y, z, *vector, w)
    for name, value in zip(oracle["joints"], row["q"], strict=True):
        q[model.joints[model.getJointId(name)].idx_q] = value
    return q


def pose_of(values):
    quat = np.array(values[3:]) / np.linalg.norm(values[3:])
    return pin.SE3(pin.Quaternion(*quat).matrix(), np.array(values[:3]))


def test_frame_poses_are_the_vendors(oracle, model):
    data = model.createData()
    assert len(oracle["configurations"]) == 25
    for row in oracle["configurations"]:
        pin.framesForwardKinematics(model, data, configuration(model, oracle, row))
        for name, values in row["poses"].items():
            place = oracle["frames"][name]
            link = model.getFrameId(place["link"], pin.FrameType.BODY)
            inside = pose_of(
                [*place.get("pos", (0, 0, 0)), *place.get("quat", (1, 0, 0, 0))]
            )
            error = pose_of(values).homogeneous - (data.oMf[link] * inside).homogeneous
            assert np.abs(error).max() < POSE_TOLERANCE, name


def with_source_masses(model, oracle):
    """Copy the model with the source's own masses where we deliberately differ."""
    model = model.copy()
    for link, (mass, *centre) in oracle.get("source_masses", {}).items():
        joint = model.frames[model.getFrameId(link, pin.FrameType.BODY)].parentJoint
        model.inertias[joint].mass = mass
        model.inertias[joint].lever = np.array(centre)
    return model


def test_gravity_torques_are_the_vendors(oracle, model):
    model = with_source_masses(model, oracle)
    data = model.createData()
    index = [model.joints[model.getJointId(n)].idx_v for n in oracle["joints"]]
    for row in oracle["configurations"]:
        q = configuration(model, oracle, row)
        torque = pin.computeGeneralizedGravity(model, data, q)[index]
        np.testing.assert_allclose(torque, row["gravity"], atol=GRAVITY_TOLERANCE)
