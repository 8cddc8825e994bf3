"""Models from outside: bombs, ways out, damage; refused in words, time and memory."""

import os
import re
import resource
import struct
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wbc_suite.catalogue import Catalogue
from wbc_suite.envs.states import write_scene
from wbc_suite.errors import ConfigError, WbcError
from wbc_suite.robot import load_robot
from wbc_suite.robot.mjcf_compile import compile_mjcf

EXAMPLES = int(os.environ.get("WBC_SUITE_FUZZ", "40"))
"""Damaged files of each kind; 1,000 of them take about a minute."""
SECONDS, MEGABYTES = 5.0, 300
HUGE = 2 * 10**9

GEOM = '<geom size="1"/>'
BALL = '<body name="b"><joint name="j"/><geom size="1"/></body>'


def model(*, world="", rest="", before=""):
    return f"{before}<mujoco><worldbody>{world}</worldbody>{rest}</mujoco>"


def times(count, inner):
    return f'<replicate count="{count}">{inner}</replicate>'


def asset(inner):
    return f"<asset>{inner}</asset>"


def mesh(kind):
    return asset(f'<mesh name="m" builtin="{kind}" params="30000 .5 .5 .5"/>')


BOMBS = {
    "entities": model(before='<!DOCTYPE m [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>'),
    "an entity that is a file": model(
        before='<!DOCTYPE m [<!ENTITY a SYSTEM "file:///etc/passwd">]>'
    ),
    "copies": model(world=times(HUGE, GEOM)),
    "copies of copies": model(world=times(1000, times(1000, times(1000, GEOM)))),
    "a cloth": model(
        world='<flexcomp name="f" count="50000 50000 1" spacing="1 1 1" dim="2"/>'
    ),
    "a height field": model(
        rest=asset('<hfield name="h" nrow="200000" ncol="200000" size="1 1 1 1"/>')
    ),
    "a texture": model(
        rest=asset('<texture name="t" builtin="flat" width="200000" height="200000"/>')
    ),
    **{
        f"a computed {kind}": model(rest=mesh(kind)) for kind in ("plate", "supertorus")
    },
    "keys": model(rest=f'<size nkey="{HUGE}"/>'),
    "numbers of users": model(rest=f'<size nuser_body="{HUGE}"/>'),
    "a sensor": model(rest=f'<sensor><user name="s" dim="{HUGE}"/></sensor>'),
    "a camera": model(world=f'<camera resolution="{HUGE} {HUGE}"/>'),
    "an actuator's states": model(
        world=BALL,
        rest='<actuator><general joint="j" dyntype="user" '
        f'actdim="{HUGE}"/></actuator>',
    ),
    "a length of 2^40": model(rest=f'<size nuserdata="{2**40}"/>'),
    "depth": model(world="<body>" * 5000 + "</body>" * 5000),
    "many bodies": model(world=f"<body>{GEOM}</body>" * 20_000),
    "no numbers": model(world='<geom size="nan"/>'),
    "infinitely many": model(world=times("inf", GEOM)),
    "plugins": model(rest='<extension><plugin plugin="mujoco.sdf.bolt"/></extension>'),
    "itself": model(rest='<include file="x.xml"/>'),
    "a file by its path": model(rest='<include file="/etc/passwd"/>'),
    "a file above": model(rest=asset('<mesh file="../../../etc/passwd"/>')),
    "a folder above": model(
        before="", rest='<compiler meshdir="../.."/>' + asset('<mesh file="passwd"/>')
    ),
    "a link that leads out": model(rest=asset('<mesh file="link.stl"/>')),
    "a picture that claims much": model(
        rest=asset('<texture name="t" type="2d" file="bomb.png"/>')
    ),
    "a huge mesh": model(rest=asset('<mesh file="huge.stl"/>')),
    "a mesh of 2^32 faces": model(
        world='<geom type="mesh" mesh="liar"/>', rest=asset('<mesh file="liar.stl"/>')
    ),
}


def costs():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return time.process_time(), usage.ru_maxrss / 1024


