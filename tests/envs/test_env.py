import copy
import pickle
import re
import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import wbc_suite
from wbc_suite.errors import ActionError, ConfigError, PhysicsError, UnknownNameError
from wbc_suite.robot import load_robot
from wbc_suite.scene.placement import Region, UniformSampler


@pytest.fixture(scope="module")
def env():
    return wbc_suite.make("Lift", robots="Panda", controller_configs="WHOLE_BODY_IK")


def state_of(env):
    data = env.unwrapped.simulation.data
    return np.concatenate([[data.time], data.qpos, data.qvel, data.act])


def test_the_hand_goes_where_the_action_says(env):
    env.reset(seed=0)
    layout = env.action_layout
    target = layout.unpack(env.hold_action)["right_hand"]
    target[:3] += 0.05, -0.05, 0.05
    action = layout.pack({"right_hand": target}, base=env.hold_action)
    for _ in range(30):
        observation, _, _, _, info = env.step(action)
    error = np.linalg.norm(observation["robot0_eef_pos"] - target[:3])
    assert error < 1e-3
    assert info["ik"]["frames"]["right_hand"]["position_error"] == pytest.approx(
        error, abs=1e-4
    )


def test_same_seed_and_actions_give_bit_equal_states(env):
    trajectories = []
    for _ in range(2):
        env.reset(seed=5)
        action = env.hold_action
        action[0] += 0.1
        states = []
        for _ in range(20):
            env.step(action)
            states.append(state_of(env))
        trajectories.append(np.array(states))
        env.reset(seed=99)
    np.testing.assert_array_equal(trajectories[0], trajectories[1])


def test_seeds_place_the_cube(env):
    first, _ = env.reset(seed=1)
    again, _ = env.reset(seed=1)
    other, _ = env.reset(seed=2)
    np.testing.assert_array_equal(first["cube_pos"], again["cube_pos"])
    assert np.abs(first["cube_pos"] - other["cube_pos"]).max() > 1e-4
    assert np.abs(first["cube_pos"][:2]).max() <= 0.03


def test_a_bad_action_changes_nothing(env):
    env.reset(seed=3)
    action = env.hold_action
    env.step(action)
    before = state_of(env)
    bad = action.copy()
    bad[2] = np.nan
    with pytest.raises(ActionError, match=r"index 2 \(right_hand: z\)"):
        env.step(bad)
    with pytest.raises(ActionError, match="shape"):
        env.step(action[:-1])
    np.testing.assert_array_equal(state_of(env), before)
    env.step(action)
    after = state_of(env)
    env.reset(seed=3)
    env.step(action)
    env.step(action)
    np.testing.assert_array_equal(state_of(env), after)


def test_values_out_of_range_are_clipped_and_counted(env):
    env.reset(seed=0)
    action = env.hold_action
    action[env.action_layout["right_gripper"].start] = 7.0
    action[0] = 1e6
    *_, info = env.step(action)
    assert info["clipped"] == 2


def test_physics_that_diverges_ends_the_episode_with_a_name(env):
    env.reset(seed=0)
    action = env.hold_action
    env.step(action)
    env.simulation.data.qvel[3] = 1e12
    observation, reward, terminated, _, info = env.step(action)
    assert terminated
    assert "BADQVEL" in info["physics_error"]
    assert reward == 0.0
    assert all(np.isfinite(value).all() for value in observation.values())
    with pytest.raises(PhysicsError, match="reset"):
        env.step(action)
    env.reset(seed=0)
    *_, info = env.step(action)
    assert "physics_error" not in info


def test_a_controller_that_fails_in_a_broken_state_ends_the_episode(monkeypatch):
    env = wbc_suite.make("Lift", robots="Panda", controller_configs="BASIC").unwrapped
    env.reset(seed=0)

    def fail(state):
        raise np.linalg.LinAlgError("SVD did not converge")

    monkeypatch.setattr(env.controllers[0], "prepare", fail)
    *_, terminated, _, info = env.step(env.hold_action)
    assert terminated
    assert "SVD did not converge" in info["physics_error"]


@pytest.mark.slow
def test_a_robot_measured_from_its_pelvis_is_lifted_out_of_the_floor(caplog):
    own = load_robot("gr1_fixed_lower_body")
    robot = own.with_root("fixed", pos=(0.0, 0.0, 0.0))
    env = wbc_suite.make("Lift", robots=robot)
    told = r"GR1FixedLowerBody has its lowest point 0\.\d+ m below the floor"
    assert re.search(told, caplog.text)
    lifted = env.robots[0].root.pos[2]
    assert 0.85 < lifted <= own.root.pos[2] + 0.01
    env.reset(seed=0)
    deepest = env.simulation.data.contact.dist.min(initial=0.0)
    assert deepest > -1e-3
    arm = load_robot("UR5e", base="NullMount")
    assert wbc_suite.make("Lift", robots=arm).robots[0].root.pos[2] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("noise", [{"type": "uniform", "magnitude": 0.5}, "default"])
