import logging
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import mujoco
import numpy as np
import pytest

from wbc_suite.control.run.state_checks import LARGEST, is_usable
from wbc_suite.envs.physics_watch import PhysicsWatch
from wbc_suite.errors import PhysicsError

BALL = """<mujoco><option><flag autoreset="disable"/></option><worldbody>
<body><freejoint/><geom size=".1"/></body></worldbody></mujoco>"""


def ball():
    model = mujoco.MjModel.from_xml_string(BALL)
    return model, mujoco.MjData(model)


@pytest.mark.parametrize("name", ["qpos", "qvel", "qfrc_applied", "xfrc_applied"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_numbers_that_are_not_finite_are_named_before_physics(name, value):
    model, data = ball()
    watch = PhysicsWatch(data)
    getattr(data, name).flat[3] = value
    with pytest.raises(PhysicsError, match=f"Not finite: {name}"), watch:
        mujoco.mj_step(model, data)
    assert data.time == 0.0


def test_what_physics_makes_of_good_numbers_is_checked_too():
    data = ball()[1]
    with pytest.raises(PhysicsError, match="Not finite: qvel"), PhysicsWatch(data):
        data.qvel[0] = np.nan


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e12, -1e12])
def test_only_numbers_that_mujoco_takes_are_usable(value):
    assert is_usable(np.array([LARGEST, -LARGEST, 0.0]), LARGEST)
    assert is_usable(np.zeros(0), LARGEST)
    assert not is_usable(np.array([0.0, value, 0.0]), LARGEST)


def test_a_huge_force_on_what_cannot_move_is_named_too():
    model = mujoco.MjModel.from_xml_string(BALL)
    data = mujoco.MjData(model)
    data.xfrc_applied[0, 2] = 1e12  # the world
    with (
        pytest.raises(PhysicsError, match=r"Beyond 1e\+10: xfrc_applied"),
        PhysicsWatch(data),
    ):
        mujoco.mj_step(model, data)
    assert data.time == 0.0


def test_a_warning_is_an_error_once_and_goes_to_the_log(caplog):
    model, data = ball()
    watch = PhysicsWatch(data)

    def step_from_a_bad_speed():
        data.qvel[4] = 1e12
        mujoco.mj_step(model, data)

    with pytest.raises(PhysicsError, match=r"BADQVEL at t = .* \(index 4\)"), watch:
        step_from_a_bad_speed()
    assert "QVEL at DOF 4" in caplog.text
    mujoco.mj_resetData(model, data)
    with watch:
        mujoco.mj_step(model, data)
    assert data.time > 0.0


def test_a_failing_controller_is_named_and_other_errors_pass():
    watch = PhysicsWatch(ball()[1])
    with (
        pytest.raises(PhysicsError, match=r"A controller failed at .*: singular"),
        watch,
    ):
        raise np.linalg.LinAlgError("singular")
    with pytest.raises(ValueError, match="ours"), watch:
        raise ValueError("ours")


def test_threads_leave_no_log_file(tmp_path, monkeypatch, caplog):
    monkeypatch.chdir(tmp_path)
    caplog.set_level(logging.CRITICAL)

    def diverge(_):
        model, data = ball()
        for _ in range(20):
            mujoco.mj_resetData(model, data)
            data.qvel[0] = 1e12
            with pytest.raises(PhysicsError, match="BADQVEL"), PhysicsWatch(data):
                mujoco.mj_step(model, data)
        return True

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(diverge, range(4)))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_handler_of_the_users_stays(tmp_path):
    code = f"""
import mujoco
from wbc_suite.envs.physics_watch import PhysicsWatch
heard = []
mujoco.set_mju_user_warning(heard.append)
model = mujoco.MjModel.from_xml_string({BALL!r})
data = mujoco.MjData(model)
watch = PhysicsWatch(data)
data.qvel[0] = 1e12
mujoco.mj_step(model, data)
print(len(heard))
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path
    )
    assert (done.returncode, done.stdout.strip()) == (0, "1")
