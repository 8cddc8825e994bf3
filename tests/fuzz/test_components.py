"""Damaged robot files: either a robot that both engines build, or one WbcError."""

import copy

import numpy as np
import pytest
from damage import parent_of, places
from hypothesis import given, settings
from hypothesis import strategies as st

from wbc_suite.catalogue import Catalogue
from wbc_suite.config_files import parse_model, read_toml
from wbc_suite.errors import DescriptionError, WbcError
from wbc_suite.robot.assembly import describe_component
from wbc_suite.robot.robot_file import Component, reflect_component

FILES = [
    read_toml(path)
    for kind in ("arm", "body", "gripper", "base")
    for path in Catalogue().files(f"robots/{kind}")
]
COMPONENTS = [data for data in FILES if "extends" not in data["component"]]

NUMBERS = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True),
    st.sampled_from([0, -1, 1e300, -1e300, 1e-300, 10**30, True]),
)
NAMES = st.one_of(st.text(max_size=12), st.sampled_from(["world", "root", "left_", ""]))
VALUES = st.one_of(
    NUMBERS,
    NAMES,
    st.none(),
    st.lists(NUMBERS, max_size=7),
    st.dictionaries(NAMES, NUMBERS, max_size=3),
)


@st.composite
def damaged(draw):
    data = copy.deepcopy(draw(st.sampled_from(COMPONENTS)))
    for _ in range(draw(st.integers(1, 3))):
        path = draw(st.sampled_from(list(places(data))))
        holder, key = parent_of(data, path), path[-1]
        match draw(st.sampled_from(["replace", "remove", "repeat", "rename"])):
            case "replace":
                holder[key] = draw(VALUES)
            case "remove":
                del holder[key]
            case "repeat" if isinstance(holder, list):
                holder.append(copy.deepcopy(holder[key]))
            case _ if isinstance(holder, dict):
                holder[draw(NAMES)] = holder.pop(key)
    return data


def build(data):
    component = parse_model(Component, data, source="fuzz", error=DescriptionError)
    robot = describe_component(
        reflect_component(component, source="fuzz"), source="fuzz"
    )
    model = robot.to_mjspec().compile()
    twin = robot.to_pinocchio()
    assert model.nv == twin.nv
    assert np.isfinite(model.body_inertia).all()


def outcome(data):
    try:
        build(data)
    except WbcError as error:
        text = str(error)
    else:
        text = ""
    assert len(text) < 4000


@pytest.mark.slow
@settings(max_examples=100)
@given(damaged())
def test_damaged_components_are_answered_in_words(data):
    outcome(data)


@pytest.mark.slow
def test_undamaged_components_build():
    for data in COMPONENTS:
        build(copy.deepcopy(data))


@pytest.mark.slow
@settings(max_examples=1000)
@given(damaged())
def test_many_damaged_components_are_answered_in_words(data):
    outcome(data)
