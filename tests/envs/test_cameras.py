"""Cameras of an environment: what is observed, and what is shown."""

import copy
import gc
from urllib.error import URLError
from urllib.request import urlopen

import gymnasium
import mujoco
import numpy as np
import pytest

import wbc_suite
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.randomisation import Randomisation
from wbc_suite.sensing.renderer import Renderer

SEEN = {
    "use_camera_obs": True,
    "camera_names": ["agentview", "robot0_eye_in_hand"],
    "camera_heights": [40, 24],
    "camera_widths": 32,
    "camera_depths": [True, False],
    "camera_segmentations": ["instance", ["class", "element"]],
}


@pytest.fixture(scope="module")
def env():
    env = wbc_suite.make("Lift", robots="Panda", **SEEN)
    yield env
    env.close()


@pytest.mark.slow
def test_observations_are_what_the_space_says(env):
    observation, _ = env.reset(seed=0)
    assert env.observation_space.contains(observation)
    shapes = {
        k: (v.shape, v.dtype) for k, v in observation.items() if k in env.cameras.space
    }
    assert shapes == {
        "agentview_image": ((40, 32, 3), np.uint8),
        "agentview_depth": ((40, 32, 1), np.float32),
        "agentview_segmentation": ((40, 32, 1), np.int32),
        "robot0_eye_in_hand_image": ((24, 32, 3), np.uint8),
        "robot0_eye_in_hand_segmentation_class": ((24, 32, 1), np.int32),
        "robot0_eye_in_hand_segmentation_element": ((24, 32, 1), np.int32),
    }
    again = env.step(env.hold_action)[0]
    assert env.observation_space.contains(again)
    assert again["agentview_image"] is not observation["agentview_image"]


def test_the_cube_is_seen_where_it_is(env):
    observation, _ = env.reset(seed=3)
    for _ in range(3):
        observation, *_ = env.step(env.hold_action)
    cube, view = observation["cube_pos"], {"width": 32, "height": 40}
    (u, v), depth = env.cameras.projection("agentview", **view).to_pixels(cube)
    names = env.cameras.labels.names["instance"]
    place = observation["agentview_segmentation"][round(v), round(u), 0]
    assert names[place] == "cube"
    seen = observation["agentview_depth"][round(v), round(u), 0]
    assert depth - 0.04 < seen < depth
    red = observation["agentview_image"][round(v), round(u)].astype(int)
    assert red[0] > 1.5 * red[1]


@pytest.mark.slow
def test_segmentation_tells_robots_grippers_furniture_and_objects_apart(env):
    observation, _ = env.reset(seed=0)
    names = env.cameras.labels.names
    assert set(names["instance"].values()) == {
        "world",
        "table",
        "cube",
        "robot0",
        "robot0_right_gripper",
    }
    assert {"Panda", "gripper"} <= set(names["class"].values())
    seen = np.unique(observation["robot0_eye_in_hand_segmentation_class"])
    assert {"gripper", "table"} <= {names["class"][i] for i in seen if i}
    elements = np.unique(observation["robot0_eye_in_hand_segmentation_element"])
    assert all(
        "finger" in names["element"][i]
        or "hand" in names["element"][i]
        or names["element"][i] in ("table", "cube", "floor")
        for i in elements
    )


@pytest.mark.slow
def test_pictures_move_with_the_robot_and_not_behind_it():
    env = wbc_suite.make("Lift", robots="Panda", **SEEN | {"camera_depths": False})
    env.reset(seed=0)
    model, data = env.simulation.model, env.simulation.data
    action = env.hold_action
    action[2] += 0.5
    for _ in range(3):
        env.step(action)
    camera = model.camera("robot0_right_eye_in_hand").id
    env.observation()
    shown = data.cam_xpos[camera].copy()

    mujoco.mj_forward(model, data)
    np.testing.assert_array_equal(shown, data.cam_xpos[camera])
    env.close()


def test_drawing_changes_no_state(env):
    blind = wbc_suite.make("Lift", robots="Panda")
    states = []
    for one in (env, blind):
        one.reset(seed=4)
        one.action_space.seed(0)
        for _ in range(10):
            one.step(one.action_space.sample())
        data = one.simulation.data
        states.append(np.concatenate([data.qpos, data.qvel, data.qacc_warmstart]))
    np.testing.assert_array_equal(*states)


@pytest.mark.slow
def test_a_copy_sees_the_same(env):
    env.reset(seed=2)
    env.step(env.hold_action)
    twin = copy.deepcopy(env)
    for key, value in env.observation().items():
        np.testing.assert_array_equal(twin.observation()[key], value)
    twin.close()


