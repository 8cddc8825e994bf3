"""Wheels of imported robots: found by geometry, and how they drive."""

from pathlib import Path

import numpy as np
import pytest

from tests.robot import wheeled_urdfs as urdfs
from wbc_suite import load_robot
from wbc_suite.envs.drive_check import drive_check
from wbc_suite.envs.hold_check import alone
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.wheel_drive import DriveKind, WheelDrive

KINDS = {
    "differential": (urdfs.differential(), DriveKind.DIFFERENTIAL, 0.4),
    "axle ahead of the frame": (urdfs.differential(0.1), DriveKind.DIFFERENTIAL, 0.4),
    "skid": (urdfs.four("cart"), DriveKind.SKID, 0.5),
    "mecanum": (urdfs.four("mecanum_cart"), DriveKind.MECANUM, 0.5),
    "omni of 3": (urdfs.omni(3), DriveKind.OMNI, 0.4),
    "omni of 4": (urdfs.omni(4), DriveKind.OMNI, 0.4),
    "car": (urdfs.car(), DriveKind.CAR, 0.4),
}


def _loaded(text: str, folder: Path, **options) -> RobotDescription:
    file = folder / "robot.urdf"
    file.write_text(text)
    return load_robot(file, **options)


@pytest.mark.parametrize("name", KINDS)
def test_wheels_and_their_drive_are_found(name: str, tmp_path: Path) -> None:
    text, kind, track = KINDS[name]
    robot = _loaded(text, tmp_path)
    drive = WheelDrive(robot)
    assert drive.kind is kind
    assert drive.radius == pytest.approx(0.08, abs=1e-3)
    assert drive.track == pytest.approx(track, abs=1e-3)
    assert robot.root.kind == "planar"
    holonomic = kind in (DriveKind.MECANUM, DriveKind.OMNI)
    assert (robot.root.drive == "holonomic") is holonomic
    assert [*robot.groups] == ["wheels"]


def test_the_name_of_a_mesh_tells_mecanum_wheels(tmp_path: Path) -> None:
    mesh = '<visual><geometry><mesh filename="mecanum_a.stl"/></geometry></visual>'
    head = '<link name="fl">'
    robot = _loaded(urdfs.four("cart").replace(head, head + mesh), tmp_path)
    assert WheelDrive(robot).kind is DriveKind.MECANUM


@pytest.mark.parametrize("name", urdfs.NO_WHEELS)
def test_what_only_turns_is_no_wheel(name: str, tmp_path: Path) -> None:
    robot = _loaded(urdfs.NO_WHEELS[name], tmp_path)
    assert not robot.wheels
    assert robot.root.kind != "planar"


def test_the_first_link_is_where_a_differential_drive_turns(tmp_path: Path) -> None:
    robot = _loaded(urdfs.differential(0.1), tmp_path)
    places = WheelDrive(robot).places
    np.testing.assert_allclose(places.mean(axis=0), 0.0, atol=1e-6)
    assert robot.links[1].name == "base"


def test_wheels_of_casters_are_passive(tmp_path: Path) -> None:
    robot = _loaded(urdfs.differential(), tmp_path)
    passive = {joint.name for joint in robot.joints if joint.passive}
    ends = ("front_swivel", "front_roll_j", "back_swivel", "back_roll_j")
    assert passive == set(ends)