@pytest.mark.parametrize(
    "size", [f'njmax="{HUGE}" nconmax="{HUGE}"', 'memory="1T"', 'nstack="1000000000"']
)
def test_hints_of_sizes_are_ignored(size, tmp_path):
    path = tmp_path / "x.xml"
    path.write_text(model(world=GEOM, rest=f"<size {size}/>"))
    before = costs()
    loaded, _ = compile_mjcf(path)
    assert loaded.ngeom >= 1
    assert costs()[1] - before[1] < MEGABYTES


@pytest.mark.parametrize("name", BOMBS)
def test_what_is_hostile_is_refused_at_little_cost(name, tmp_path):
    (tmp_path / "link.stl").symlink_to("/etc/passwd")
    head = b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sII", 13, b"IHDR", 2**31, 2**31)
    (tmp_path / "bomb.png").write_bytes(head)
    (tmp_path / "liar.stl").write_bytes(bytes(80) + struct.pack("<I", 2**32 - 1))
    with (tmp_path / "huge.stl").open("wb") as huge:
        huge.truncate(2**40)  # takes no room
    path = tmp_path / "x.xml"
    path.write_text(BOMBS[name])
    before = costs()
    with pytest.raises(WbcError, match=r"x\.xml") as caught:
        compile_mjcf(path)
    seconds, megabytes = costs()
    assert len(str(caught.value)) < 1000
    assert seconds - before[0] < SECONDS
    assert megabytes - before[1] < MEGABYTES


MJCF = write_scene(load_robot("Panda", gripper="none").to_mjspec())
TOML = {
    path.stem: path.read_text()
    for kind in ("arm", "gripper")
    for path in Catalogue().files(f"robots/{kind}")
}
NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")
WORDS = ["nan", "-1", "1e308", str(2**40), str(10**400), "'", '"', "[" * 3000, "\x00"]


@st.composite
def damaged(draw, texts):
    """Cut a text off, repeat a part, or put something else in place of numbers."""
    text = draw(st.sampled_from(texts))
    for _ in range(draw(st.integers(1, 3))):
        place = draw(st.integers(0, len(text)))
        match draw(st.sampled_from(["cut", "repeat", "number", "word"])):
            case "cut":
                text = text[:place]
            case "repeat":
                part = text[place : place + draw(st.integers(1, 2000))]
                text = text[:place] + part * draw(st.integers(1, 50)) + text[place:]
            case "number":
                found = NUMBER.search(text, place)
                if found:
                    word = draw(st.sampled_from(WORDS[:5]))
                    text = text[: found.start()] + word + text[found.end() :]
            case _:
                text = text[:place] + draw(st.sampled_from(WORDS)) + text[place:]
    return text


def outcome(text, file):
    """Load what is damaged: a robot, or one error in words, at a bounded cost."""
    file.write_text(text)
    before = costs()
    said = ""
    try:
        load_robot(file)
    except WbcError as error:
        said = str(error)
    assert len(said) < 4000
    seconds, megabytes = costs()
    assert seconds - before[0] < SECONDS
    assert megabytes - before[1] < MEGABYTES


FUZZ = settings(max_examples=EXAMPLES)


@pytest.mark.parametrize("value", ["[" * 5000, "{a=" * 5000, "9" * 5000])
def test_toml_that_never_ends_is_refused(value, tmp_path):
    path = tmp_path / "x.toml"
    path.write_text(f"format = {value}")
    with pytest.raises(ConfigError, match=r"x\.toml") as caught:
        load_robot(path)
    assert len(str(caught.value)) < 500


@pytest.mark.slow
@FUZZ
@given(text=damaged([MJCF]))
def test_damaged_mjcf_is_a_robot_or_an_error(text, tmp_path_factory):
    outcome(text, tmp_path_factory.getbasetemp() / "x.xml")


@FUZZ
@given(text=damaged(list(TOML.values())))
def test_damaged_toml_is_a_robot_or_an_error(text, tmp_path_factory):
    outcome(text, tmp_path_factory.getbasetemp() / "x.toml")
