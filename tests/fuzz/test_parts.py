"""Damaged BASIC configs and actions: a controller that works, or one error in words."""

import copy
import json

import mujoco
import numpy as np
import pytest
from damage import parent_of, places
from hypothesis import given, settings
from hypothesis import strategies as st

import wbc_suite
from wbc_suite.compiling import plain
from wbc_suite.control import (
    RobotState,
    build_composite_controller,
    load_composite_controller_config,
)
from wbc_suite.control.composite.protocols import solver_of_body
from wbc_suite.control.ground.records import gather
from wbc_suite.control.part.registry import PART_CONTROLLERS
from wbc_suite.control.robot_parts import hands_of, parts_of
from wbc_suite.control.run.data import loop_data
from wbc_suite.control.run.kernel_table import bind_kernels
from wbc_suite.control.run.motor_commands import write_commands
from wbc_suite.errors import ActionError, WbcError
from wbc_suite.scene import attach_robot, empty_arena

NUMBERS = st.one_of(
    st.floats(), st.sampled_from([0, -1, 1e300, 1e-300, 10**30, True, 0.5, None])
)
NAMES = st.one_of(
    st.text(max_size=8),
    st.sampled_from(["right", "OSC_POSE", "world", "eef", "variable", "absolute"]),
)
KEYS = st.sampled_from(
    sorted(
        {
            key
            for kind in PART_CONTROLLERS
            for key in PART_CONTROLLERS[kind].config.model_fields
        }
    )
)
VALUES = st.one_of(
    NUMBERS,
    NAMES,
    st.lists(NUMBERS, max_size=7),
    st.lists(st.lists(NUMBERS, max_size=7), min_size=2, max_size=2),
    st.dictionaries(NAMES, NUMBERS, max_size=2),
)
FAST = settings(max_examples=100)


def stand(name):
    robot = wbc_suite.load_robot(name)
    spec = empty_arena()
    attach_robot(spec, robot, "robot0_")
    model = spec.compile()
    data = mujoco.MjData(model)
    state = RobotState(model, data, robot, prefix="robot0_")
    posture = robot.keyframe("ready")
    data.qpos[state.joint_addresses(tuple(posture))[0]] = list(posture.values())
    mujoco.mj_forward(model, data)
    return state


STATES = [stand(name) for name in ("PandaOmron", "UR5e", "GR1FreeBody")]


def some_config(draw, robot):
    """Return a config of parts at random, in our layout or in that of JSON files."""
    parts = {}
    for part in parts_of(robot):
        kinds = ["JOINT_POSITION", "JOINT_VELOCITY", "JOINT_TORQUE"]
        if part in hands_of(robot):
            kinds = [*kinds, "OSC_POSE", "OSC_POSITION", "IK_POSE"]
        if part == "base":
            kinds = ["BASE_VELOCITY"]
        if part == "legs":
            kinds = ["STANCE"]
        parts[part] = {
            "type": draw(st.sampled_from(kinds)),
            "gripper": {"type": "GRIP"},
        }
        if part == "legs":
            del parts[part]["gripper"]
    if draw(st.booleans()):
        return {"type": "BASIC", "body_parts": {"arms": parts}}
    return {"format": 1, "type": "BASIC", "body_parts": parts}


def damage(draw, data):
    """Return a copy with one value replaced, renamed, removed or added."""
    data = copy.deepcopy(data)
    path = draw(st.sampled_from(list(places(data))))
    holder, key = parent_of(data, path), path[-1]
    match draw(st.sampled_from(["replace", "rename", "remove", "add", "add", "add"])):
        case "add":
            part = draw(st.sampled_from(list(parts_in(data))))
            part[draw(KEYS)] = draw(VALUES)
        case "replace":
            holder[key] = draw(VALUES)
        case "rename":
            holder[draw(NAMES)] = holder.pop(key)
        case _:
            del holder[key]
    return data


def parts_in(config):
    parts = config["body_parts"]
    return parts.get("arms", parts).values()


