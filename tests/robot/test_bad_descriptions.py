# ruff: noqa: E501 - a table of cases reads best with one case a line
"""Bad input: one clear error each, which names the place and what would be right."""

import re

import pytest

import wbc_suite
from wbc_suite.errors import ConfigError, DescriptionError, UnknownNameError
from wbc_suite.robot import load_robot

GOOD = """
format = 1
[component]
name = "arm"
kind = "arm"
[[link]]
name = "base"
[[link]]
name = "upper"
parent = "base"
mass = 1.0
com = [0, 0, 0.1]
inertia = [0.01, 0.01, 0.002, 0, 0, 0]
joint = { name = "shoulder", axis = [0, 1, 0], range = [-2, 2], effort = 10 }
visual = [{ shape = "capsule", from = [0, 0, 0], to = [0, 0, 0.2], radius = 0.04 }]
[[link]]
name = "fore"
parent = "upper"
pos = [0, 0, 0.2]
mass = 0.5
com = [0, 0, 0.1]
inertia = [0.005, 0.005, 0.001, 0, 0, 0]
joint = { name = "elbow", axis = [0, 1, 0], range = [-2, 2], effort = 5 }
[[frame]]
name = "eef"
link = "fore"
[groups]
arm = ["shoulder", "elbow"]
[keyframe.ready]
elbow = 1.0
"""


@pytest.fixture
def load(tmp_path):
    def write_and_load(text):
        path = tmp_path / "arm.toml"
        path.write_text(text)
        return load_robot(path)

    return write_and_load


def test_the_good_one_loads(load):
    robot = load(GOOD)
    assert robot.joint_names == ("shoulder", "elbow")
    assert robot.to_mjspec().compile().nv == robot.to_pinocchio().nv == 2


CASES = {
    "typo in a key": ("kind = \"arm\"", "knd = \"arm\"", ["component.knd", "'kind'"]),
    "typo in a joint key": ("effort = 10", "efort = 10", ["joint.efort", "'effort'"]),
    "typo in a shape": ("\"capsule\"", "\"capsul\"", ["visual[0]", "capsul"]),
    "typo in a choice": ("\"arm\"\n[[", "\"ar\"\n[[", ["component.kind", "'ar'", "'arm'"]),
    "missing key": ("name = \"eef\"\n", "", ["missing", "frame[0].name"]),
    "wrong type": ("mass = 1.0", "mass = \"heavy\"", ["link[1].mass", "'heavy'"]),
    "negative mass": ("mass = 1.0", "mass = -1.0", ["link[1].mass", "-1.0"]),
    "infinite mass": ("mass = 1.0", "mass = inf", ["link[1].mass", "inf"]),
    "nan in a position": ("pos = [0, 0, 0.2]", "pos = [0, 0, nan]", ["link[2].pos"]),
    "reversed range": ("range = [-2, 2], effort = 10", "range = [2, -2]", ["range"]),
    "axis without length": ("axis = [0, 1, 0], range = [-2, 2], effort = 10",
                            "axis = [0, 0, 0]", ["joint.axis", "length 1"]),
    "quaternion too long": ("pos = [0, 0, 0.2]", "quat = [1, 1, 0, 0]", ["length 1"]),
    "triangle inequality": ("[0.01, 0.01, 0.002,", "[0.01, 0.01, 0.03,",
                            ["upper", "triangle"]),
    "indefinite inertia": ("[0.01, 0.01, 0.002,", "[0.01, -0.01, 0.002,",
                           ["upper", "positive definite"]),
    "inertia of a house": ("[0.01, 0.01, 0.002,", "[10.0, 10.0, 2.0,",
                           ["upper", "radius of gyration"]),
    "com outside": ("com = [0, 0, 0.1]\ninertia = [0.01", "com = [0, 0, 0.9]\ninertia = [0.01",
                    ["upper", "outside"]),
    "moving without mass": ("mass = 0.5\n", "", ["fore", "needs a mass"]),
    "missing parent": ("parent = \"upper\"", "parent = \"uper\"", ["'uper'", "'upper'"]),
    "loop": ("parent = \"base\"", "parent = \"fore\"", ["loop"]),
    "own parent": ("parent = \"upper\"", "parent = \"fore\"", ["fore", "loop"]),
    "no root": ("name = \"base\"\n", "name = \"base\"\nparent = \"fore\"\n", ["parent"]),
    "duplicated link": ("name = \"fore\"", "name = \"upper\"", ["upper", "repeats"]),
    "duplicated joint": ("name = \"elbow\"", "name = \"shoulder\"",
                         ["shoulder", "repeats"]),
    "joint named as link": ("name = \"elbow\"", "name = \"upper\"", ["upper", "link"]),
    "reserved name": ("name = \"eef\"", "name = \"world\"", ["world", "reserved"]),
    "frame on nothing": ("link = \"fore\"", "link = \"foer\"", ["eef", "foer", "'fore'"]),
    "group of nothing": ("[\"shoulder\", \"elbow\"]", "[\"shoulder\", \"elbo\"]",
                         ["elbo", "'elbow'"]),
    "loop without a connect": ("effort = 5 }", "mimic = { joint = \"shoulder\", closed = true } }",
                               ["elbow", "[[connect]]"]),
    "joint in no group": ("[\"shoulder\", \"elbow\"]", "[\"shoulder\"]",
                          ["elbow", "no group"]),
    "keyframe outside": ("elbow = 1.0", "elbow = 3.0", ["ready", "3.0", "outside"]),
    "keyframe of nothing": ("elbow = 1.0", "elbw = 1.0", ["ready", "'elbow'"]),
    "unknown colour": ("radius = 0.04 }", "radius = 0.04, color = \"whit\" }", ["whit"]),
    "flat segment": ("to = [0, 0, 0.2]", "to = [0, 0, 0]", ["same point"]),
    "unknown format": ("format = 1", "format = 2", ["format", "2"]),
    "grasp beyond closed": ("[groups]", "[[synergy]]\nname = \"hook\"\nopen = { elbow = 0 }\nclosed = { elbow = 1 }\ngrasps = { pinch = [0, 1.5] }\n[groups]",
                            ["synergy[0].grasps.pinch[1]", "1.5"]),
    "not toml": ("format = 1", "format = ", ["TOML"]),
    "forbidden name": ("name = \"eef\"", "name = \"../eef\"", ["frame[0].name"]),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES, ids=str)
