"""Inertia tensors: which ones a rigid body can have, and the nearest of those."""

import numpy as np
import pytest

from wbc_suite.robot.elements import Link, rigid_bodies
from wbc_suite.robot.inertia import (
    implausible,
    inertia_fields,
    inertia_matrix,
    nearest_physical,
    unphysical,
)
from wbc_suite.robot.shapes import Box


def link(inertia, mass=1.0, **fields):
    return Link(name="l", mass=mass, inertia=inertia, **fields)


def solid_box(half, mass=1.0, **fields):
    xx, yy, zz = (mass / 3 * (sum(h * h for h in half) - a * a) for a in half)
    shape = Box(shape="box", size=half)
    return link((xx, yy, zz, 0, 0, 0), mass, visual=(shape,), **fields)


def test_fields_and_matrix_are_inverse():
    fields = (1.0, 2.0, 3.0, 0.1, 0.2, 0.3)
    matrix = inertia_matrix(fields)
    np.testing.assert_array_equal(matrix, matrix.T)
    assert (matrix[0, 1], matrix[0, 2], matrix[1, 2]) == (0.1, 0.2, 0.3)
    assert inertia_fields(matrix) == fields


@pytest.mark.parametrize(
    ("inertia", "mass", "fault"),
    [
        ((0.1, 0.1, 0.1, 0, 0, 0), 1.0, None),
        ((0.1, 0.1, 0.2, 0, 0, 0), 1.0, None),  # a flat disc
        ((0.1, 0.1, 0.21, 0, 0, 0), 1.0, "triangle inequality"),
        ((0.1, 0.1, -0.1, 0, 0, 0), 1.0, "not positive definite"),
        ((0.1, 0.1, 0.1, 0.2, 0, 0), 1.0, "not positive definite"),
        ((0, 0, 0, 0, 0, 0), 1.0, None),  # a point mass on another link
        ((0, 0, 0, 0, 0, 0), 1e-12, "below 1e-10 kg"),
    ],
)
def test_unphysical_inertias_are_named(inertia, mass, fault):
    found = unphysical(link(inertia, mass))
    assert (found is None) == (fault is None)
    assert (fault or "") in (found or "")


def test_the_nearest_inertia_is_physical_and_keeps_what_was_right():
    rng = np.random.default_rng(2)
    for _ in range(20):
        axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        moments = np.array([0.1, 0.2, 0.9])  # 0.1 + 0.2 < 0.9
        wrong = link(inertia_fields(axes @ np.diag(moments) @ axes.T))
        assert unphysical(wrong)
        near = nearest_physical(wrong)
        assert unphysical(near) is None
        # Second moments S = tr(I)/2 - I: the negative one rises to that of 1 mm.
        tensor = inertia_matrix(near.inertia)
        second = np.linalg.eigvalsh(np.trace(tensor) / 2 * np.eye(3) - tensor)
        np.testing.assert_allclose(second, [1e-6, 0.4, 0.5], atol=1e-12)


def test_a_physical_inertia_is_its_own_nearest():
    good = link((0.2, 0.3, 0.4, 0.01, 0.02, 0.03))
    np.testing.assert_allclose(nearest_physical(good).inertia, good.inertia, atol=1e-15)


def test_a_solid_box_is_plausible():
    assert list(implausible(solid_box((0.1, 0.2, 0.3)))) == []


def test_a_centre_of_mass_outside_the_shapes_is_named_with_its_distance():
    ((rule, text),) = implausible(solid_box((0.1, 0.2, 0.3), com=(0.225, 0, 0)))
    assert rule == "com"
    assert "lies 100 mm outside" in text  # 0.1 + 10 % of 0.2 + 5 mm are allowed


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_an_inertia_of_another_size_is_named(factor):
    box = solid_box((0.1, 0.2, 0.3))
    scaled = box.model_copy(update={"inertia": tuple(factor * i for i in box.inertia)})
    assert [rule for rule, _ in implausible(scaled)] == ["inertia"]


def test_links_without_joint_belong_to_the_link_that_carries_them():
    hinge = {"name": "j"}
    links = [
        Link(name="base"),
        Link(name="plate", parent="base"),
        Link(name="arm", parent="plate", joint=hinge),
        Link(name="tool", parent="arm"),
        Link(name="tip", parent="tool"),
    ]
    assert rigid_bodies(links) == {
        "base": "base", "plate": "base", "arm": "arm", "tool": "arm", "tip": "arm",
    }  # fmt: skip