def test_noise_moves_arms_and_nothing_else_and_stays_within_ranges(noise):
    quiet = wbc_suite.make("Lift", robots="Tiago", initialization_noise=None)
    noisy = wbc_suite.make("Lift", robots="Tiago", initialization_noise=noise)
    robot, model = noisy.robots[0], noisy.simulation.model
    arms = {j for g in robot.groups if g.endswith("arm") for j in robot.groups[g]}
    for seed in range(3):
        noisy.reset(seed=seed)
        quiet.reset(seed=seed)
        for joint in robot.joint_names:
            place = model.joint(f"robot0_{joint}").qposadr[0]
            value = noisy.simulation.data.qpos[place]
            moved = value != quiet.simulation.data.qpos[place]
            assert moved == (joint in arms), joint
            low, high = robot.joint(joint).range or (-np.inf, np.inf)
            assert low <= value <= high


def test_a_robot_without_hands_is_rewarded_for_nothing():
    env = wbc_suite.make("Lift", robots="Spot", reward_shaping=True)
    env.reset(seed=0)
    assert env.step(env.hold_action)[1] == 0.0


def test_no_log_file_is_left_behind(env, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    env.reset(seed=0)
    env.simulation.data.qvel[0] = 1e12
    env.step(env.hold_action)
    env.reset(seed=0)
    env.simulation.data.qvel[0] = np.nan
    *_, info = env.step(env.hold_action)
    assert "QVEL" in info["physics_error"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))]
)
def test_copies_go_on_from_where_the_original_stands(env, copied):
    env.reset(seed=8)
    action = env.hold_action
    action[0] += 0.1
    for _ in range(3):
        env.step(action)
    twin = copied(env)
    np.testing.assert_array_equal(state_of(twin), state_of(env))
    for one in (env, twin):
        for _ in range(5):
            one.step(action)
    np.testing.assert_array_equal(state_of(twin), state_of(env))
    first, _ = env.reset()
    second, _ = twin.reset()
    np.testing.assert_array_equal(first["cube_pos"], second["cube_pos"])


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["GR1", "Tiago", "SpotWithArm"])
def test_every_robot_stands_at_the_table_and_holds(robot):
    env = wbc_suite.make("Lift", robots=robot, controller_configs="WHOLE_BODY_IK")
    env.reset(seed=0)
    for _ in range(16):
        observation, reward, *_, info = env.step(env.hold_action)
    assert env.observation_space.contains(observation)
    assert info["ik"]["frames"]["right_hand"]["reached"]
    assert reward == 0.0
    cube = env.simulation.data.joint("cube_joint")
    assert np.abs(cube.qvel).max() < 0.01


@pytest.mark.slow
def test_pictures_show_the_scene():
    env = wbc_suite.make(
        "Lift", robots="Panda", render_mode="rgb_array", render_size=(96, 64)
    )
    env.reset(seed=0)
    picture = env.render()
    env.close()
    assert picture.shape == (64, 96, 3)
    assert picture.std() > 10.0


def test_the_horizon_truncates():
    env = wbc_suite.make("Lift", robots="Panda", horizon=3)
    env.reset(seed=0)
    flags = [env.step(env.hold_action)[2:4] for _ in range(3)]
    assert flags == [(False, False), (False, False), (False, True)]


def test_reward_and_info_ask_for_success_once(env, monkeypatch):
    env.reset(seed=0)
    answers = [True, False]
    monkeypatch.setattr(env.benchmark, "success", answers.pop)
    for _ in range(2):
        _, reward, _, _, info = env.step(env.hold_action)
        assert reward == float(info["success"])
    assert answers == []


def test_users_own_samplers_place_the_things():
    region = Region(x=(0.1, 0.1), y=(0.2, 0.2), yaw=(0.0, 0.0))
    sampler = UniformSampler(names=["cube"], region=region, origin=(0.0, 0.0, 0.8))
    with wbc_suite.make("Lift", placement_initializer=sampler) as env:
        seen, _ = env.reset(seed=1)
        other, _ = env.reset(seed=2)
        np.testing.assert_allclose(seen["cube_pos"][:2], [0.1, 0.2], atol=1e-9)
        np.testing.assert_allclose(other["cube_pos"][:2], [0.1, 0.2], atol=1e-9)
    with pytest.raises(ConfigError, match="method `sample`"):
        wbc_suite.make("Lift", placement_initializer=3)


