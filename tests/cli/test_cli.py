import json
import os
import re
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from PIL import Image

from wbc_suite.benchmark import BENCHMARKS
from wbc_suite.catalogue import ENVIRONMENT_VARIABLE, Catalogue
from wbc_suite.cli.demo import demo
from wbc_suite.cli.options import robot_names
from wbc_suite.robot import load_robot

EXAMPLES = Path(__file__).parents[2] / "examples/robots"
FILES = [
    path
    for folder in ("robots", "tasks", "controllers")
    for path in sorted((Catalogue().root / folder).rglob("*.toml"))
]


@pytest.mark.slow
def test_help_imports_nothing_heavy():
    heavy = ["mujoco", "numpy", "pinocchio", "mink", "scipy", "viser", "numba", "PIL"]
    code = f"""
import sys
from wbc_suite.cli import main
sys.argv = ["wbc-suite", "--help"]
try:
    main()
except SystemExit:
    pass
print([name for name in {heavy} if name in sys.modules], file=sys.stderr)
"""
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert result.stderr.strip() == "[]"
    assert "doctor" in result.stdout


def test_importing_the_package_imports_nothing_heavy():
    code = "import sys, wbc_suite; print('numpy' in sys.modules, len(sys.modules))"
    output = subprocess.check_output([sys.executable, "-c", code], text=True)
    assert output.startswith("False")


def test_version_is_printed(command):
    assert command("--version")[:2] == (0, "wbc-suite 0.1.0\n")


@pytest.mark.slow
def test_list_names_every_robot_and_component(command):
    code, out, _ = command("list")
    assert code == 0
    for name in ("Panda", "GR1", "Tiago", "SpotWithArm", "RethinkMount"):
        assert name in out


def test_list_of_one_kind_leaves_the_others_out(command):
    _, out, _ = command("list", "bases")
    assert "RethinkMount" in out
    assert "planar" in out  # the root that a base brings
    assert "Panda" not in out


def test_list_calls_benchmarks_as_users_do(command):
    _, out, _ = command("list", "benchmarks")
    assert all(name in out for name in BENCHMARKS)


@pytest.mark.parametrize("path", FILES, ids=lambda p: f"{p.parent.name}-{p.stem}")
def test_every_file_of_the_catalogue_passes_its_check(command, path):
    code, out, err = command("check", path)
    assert (code, err) == (0, "")
    assert "fine" in out


def test_check_prints_what_an_import_inferred(command):
    arm = EXAMPLES / "six_axis_arm.urdf"
    code, out, _ = command("check", arm)
    lines = out.splitlines()
    assert code == 0
    assert [line.split()[0] for line in lines[1:] if line[2] != " "] == (
        ["root", "groups", "hands", "gripper", "ready"]
    )
    assert "  root      fixed, first link 'base'" in lines
    assert any(
        line.startswith("  groups    right_arm: shoulder_pan, ") for line in lines
    )
    assert "            right_gripper: left_finger_joint" in lines
    assert "  hands     right: frame 'right_tcp' on link 'palm'" in lines
    code, out, _ = command("check", arm, "--json")
    assert json.loads(out)["inferred"]["root"] == ["fixed, first link 'base'"]


def test_the_export_as_mjcf_compiles_elsewhere(command, tmp_path):
    file = tmp_path / "panda.xml"
    assert command("export", "Panda", "--to", "mjcf", "-o", file)[0] == 0
    assert mujoco.MjModel.from_xml_path(str(file)).nv == 9


def test_a_urdf_comes_in_and_is_edited_as_toml(command, tmp_path):
    urdf, toml = tmp_path / "panda.urdf", tmp_path / "panda.toml"
    assert command("export", "Panda", "--to", "urdf", "-o", urdf)[0] == 0
    assert command("export", urdf, "--to", "toml", "-o", toml)[0] == 0
    code, out, _ = command("check", toml)
    assert code == 0
    assert "8 dof" in out


@pytest.mark.slow
def test_a_robot_is_exported_for_a_reader(command, tmp_path):
    code, out, _ = command(
        "export", "Go2", "--for", "pinocchio", "-o", tmp_path / "new"
    )
    assert code == 0
    assert "JointModelFreeFlyer" in out  # the file has no root
    model = pin.buildModelFromUrdf(str(tmp_path / "new" / "go2.urdf"))
    assert model.nv == 12
    rooted = ("--for", "pybullet", "--root", "floating", "-o", tmp_path / "free")
    assert command("export", "Go2", *rooted)[0] == 0
    model = pin.buildModelFromUrdf(str(tmp_path / "free" / "go2.urdf"))
    assert model.nv == 18