def test_speeds_of_wheels_are_those_of_textbooks(tmp_path: Path) -> None:
    # Siegwart, Introduction to Autonomous Mobile Robots, 3.2; the mecanum wheels are
    # those of Taheri, Qiao, Ghaeminezhad (2015), eq. 20.
    twist = np.array([0.3, 0.1, 0.5])
    none = np.zeros(0)
    drive = WheelDrive(_loaded(urdfs.differential(), tmp_path))
    expected = (0.3 + np.array([-1, 1]) * 0.5 * 0.2) / 0.08
    np.testing.assert_allclose(drive.speeds(twist, none), expected, atol=1e-3)
    drive = WheelDrive(_loaded(urdfs.four("mecanum"), tmp_path))
    side, reach = np.array([-1, 1, 1, -1]), np.array([-1, 1, -1, 1]) * 0.45
    expected = (0.3 + side * 0.1 + reach * 0.5) / 0.08
    np.testing.assert_allclose(drive.speeds(twist, none), expected, atol=1e-3)
    drive = WheelDrive(_loaded(urdfs.omni(3), tmp_path))
    angles = 2.0 * np.pi * np.arange(3) / 3.0
    along = np.sin(angles) * 0.3 - np.cos(angles) * 0.1 - 0.2 * 0.5
    np.testing.assert_allclose(drive.speeds(twist, none), along / 0.08, atol=1e-3)


def test_wheels_of_a_car_roll_about_one_centre(tmp_path: Path) -> None:
    drive = WheelDrive(_loaded(urdfs.car(), tmp_path))
    twist = drive.feasible(np.array([0.3, 0.2, 0.25]))
    assert twist.tolist() == [0.3, 0.0, 0.25]
    angles = drive.steered(twist, np.zeros(2))
    centre = 0.3 / 0.25
    expected = [np.arctan2(0.4, centre - y) for y in (0.2, -0.2)]
    np.testing.assert_allclose(angles, expected, atol=1e-6)
    speeds = dict(
        zip((w.joint for w in drive.wheels), drive.speeds(twist, angles), strict=True)
    )
    for name, y in (("left", 0.2), ("right", -0.2)):
        away = np.hypot(0.4, centre - y)
        assert speeds[f"front_{name}_joint"] == pytest.approx(
            0.25 * away / 0.08, rel=1e-3
        )
        rear = 0.25 * (centre - y) / 0.08
        assert speeds[f"rear_{name}_joint"] == pytest.approx(rear, rel=1e-3)
    tight = drive.feasible(np.array([0.3, 0.0, 5.0]))
    inner = drive.steered(tight, np.zeros(2))
    assert np.abs(inner).max() == pytest.approx(0.6, abs=1e-3)


def test_wheels_of_legs_are_no_joints_of_legs(tmp_path: Path) -> None:
    robot = _loaded(urdfs.quadruped(), tmp_path)
    assert robot.root.kind == "free"
    assert {name: len(own) for name, own in robot.groups.items()} == {
        "legs": 12,
        "wheels": 4,
    }


@pytest.mark.slow
@pytest.mark.parametrize("root", ["planar", "free"])
@pytest.mark.parametrize("name", [*KINDS, "legs"])
def test_a_base_drives_2_m_and_turns(name: str, root: str, tmp_path: Path) -> None:
    text = urdfs.quadruped() if name == "legs" else KINDS[name][0]
    robot = _loaded(text, tmp_path, root=root)
    driven = drive_check(robot)
    assert driven.arrived, driven


@pytest.mark.slow
@pytest.mark.parametrize("name", ["omni of 3", "mecanum"])
def test_rollers_carry_a_base_sideways(name: str, tmp_path: Path) -> None:
    robot = _loaded(KINDS[name][0], tmp_path, root="free")
    part = {"type": "BASE_VELOCITY", "input_type": "absolute"}
    config = {"format": 1, "type": "BASIC", "body_parts": {"base": part}}
    env = alone(robot, controller_configs=config, control_freq=20)
    env.reset(seed=0)
    for _ in range(60):
        env.step(np.array([0.0, 0.2, 0.0]))
    pose = env.simulation.robots[0].root_pose
    env.close()
    # 3 s at 0.2 m/s, less half of the ramp of 0.2 s; wheels creep by 2 to 3 %
    np.testing.assert_allclose(pose.translation[:2], (0.0, 0.58), atol=0.04)
    assert np.arctan2(pose.rotation[1, 0], pose.rotation[0, 0]) == pytest.approx(
        0.0, abs=0.05
    )