@pytest.mark.slow
def test_wrong_arguments_say_what_is_legal():
    with pytest.raises(ConfigError, match="Did you mean 'robots'"):
        wbc_suite.make("Lift", robot="Panda")
    with pytest.raises(UnknownNameError, match="Did you mean 'Lift'"):
        wbc_suite.make("Lft")
    with pytest.raises(UnknownNameError, match="Did you mean 'Panda'"):
        wbc_suite.make("Lift", robots="Pandda")
    with pytest.raises(UnknownNameError, match="Did you mean 'WHOLE_BODY_IK'"):
        wbc_suite.make("Lift", controller_configs="WHOLE_BODY_KI")
    with pytest.raises(ConfigError, match="'control_freq' = 0"):
        wbc_suite.make("Lift", control_freq=0)
    with pytest.raises(ConfigError, match="takes one robot"):
        wbc_suite.make("Lift", robots=["Panda", "Panda"])


def test_gymnasium_accepts_the_environment(recwarn):
    env = gymnasium.make("wbc_suite/Lift-v1", robots="Panda")
    check_env(env.unwrapped, skip_render_check=True)
    # Actions are metres and radians here, which Gymnasium would rather see scaled.
    warnings = [str(w.message) for w in recwarn if "normalized space" not in str(w)]
    assert warnings == []


@pytest.mark.parametrize(
    "code",
    [
        "import wbc_suite, gymnasium; s = gymnasium.spec('wbc_suite/Lift-v1')",
        "import gymnasium, wbc_suite; s = gymnasium.spec('wbc_suite/Lift-v1')",
        "import wbc_suite; from gymnasium import spec; s = spec('wbc_suite/Lift-v1')",
        "import wbc_suite, gymnasium.spaces as g; import gymnasium.envs.registration; "
        "s = gymnasium.envs.registration.spec('wbc_suite/Lift-v1')",
        pytest.param(  # Gymnasium's own way to name the module that registers
            "import gymnasium; "
            "s = gymnasium.make('wbc_suite:wbc_suite/Lift-v1', robots='Panda').spec",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_environments_are_registered_in_either_order_of_imports(code):
    code += "; print(s.id)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "wbc_suite/Lift-v1"


def test_importing_the_package_imports_nothing_heavy():
    code = (
        "import sys, wbc_suite; "
        "heavy = ('numpy', 'mujoco', 'gymnasium.core'); "
        "print([m for m in heavy if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_a_state_is_gone_on_from_bit_by_bit(env):
    env.reset(seed=6)
    action = env.hold_action
    action[0] += 0.1
    for _ in range(3):
        env.step(action)
    state = pickle.loads(pickle.dumps(env.get_state()))
    runs = []
    for _ in range(2):
        for _ in range(4):
            env.step(action)
        runs.append(state_of(env))
        after, _ = env.reset()
        runs.append(after["cube_pos"])
        env.reset(seed=77)
        env.step(action)
        env.set_state(state)
    np.testing.assert_array_equal(runs[0], runs[2])
    np.testing.assert_array_equal(runs[1], runs[3])


@pytest.mark.slow
def test_an_episode_can_begin_at_a_recorded_place(env):
    env.reset(seed=1)
    action = env.hold_action
    action[2] += 0.1
    for _ in range(4):
        env.step(action)
    recorded = env.physics_state
    env.reset(seed=2)
    observation = env.reset_to(recorded)
    np.testing.assert_array_equal(env.physics_state, recorded)
    np.testing.assert_array_equal(
        observation["cube_pos"], env.observation()["cube_pos"]
    )
    twin = copy.deepcopy(env)
    for one in (env, twin):
        one.step(one.hold_action)
    np.testing.assert_array_equal(env.physics_state, twin.physics_state)
    with pytest.raises(ConfigError, match="A physics state has shape"):
        env.reset_to(recorded[:-1])


@pytest.mark.parametrize("win", [1, 5, 10])
@pytest.mark.parametrize("terminate", [True, False])
def test_winning_earns_more_than_hovering(monkeypatch, win, terminate):
    env = wbc_suite.make(
        "Stack",
        robots="Panda",
        horizon=10,
        reward_shaping=True,
        reward_scale=2.0,
        terminate_on_success=terminate,
    )
    monkeypatch.setattr(env.benchmark, "progress", lambda: 0.75)
    returns = []
    for first in (win, 100):
        env.reset(seed=0)
        step, over = 0, False
        returns.append(0.0)
        while not over:
            step += 1
            done = step >= first
            monkeypatch.setattr(env.benchmark, "success", lambda done=done: done)
            _, reward, terminated, truncated, _ = env.step(env.hold_action)
            returns[-1] += reward
            over = terminated or truncated
        assert step == (win if terminate and first == win else 10)
    won, hovered = returns
    assert won == pytest.approx(2.0 * (0.75 * (win - 1) + (11 - win)))
    assert won > hovered


def test_a_sparse_reward_pays_once_for_a_success_that_ends_the_episode(monkeypatch):
    env = wbc_suite.make("Stack", robots="Panda", terminate_on_success=True)
    env.reset(seed=0)
    monkeypatch.setattr(env.benchmark, "success", lambda: True)
    assert env.step(env.hold_action)[1] == 1.0