def test_each_fault_is_reported_in_one_sentence(load, case):
    old, new, words = CASES[case]
    assert old in GOOD
    with pytest.raises(ConfigError) as caught:
        load(GOOD.replace(old, new, 1))
    message = str(caught.value)
    assert "arm.toml" in message
    assert re.search(r"line \d+\b", message), message
    assert not re.search(
        r"pydantic|tag using|Input|Value error|[a-z?]\.[.;]", message
    ), message
    for word in words:
        assert word in message, message
    assert len(message) < 700


def test_a_huge_file_is_refused(tmp_path):
    path = tmp_path / "huge.toml"
    path.write_text("# " + "x" * 5_000_000)
    with pytest.raises(
        ConfigError, match=r"huge\.toml: the file has 5000002 bytes; at most"
    ):
        load_robot(path)


@pytest.mark.parametrize("value", ['"1"', "true", "[1]", "1979-05-27", "{ kg = 1 }"])
def test_only_a_number_is_a_number(load, value):
    with pytest.raises(ConfigError, match=r"'link\[1\]\.mass' .* must be a number"):
        load(GOOD.replace("mass = 1.0", f"mass = {value}"))


SHAPES = {
    "{ radius = 0.04 }": "missing key 'link[1].visual[0].shape' (line 15)",
    "3": "'link[1].visual[0]' = 3 (line 15): must be a table",
    '{ shape = "box", size = [1, 2] }': "missing key 'link[1].visual[0].size[2]'",
    '{ shape = "box", size = "big" }': "'big' (line 15): must be a list",
    "{ shape = 4 }": "shape' = '4' (line 15): must be one of 'box', 'sphere'",
}


@pytest.mark.parametrize("shape", SHAPES)
def test_a_shape_that_is_none_is_told_in_our_words(load, shape):
    old = GOOD[GOOD.index("visual = [") : GOOD.index(']\n[[link]]\nname = "fore')]
    with pytest.raises(ConfigError) as caught:
        load(GOOD.replace(old, f"visual = [{shape}"))
    assert SHAPES[shape] in str(caught.value)
    assert "tag" not in str(caught.value)


def test_a_fault_of_a_part_is_told_with_its_own_file_and_line(tmp_path):
    heavy = GOOD.replace("[0.01, 0.01, 0.002,", "[0.01, 0.01, 0.03,")
    (tmp_path / "arm.toml").write_text(heavy)
    path = tmp_path / "two.toml"
    part = '[[part]]\nname = "a"\ncomponent = "arm.toml"\nside = "left"\n'
    path.write_text(f'format = 1\n[assembly]\nname = "Two"\n{part}')
    with pytest.raises(
        ConfigError, match=r"arm\.toml: link 'upper' \(line 9\): the pri"
    ):
        load_robot(path)


