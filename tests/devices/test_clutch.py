import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.devices import Clutch


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def random_pose(rng):
    return pin.SE3(
        pin.Quaternion(rng.normal(size=4)).normalized().toRotationMatrix(),
        rng.uniform(-1, 1, 3),
    )


def test_target_stays_put_at_every_engage(rng):
    pin.seed(0)
    clutch = Clutch(random_pose(rng))
    for _ in range(200):
        before = clutch.target
        T_input = random_pose(rng)  # anywhere: up to metres from the target
        clutch.engage(T_input)
        clutch.move(T_input)
        jump = np.linalg.norm(clutch.target.translation - before.translation)
        turn = np.linalg.norm(pin.log3(before.rotation.T @ clutch.target.rotation))
        assert jump < 1e-12
        assert turn < 1e-7  # log3 loses digits near zero
        clutch.move(random_pose(rng))
        clutch.release()


def test_target_repeats_the_motion_of_the_input_in_world_axes(rng):
    T_target, T_input = random_pose(rng), random_pose(rng)
    clutch = Clutch(T_target)
    clutch.engage(T_input)
    step, turn = rng.normal(size=3), pin.exp3(rng.normal(size=3))
    clutch.move(pin.SE3(turn @ T_input.rotation, T_input.translation + step))
    np.testing.assert_allclose(
        clutch.target.translation, T_target.translation + step, atol=1e-14
    )
    np.testing.assert_allclose(
        clutch.target.rotation, turn @ T_target.rotation, atol=1e-14
    )


def test_released_clutch_ignores_the_input(rng):
    T_target = random_pose(rng)
    clutch = Clutch(T_target)
    clutch.engage(random_pose(rng))
    clutch.release()
    clutch.move(random_pose(rng))
    assert not clutch.engaged
    assert clutch.target == T_target


def test_placed_target_lets_go_of_the_input(rng):
    clutch = Clutch(random_pose(rng))
    clutch.engage(random_pose(rng))
    T_target = random_pose(rng)
    clutch.place(T_target)
    clutch.move(random_pose(rng))
    assert clutch.target == T_target