def test_physics_that_fails_is_seen_black(env):
    env.reset(seed=0)
    env.simulation.data.qvel[3] = 1e12
    observation, *_ = env.step(env.hold_action)
    assert env.observation_space.contains(observation)
    assert not observation["agentview_image"].any()


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_vectors_draw_what_each_sees_alone(mode):
    few = {k: v for k, v in SEEN.items() if "seg" not in k and "depths" not in k}
    few["randomisation"] = Randomisation(texture=True)  # drawn by another thread
    envs = gymnasium.make_vec(
        "wbc_suite/Lift-v1",
        num_envs=2,
        vectorization_mode="vector_entry_point",
        autoreset_mode=mode,
        threads=2,
        robots="Panda",
        horizon=2,
        **few,
    )
    alone = wbc_suite.make("Lift", robots="Panda", horizon=2, **few)
    seen, _ = envs.reset(seed=7)
    assert envs.observation_space.contains(seen)
    expected, _ = alone.reset(seed=8)
    np.testing.assert_array_equal(
        seen["agentview_image"][1], expected["agentview_image"]
    )
    action = np.stack([env.hold_action for env in envs.envs])
    for _ in range(2):
        seen, *_, info = envs.step(action)
        expected, *_ = alone.step(action[1])
    if mode == "SameStep":
        following, _ = alone.reset()
        for key in seen:
            np.testing.assert_array_equal(seen[key][1], following[key])
        seen = info["final_obs"][1]
    else:
        seen = {key: value[1] for key, value in seen.items()}
    for key in expected:
        np.testing.assert_array_equal(seen[key], expected[key])
    envs.close()
    alone.close()


@pytest.mark.slow
def test_render_modes_give_what_they_are_called():
    for mode, shape, kind in (
        ("rgb_array", (24, 32, 3), np.uint8),
        ("depth_array", (24, 32), np.float32),
    ):
        env = wbc_suite.make(
            "Lift", robots="Panda", render_mode=mode, render_size=(32, 24)
        )
        env.reset(seed=0)
        picture = env.render()
        env.close()
        assert (picture.shape, picture.dtype) == (shape, kind)
    assert 0.3 < picture.min() < picture.max() <= env.cameras.far


@pytest.mark.slow
def test_people_watch_a_page_that_follows_and_goes_when_closed(caplog):

    env = wbc_suite.make("Lift", robots="Panda", render_mode="human")
    env.reset(seed=0)
    env.step(env.hold_action)
    assert env.render() is None
    url = caplog.text.partition("View the scene at ")[2].split()[0]
    with urlopen(url) as page:
        assert page.status == 200
    env.close()
    with pytest.raises(URLError):
        urlopen(url)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"camera_heights": [9]}, "camera_heights has 1 entries for 2 camera"),
        ({"camera_names": ["agentview"] * 2}, "a camera twice"),
        ({"camera_segmentations": "instances"}, "'element', 'instance' or 'class'"),
        ({"camera_widths": 0}, "greater than 0"),
    ],
)
def test_wrong_arguments_say_what_is_legal(wrong, message):
    with pytest.raises(ConfigError, match=message):
        wbc_suite.make("Lift", **SEEN | wrong)


def test_an_unknown_camera_is_named():
    with pytest.raises(UnknownNameError, match="Did you mean 'agentview'"):
        wbc_suite.make("Lift", use_camera_obs=True, camera_names="agentviw")


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["Panda", "GR1", "SpotWithArm", "Tiago", "Baxter"])
def test_a_robots_own_view_shows_the_robot_and_the_table(robot):
    env = wbc_suite.make("Lift", robots=robot)
    env.reset(seed=0)
    seen = env.cameras.segmentation(
        "robot0_robotview", width=64, height=64, level="instance"
    )
    shares = {
        name: np.mean(seen == i)
        for i, name in env.cameras.labels.names["instance"].items()
    }
    env.close()
    assert shares["robot0"] > 0.02
    assert shares["table"] > 0.01


@pytest.mark.slow
def test_a_closed_renderer_is_gone_without_the_collector():
    def alive():
        return [x for x in gc.get_objects() if type(x) is Renderer]

    gc.collect()
    before = len(alive())
    gc.disable()
    try:
        env = wbc_suite.make("Lift", render_mode="rgb_array", render_size=(32, 32))
        env.reset(seed=0)
        env.render()
        assert len(alive()) == before + 1
        env.close()
        del env
        assert len(alive()) == before
    finally:
        gc.enable()


@pytest.mark.slow
def test_pictures_are_changed_as_other_observations_are():
    crop = {"crop": (20, 24), "delay": 0.1, "dropout": 0.0}
    env = wbc_suite.make(
        "Lift",
        robots="Panda",
        **SEEN,
        observables={
            "agentview_image": crop,
            "agentview_depth": {"active": False},
        },
    )
    first, _ = env.reset(seed=0)
    assert env.observation_space.contains(first)
    assert first["agentview_image"].shape == (20, 24, 3)
    assert "agentview_depth" not in first
    action = env.hold_action
    action[:3] = 1.0
    for _ in range(2):
        late = env.step(action)[0]["agentview_image"]
        np.testing.assert_array_equal(late, first["agentview_image"])
    kept = copy.deepcopy(env)
    moved = [one.step(action)[0]["agentview_image"] for one in (env, kept)]
    np.testing.assert_array_equal(*moved)
    assert np.abs(moved[0].astype(int) - first["agentview_image"]).max() > 20
    env.observables.modify("agentview_image", crop=None, delay=0.0)
    assert env.observation()["agentview_image"].shape == (40, 32, 3)
    with pytest.raises(ConfigError, match="crop"):
        env.observables.modify("agentview_image", crop=(50, 20))
    with pytest.raises(UnknownNameError, match="agentview_picture"):
        env.observables.modify("agentview_picture", delay=0.1)
    env.close()