def test_a_binary_file_is_refused(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_bytes(bytes(range(256)))
    with pytest.raises(ConfigError, match="is not text in UTF-8"):
        load_robot(path)


def test_a_missing_file_is_named():
    with pytest.raises(ConfigError, match=r"nowhere\.toml: the file does not exist"):
        load_robot("nowhere.toml")


def test_a_table_without_a_kind_is_explained(load):
    with pytest.raises(ConfigError, match=r"\[component\].*\[assembly\]"):
        load("format = 1")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "hint"),
    [("Pnda", "'Panda'"), ("GR1Arms", "'GR1ArmsOnly'"), ("Spot_Arm", "arm/Spot_Arm")],
)
def test_the_error_of_an_unknown_robot_names_the_nearest(name, hint):
    with pytest.raises(UnknownNameError, match=hint):
        load_robot(name)


@pytest.mark.parametrize("spelling", ["panda", "PANDA", "Panda"])
def test_names_are_found_without_regard_to_case(spelling):
    assert load_robot(spelling).name == "Panda"


class TestAssemblies:
    @pytest.fixture
    def assemble(self, tmp_path):
        (tmp_path / "arm.toml").write_text(
            GOOD + '\n[[mount]]\nname = "tool"\nlink = "fore"\n'
        )

        def write_and_load(parts):
            head = 'format = 1\n[assembly]\nname = "Two"\n'
            path = tmp_path / "two.toml"
            path.write_text(head + parts)
            return load_robot(path)

        return write_and_load

    ONE = '[[part]]\nname = "one"\ncomponent = "arm.toml"\nside = "right"\n'
    TWO = '[[part]]\nname = "two"\ncomponent = "arm.toml"\nside = "left"\n'

    def test_one_component_twice_gets_the_sides_as_prefixes(self, assemble):
        robot = assemble(self.ONE + self.TWO + 'on = "one.tool"\n')
        assert robot.joint_names == (
            "right_shoulder",
            "right_elbow",
            "left_shoulder",
            "left_elbow",
        )
        assert set(robot.groups) == {"right_arm", "left_arm"}
        assert robot.link("left_base").parent == "right_fore"

    def test_a_part_without_mount_is_refused(self, assemble):
        with pytest.raises(DescriptionError, match="'two' needs 'on'"):
            assemble(self.ONE + self.TWO)

    def test_the_error_of_an_unknown_mount_names_the_nearest(self, assemble):
        with pytest.raises(
            DescriptionError, match=r"one\.tol.*Did you mean 'one\.tool'"
        ):
            assemble(self.ONE + self.TWO + 'on = "one.tol"\n')

    @pytest.mark.parametrize("path", ["../arm.toml", "/etc/arm.toml"])
    def test_a_component_outside_the_folder_is_refused(self, assemble, path):
        with pytest.raises(ConfigError, match="lies outside the folder"):
            assemble(f'[[part]]\nname = "one"\ncomponent = "{path}"\n')

    def test_an_assembly_without_a_gripper_refuses_one(self, assemble, tmp_path):
        assemble(self.ONE)
        with pytest.raises(DescriptionError, match="no place for a gripper"):
            load_robot(tmp_path / "two.toml", gripper="PandaGripper")

    def test_extending_oneself_is_refused(self, tmp_path):
        folder = tmp_path / "robots"
        folder.mkdir()
        (folder / "ring.toml").write_text(
            'format = 1\n[assembly]\nname = "Ring"\nextends = "ring"\n'
        )
        catalogue = wbc_suite.Catalogue(extra=(tmp_path,))
        with pytest.raises(ConfigError, match="= 'ring': the files form a loop"):
            load_robot("ring", catalogue=catalogue)


def test_grippers_and_bases_can_be_left_out_or_chosen():
    bare = load_robot("Panda", gripper="none", base="none")
    assert bare.dof == 7
    assert bare.links[0].name == "panda_link0"
    with pytest.raises(UnknownNameError, match="gripper named 'PandaGriper'"):
        load_robot("Panda", gripper="PandaGriper")
    with pytest.raises(UnknownNameError, match="side with a gripper named 'left'"):
        load_robot("Panda", gripper={"left": "PandaGripper"})
