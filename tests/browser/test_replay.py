"""The replay page in a real browser: buttons, slider and keys control the playback."""

import time

import pytest
from conftest import PATIENCE, TRIES, Viewer, wait_until

import wbc_suite
from wbc_suite.evaluation import make_policy
from wbc_suite.recording import Dataset, rebuild
from wbc_suite.viewers.episode_player import open_player
from wbc_suite.viewers.page_server import PageServer
from wbc_suite.viewers.replay_page import ReplayPage
from wbc_suite.wrappers import DataCollection

pytestmark = [pytest.mark.browser, pytest.mark.slow]


@pytest.fixture
def replayed(tmp_path):
    """The page of two episodes of Lift."""
    path = tmp_path / "lift.hdf5"
    made = wbc_suite.make("Lift", robots="Panda", horizon=70, terminate_on_success=True)
    env = DataCollection(made, path)
    for seed in range(2):
        driver = make_policy("expert", made, seed)
        seen, _ = env.reset(seed=seed)
        over = False
        while not over:
            seen, _, terminated, truncated, _ = env.step(driver(seen))
            over = terminated or truncated
    env.close()
    with Dataset(path) as dataset:
        again = rebuild(dataset)
        player = open_player(dataset, dataset.names, again, by_states=False)
        page = ReplayPage(player, again, PageServer(port=0), label="Replay · lift.hdf5")
        page.start()
        yield page
        page.site.stop()
        again.close()


def settled(player):
    """Wait until no message of a slow browser winds the player any more."""
    before = None
    while (status := player.status) != before:
        before = status
        time.sleep(1.0)
    return status


def wind(viewer, player):
    """Click into the slider; again where it was missed, as a person does."""
    for _ in range(TRIES):
        viewer.draw()
        handle = viewer.page.get_by_role("slider").first
        box = handle.locator("xpath=../..").bounding_box()
        y = box["y"] + box["height"] / 2
        viewer.page.mouse.click(box["x"] + 0.75 * box["width"], y)
        deadline = time.monotonic() + PATIENCE / TRIES
        while time.monotonic() < deadline:
            if player.status.position > 0.5:
                return
            time.sleep(0.02)
    raise AssertionError("the slider does not wind the player")


def test_a_person_plays_pauses_seeks_and_changes_the_episode(context, replayed):
    player = replayed.player
    viewer = Viewer(context, replayed.site, size=(1100, 700), dots=1.0)
    viewer.page.get_by_text("bit for bit as recorded").wait_for()
    viewer.page.get_by_role("button", name="Pause").click()
    wait_until(lambda: not player.status.playing, "the player pauses")

    player.seek(0.0)
    viewer.page.get_by_text("step 0 of").wait_for()
    wind(viewer, player)
    status = settled(player)
    assert 0.5 < status.position / status.clip.length < 0.95
    qpos = replayed._env.simulation.data.qpos
    wait_until(
        lambda: (qpos == status.clip.states[status.frame][1 : 1 + len(qpos)]).all(),
        "the scene shows that state",
    )
    viewer.page.get_by_text(f"step {status.frame} of").wait_for()
    viewer.screenshot("replay_lift")

    status = settled(player)
    viewer.page.keyboard.press("j")
    wait_until(lambda: player.status.frame == status.frame - 1, "J goes a step back")
    viewer.page.keyboard.press("n")
    wait_until(
        lambda: player.status.clip.name == "demo_1", "N goes to the next episode"
    )
    viewer.page.get_by_text("2 of 2").wait_for()
    viewer.page.get_by_role("button", name="4", exact=True).click()
    viewer.page.get_by_role("button", name="Play").click()
    wait_until(lambda: player.status.clip.name == "demo_0", "after the last, the first")
    assert all(url.startswith(("http://127.0.0.1", "ws://127.0.0.1", "data:", "blob:"))
               for url in viewer.requests)  # fmt: skip