@pytest.mark.slow
def test_a_folder_of_ones_own_is_seen(command, tmp_path):
    robots = tmp_path / "robots"
    robots.mkdir()
    text = (Catalogue().root / "robots/panda.toml").read_text()
    (robots / "mine.toml").write_text(text.replace('"Panda"', '"Mine"'))
    code, out, _ = command("list", "robots", "--catalogue", tmp_path)
    assert code == 0
    assert "Mine" in out
    assert str(tmp_path) in os.environ[ENVIRONMENT_VARIABLE]


@pytest.mark.slow
def test_render_writes_a_picture_of_the_size_asked_for(command, tmp_path):
    file = tmp_path / "panda.png"
    size = ("--width", 120, "--height", 80)
    assert command("render", "Panda", "-o", file, *size)[0] == 0
    picture = np.asarray(Image.open(file))
    assert picture.shape == (80, 120, 3)
    assert picture.std() > 10


DAMAGES = {
    "typo in a robot": ("robots/panda.toml", "[assembly]", "[asembly]", "assembly"),
    "typo in a component": ("robots/arm/panda.toml", "mass =", "mas =", "'mass'"),
    "typo in a benchmark": ("tasks/lift.toml", "horizon", "horizn", "'horizon'"),
    "typo in a controller": (
        "controllers/gr1_whole_body_ik.toml",
        "locked",
        "lockd",
        "'locked'",
    ),
    "wrong value": ("tasks/lift.toml", "horizon = 500", "horizon = -5", "-5"),
    "not TOML": ("tasks/lift.toml", "horizon = 500", "horizon =", "TOML"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_typo_in_any_file_is_told_in_one_line(command, tmp_path, damage):
    file, old, new, word = DAMAGES[damage]
    text = (Catalogue().root / file).read_text()
    assert old in text
    damaged = tmp_path / Path(file).name
    damaged.write_text(text.replace(old, new, 1))
    code, out, err = command("check", damaged)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert damaged.name in err
    assert word in err


@pytest.mark.slow
def test_describe_action_shows_every_slice_with_its_unit(command):
    code, out, _ = command("describe-action", "Panda")
    assert code == 0
    words = ["BASIC: 7 values", "0:6", "0.05 m 0.5 rad", "hold the present goal"]
    for word in (*words, "right_gripper", "-1 open .. 1 closed", "half closed"):
        assert word in out
    whole = ("--controller", "WHOLE_BODY_IK")
    code, out, _ = command("describe-action", "Panda", *whole)
    assert code == 0
    for word in ("right_hand", "0:6", "m rad", "go to the origin; hold_action holds"):
        assert word in out
    code, out, _ = command("describe-action", "PandaOmron")
    assert code == 0
    for word in ("HYBRID_MOBILE_BASE: 12", "forward", "stands still", "base_mode"):
        assert word in out


def test_a_json_controller_is_checked_against_its_robot(command, tmp_path):
    file = tmp_path / "mine.json"
    file.write_text('{"type": "OSC_POSE", "kp": 100}')
    code, out, _ = command("check", file, "--robot", "Baxter")
    assert code == 0
    assert "BASIC of right: UNCOUPLED_OSC_POSE, left: UNCOUPLED_OSC_POSE" in out
    code, _, err = command("check", file)
    assert code == 2
    assert "name the robot" in err
    file.write_text('{"type": "OSC_POSE", "kpp": 100}')
    code, _, err = command("check", file, "--robot", "Baxter")
    assert code == 2
    assert "Did you mean 'kp'" in err


def test_the_list_names_part_controllers_and_what_files_control(command):
    _, out, _ = command("list", "controllers")
    for word in ("HYBRID_MOBILE_BASE", "JOINT_TORQUE", "STANCE", "right_hand"):
        assert word in out
    assert "pandaomron_basic" in out


@pytest.mark.slow
def test_grippers_and_bases_are_chosen_on_the_command_line(command, tmp_path):
    parts = ("--gripper", "right=InspireRightHand, left=none", "--base", "NullMount")
    code, out, _ = command("describe-action", "Baxter", *parts)
    assert code == 0
    assert "right_gripper" in out
    assert "left_gripper" not in out
    file = tmp_path / "baxter.toml"
    code, *_ = command("export", "Baxter", "--to", "toml", "-o", file, *parts)
    assert code == 0
    robot = load_robot(file)
    assert list(robot.synergies) == ["right_gripper"]
    assert "pedestal" not in [link.name for link in robot.links]


@pytest.mark.slow
@pytest.mark.parametrize("controller", ["WHOLE_BODY_IK", "WHOLE_BODY_MINK_IK"])
def test_the_demo_tracks_and_writes_its_pictures(command, tmp_path, controller):
    arguments = ("--figures", 1, "-o", tmp_path, "--controller", controller)
    code, out, _ = command("demo", *arguments)
    assert code == 0
    worst = [float(x) for x in re.findall(r"([\d.]+) mm \(worst\)", out)]
    resting = [float(x) for x in re.findall(r"at rest ([\d.]+) mm", out)]
    assert max(worst) < 30.0  # mm: a twelfth of a second behind, at up to 0.4 m/s
    assert max(resting) < 0.1
    assert len(worst) == len(resting) == 2
    film = Image.open(tmp_path / "reach.gif")
    assert film.n_frames == 50
    first, later = (np.asarray(_frame(film, k), dtype=float) for k in (0, 10))
    assert np.abs(first - later).max() > 100  # something moved


@pytest.mark.slow
def test_hands_of_a_robot_on_its_feet_move_through_half_of_the_figure(monkeypatch):
    seen: list[dict[str, float]] = []
    monkeypatch.setattr("wbc_suite.cli.demo._reach", lambda _e, s, _t: seen.append(s))
    for name in ("GR1", "GR1FreeBody"):
        with pytest.raises(TypeError, match="NoneType"):  # there is nothing to report
            demo(name)
    fixed, free = seen
    assert {round(2.0 * free[name] / fixed[name], 9) for name in fixed} == {1.0}


def _frame(film: Image.Image, number: int) -> Image.Image:
    film.seek(number)
    return film.convert("RGB")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["check", "nowhere/robot.toml"], ["nowhere/robot.toml", "No such file"]),
        (["export", "Pandda", "--to", "mjcf"], ["Pandda", "Did you mean 'Panda'"]),
        (
            ["render", "PandaGripper", "-o", "a.png"],
            ["No robot named", "Did you mean 'gripper/PandaGripper'"],
        ),
        (
            ["export", "Baxter", "--to", "urdf", "--gripper", "rigth=PandaGripper"],
            ["rigth", "Did you mean 'right'"],
        ),
        (["export", "Panda", "--to", "toml", "--root", "none"], ["--root", "URDF"]),
        (["list", "--catalogue", "nowhere"], ["nowhere", "does not exist"]),
        (["render", "Panda", "-o", "nowhere/a.png"], ["nowhere/a.png", "written"]),
        (["render", "Panda", "-o", "a.nonsense"], ["a.nonsense", "written"]),
        (
            ["render", "Panda", "-o", "a.png", "--keyframe", "redy"],
            ["redy", "Did you mean 'ready'"],
        ),
    ],
)
def test_a_mistake_gets_one_line_and_exit_code_2(command, arguments, words):
    code, out, err = command(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith("wbc-suite: ")
    assert err.count("\n") == 1
    for word in words:
        assert word in err


@pytest.mark.slow
def test_bench_times_steps_beside_raw_physics(command, tmp_path):
    file = tmp_path / "bench.json"
    code, out, _ = command(
        *("bench", "Lift", "--actions", 10, "--camera", "agentview"),
        *("--size", 32, "--json", file),
    )
    assert code == 0
    times = json.loads(file.read_text("utf-8"))["us"]
    assert len(times["step"]) == 10
    assert len(times["raw physics, 25 steps of it"]) == 10
    assert min(min(found) for found in times.values()) > 0.0
    for name in times:
        assert name in out
    ratio = np.median(times["step"]) / np.median(times["raw physics, 25 steps of it"])
    assert f"{ratio:.2f} times as long as its raw physics" in out


@pytest.mark.parametrize("given", [["Panda", "UR5e"], ["Panda,UR5e"], ["Panda , UR5e"]])
def test_robots_are_repeated_or_have_commas(given):
    assert robot_names(given) == ["Panda", "UR5e"]