def write_all_commands(controller, state):
    """Compute the commands of all actuators once, in plain Python."""
    laws, drives = gather([(law.record, law.drives) for law in controller.laws])
    solver = solver_of_body(controller)
    bodies = () if solver is None else (solver.dynamics,)
    data = loop_data(state.model, state.data, laws, drives)._replace(bodies=bodies)
    loop, kernels, _ = bind_kernels(data, compiled=False)
    plain(write_commands)(loop, kernels)


@pytest.mark.slow
@FAST
@given(data=st.data())
def test_a_damaged_config_makes_a_controller_or_is_refused_in_words(data):
    state = data.draw(st.sampled_from(STATES))
    config = damage(data.draw, some_config(data.draw, state.robot))
    before = copy.deepcopy(config)
    try:
        ours = load_composite_controller_config(config, state.robot)
        controller = build_composite_controller(ours, state)
    except WbcError as error:
        text = str(error)
    else:
        text = "the controller works as it should"
        layout = controller.layout
        assert (layout.low <= layout.high).all()
        controller.set_goal(layout.clip(layout.check(controller.hold_action))[0])
        with np.errstate(all="ignore"):
            write_all_commands(controller, state)
        assert np.isfinite(state.data.ctrl).all()
    assert 20 < len(text) < 3000
    assert repr(config) == repr(before)


@FAST
@given(data=st.data())
def test_a_damaged_json_text_is_read_or_refused_by_name(data, tmp_path_factory):
    config = {"type": "BASIC", "body_parts": {"arms": {"right": {"type": "OSC_POSE"}}}}
    text = json.dumps(config)
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, min(len(text), start + 9)))
    text = text[:start] + data.draw(st.text(max_size=4)) + text[end:]
    file = tmp_path_factory.mktemp("json") / "mine.json"
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    text = "mine.json"
    try:
        load_composite_controller_config(file, STATES[1].robot)
    except WbcError as error:
        text = str(error)
    assert "mine.json" in text or "composite controller" in text


COMPOSITES = [
    ("Panda", "JOINT_POSITION"),
    ("Panda", {"type": "OSC_POSE", "impedance_mode": "variable"}),
    ("Panda", "JOINT_VELOCITY"),
    ("Panda", "JOINT_TORQUE"),
    ("Panda", "IK_POSE"),
    ("Panda", "OSC_POSITION"),
    ("PandaOmron", "HYBRID_MOBILE_BASE"),
    ("SpotWithArm", "BASIC"),
    ("UR5e", "WHOLE_BODY_IK"),
]


@pytest.mark.parametrize(("robot", "controller"), COMPOSITES, ids=str)
def test_bad_actions_name_the_slice_and_move_nothing(robot, controller):
    env = wbc_suite.make("Lift", robots=robot, controller_configs=controller).unwrapped
    env.reset(seed=0)
    layout, data = env.action_layout, env.simulation.data
    before = data.qpos.copy(), data.time
    rng = np.random.default_rng(0)
    for part in layout.slices:
        index = int(rng.integers(part.start, part.stop))
        for value in (np.nan, np.inf, -np.inf):
            action = env.hold_action
            action[index] = value
            with pytest.raises(ActionError, match=rf"\({part.name}: "):
                env.step(action)
    held = env.hold_action
    for wrong in (held[:-1], np.append(held, 0.0), held[None], 0.0, "up", None):
        with pytest.raises(ActionError):
            env.step(wrong)
    np.testing.assert_array_equal(data.qpos, before[0])
    assert data.time == before[1]


@pytest.mark.parametrize(("robot", "controller"), COMPOSITES, ids=str)
def test_the_callers_action_is_never_written_to(robot, controller):
    env = wbc_suite.make("Lift", robots=robot, controller_configs=controller).unwrapped
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    for scale in (0.0, 0.1, 3.0):
        action = env.hold_action + scale * rng.normal(size=env.action_layout.size)
        before = action.copy()
        action.flags.writeable = False
        env.step(action)
        env.step(action)
        np.testing.assert_array_equal(action, before)
