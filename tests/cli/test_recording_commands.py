"""The commands of recordings, as a person types them."""

import shutil

import pytest
from PIL import Image

from wbc_suite.experts import EXPERTS
from wbc_suite.recording import Dataset


@pytest.mark.slow
def test_a_recording_is_made_inspected_and_replayed(command, tmp_path):
    file = tmp_path / "lift.hdf5"
    arguments = ("Lift", "--robots", "Panda", "--horizon", 70, "--out", file)
    code, out, err = command("record", *arguments, "--episodes", 1)
    assert (code, err) == (0, "")
    assert "1 episodes, 1 of them new. 1 of 1 succeeded" in out
    code, out, _ = command(
        "inspect", file, "--columns", "--plots", tmp_path / "p.png",
        "--sheet", tmp_path / "s.png",
    )  # fmt: skip
    assert code == 0
    assert "1 of 1 succeeded" in out
    assert "obs/cube_pos" in out
    with Image.open(tmp_path / "s.png") as sheet:
        assert sheet.size == (6 * 128, 128 + 14)
        colours = sheet.getcolors(100_000)
    assert colours is None or len(colours) > 100
    film = tmp_path / "film.webp"
    code, out, _ = command("replay", file, "--film", film, "--size", 32)
    assert "1 of 1 episodes replay bit for bit" in out
    with Dataset(file) as dataset, Image.open(film) as pictures:
        assert pictures.n_frames > dataset.length("demo_0") // 2  # equal ones are one


def test_a_film_that_cannot_be_written_is_said_before_anything_is_played(
    command, tmp_path
):
    missing = tmp_path / "none.hdf5"
    code, _, err = command("replay", missing, "--film", "film.avi")
    assert code == 2
    assert ".mp4, .webp or .gif" in err


@pytest.mark.slow
def test_a_benchmark_without_an_expert_is_refused(command, tmp_path, monkeypatch):
    monkeypatch.delitem(EXPERTS._items, "reach")
    code, _, err = command(
        "record", "Reach", "--robots", "SpotWithArm", "--out", tmp_path / "a.hdf5"
    )
    assert code == 2
    assert "No expert named 'Reach'" in err


@pytest.mark.slow
def test_the_expert_counts_its_successes(command):
    code, out, err = command("expert", "Lift", "--robots", "UR5e", "--episodes", 2)
    assert (code, err) == (0, "")
    assert "Lift, UR5e: 2 of 2 succeeded" in out


@pytest.mark.slow
def test_random_actions_of_any_robot_are_recorded(command, tmp_path):
    file = tmp_path / "a.hdf5"
    arguments = ("--robots", "UR5e", "--device", "random", "--horizon", 3)
    for _ in range(2):  # the second run adds to the first
        code, out, _ = command("record", "Lift", *arguments, "-o", file, "--episodes=2")
        assert code == 0
    assert "4 episodes" in out
    shutil.rmtree(tmp_path / "a.hdf5.parts", ignore_errors=True)
    assert "4 episodes, 12 actions" in command("inspect", file)[1]


@pytest.mark.slow
def test_few_demonstrations_are_multiplied_on_two_robots(command, tmp_path):
    few, many, other = (tmp_path / f"{name}.hdf5" for name in ("few", "many", "other"))
    code, _, err = command(
        "record", "Lift", "--episodes", 2, "--only-success", "--recoveries", 5,
        "-o", few,
    )  # fmt: skip
    assert (code, err) == (0, "")
    code, out, err = command("multiply", few, "--episodes", 3, "-o", many)
    assert (code, err) == (0, "")
    assert "3 episodes, 3 of them new." in out
    with Dataset(many) as dataset:
        assert all(dataset.facts(name)["success"] for name in dataset.names)
        assert dataset.facts("demo_0")["policy"] == "few.hdf5"
        assert dataset.facts("demo_0")["noise"] == 0.05
    assert "3 of 3 episodes replay bit for bit" in command("replay", many)[1]
    arguments = ("--robots", "UR5e", "--episodes", 1, "-o", other)
    code, out, err = command("multiply", few, *arguments)
    assert (code, err) == (0, "")
    assert "UR5e" in command("inspect", other)[1]


HAND = '''
from wbc_suite.devices import DeviceState, LimbInput


class Hand:
    """Lifts its hand; keeps, discards and takes back what it did."""

    presses = {40: "keep", 60: "discard", 80: "keep", 90: "undo"}
    presses |= {110: "keep", 130: "keep"}

    def __init__(self, speed):
        self.twist, self.reads = [0.0, 0.0, speed, 0.0, 0.0, 0.0], 0

    def start(self):
        pass

    def stop(self):
        pass

    def read(self):
        self.reads += 1
        pressed = {self.presses.get(self.reads, "nothing")}
        return DeviceState(
            time=0.01 * self.reads,
            limbs={"hand": LimbInput(twist=self.twist)},
            buttons=frozenset(pressed),
        )
'''


@pytest.mark.slow
def test_a_person_with_a_device_records(command, tmp_path, monkeypatch):
    (tmp_path / "waving.py").write_text(HAND)
    monkeypatch.syspath_prepend(tmp_path)
    file = tmp_path / "hand.hdf5"
    device = ("--device", "waving:Hand", "--device-option", "speed=0.1", "--no-page")
    code, out, err = command(
        "record", "Lift", "--robots", "Panda", "--out", file, "--episodes", 3,
        "--horizon", 300, *device,
    )  # fmt: skip
    assert (code, err) == (0, "")
    said = [line.strip() for line in out.splitlines() if line.startswith("  ")]
    kept = [line for line in said if "Kept as" in line]
    assert [line[-8:] for line in kept] == [
        "1 of 3).",
        "2 of 3).",
        "2 of 3).",
        "3 of 3).",
    ]
    assert any(line.startswith("Deleted demo_1") for line in said)
    assert "Discarded." in said
    with Dataset(file) as dataset:
        assert len(dataset) == 3
        lifted = dataset.column("demo_0", "obs/robot0_eef_pos")[:, 2]
    assert lifted[-1] > lifted[0] + 0.01
