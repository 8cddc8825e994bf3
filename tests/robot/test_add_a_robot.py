"""The walk-through of docs/robots.md, step by step, with the robot it names."""

import re
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import wbc_suite
from wbc_suite.catalogue import Catalogue
from wbc_suite.robot import elements, shapes
from wbc_suite.robot.robot_file import AssemblyHeader, Header, Part

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "robots.md").read_text(encoding="utf-8")
URDF = ROOT / "examples" / "robots" / "six_axis_arm.urdf"


@pytest.fixture
def lab(tmp_path):
    """A folder of the user, with the robot edited as on the page."""
    text = wbc_suite.load_robot(URDF).to_toml()
    text = text.replace('name = "six_axis_arm"', 'name = "SixAxis"')
    blocks = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    text = text[: text.index("[keyframe.ready]")] + blocks[0]
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots" / "six_axis.toml").write_text(text, encoding="utf-8")
    return Catalogue(extra=(tmp_path,))


def test_the_edited_robot_is_found_by_name(lab):
    robot = wbc_suite.load_robot("SixAxis", catalogue=lab)
    assert robot.name == "SixAxis"
    assert robot.root.pos == (0.0, 0.0, 0.85)
    assert set(robot.synergies) == {"right_gripper"}
    model, data = robot.to_pinocchio(), robot.to_pinocchio().createData()
    pin.framesForwardKinematics(model, data, model.referenceConfigurations["ready"])
    tool = data.oMf[model.getFrameId("right_tcp")]
    np.testing.assert_allclose(tool.rotation[:, 2], [0, 0, -1], atol=0.02)  # down


def test_its_hand_reaches_and_closes(lab):
    robot = wbc_suite.load_robot("SixAxis", catalogue=lab)
    env = wbc_suite.make("Lift", robots=robot, controller_configs="WHOLE_BODY_IK")
    env.reset(seed=0)
    simulation = env.unwrapped.simulation
    site = simulation.data.site("robot0_right_tcp")
    turn = pin.log3(site.xmat.reshape(3, 3).copy())
    goal = site.xpos + np.array([0.0, 0.05, 0.05])
    action = env.unwrapped.action_layout.pack(
        {"right_hand": np.concatenate([goal, turn]), "right_gripper": np.array([1.0])}
    )
    for _ in range(40):
        *_, info = env.step(action)
    assert info["ik"]["frames"]["right_hand"]["reached"]
    assert np.linalg.norm(site.xpos - goal) < 1e-3
    for finger in ("left_finger_joint", "right_finger_joint"):
        assert abs(simulation.data.joint(f"robot0_{finger}").qpos[0]) < 1e-3
    env.close()


TABLES = {
    "[component]": Header,
    "[root]": elements.Root,
    "[[link]]": elements.Link,
    "joint": elements.Joint,
    "[[frame]]": elements.Frame,
    "[[mount]]": elements.Mount,
    "[[camera]]": elements.Camera,
    "[[actuator]]": elements.Actuator,
    "[[sensor]]": elements.Sensor,
    "[[synergy]]": elements.Synergy,
    "[[connect]]": elements.Connect,
    "[contacts]": elements.Contacts,
    "[assembly]": AssemblyHeader,
    "[[part]]": Part,
    "box": shapes.Box,
    "sphere": shapes.Sphere,
    "ellipsoid": shapes.Ellipsoid,
    "capsule": shapes.Capsule,
    "cylinder": shapes.Cylinder,
    "hull": shapes.Hull,
    "loft": shapes.Loft,
}
SHARED = {"shape", "pos", "quat", "color"}
SHARED |= {"friction", "condim", "solref", "margin", "priority"}


@pytest.mark.parametrize(("table", "model"), TABLES.items())
def test_the_reference_names_every_key(table, model):
    row = re.search(rf"^\| `{re.escape(table)}` \|(.*)\|$", PAGE, re.MULTILINE)
    assert row is not None
    text = row.group(1)
    keys = {field.alias or name for name, field in model.model_fields.items()}
    if (
        issubclass(model, shapes.Posed | shapes.ShapeFields)
        and table.isalpha()
        and table != "joint"
    ):
        keys -= SHARED
    missing = {key for key in keys if not re.search(rf"`{key}\b", text)}
    assert missing == set()
