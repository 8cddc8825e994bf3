"""The tables of learning: figures of published logs, and means over seeds."""

import csv

import cloning
import learning
import numpy as np

from wbc_suite.evaluation import success_interval


def row(seed, last, **more):
    known = {"benchmark": "Lift", "data": "both", "method": "bc", "episodes": 20}
    known |= {"seed": seed, "last": last, "mean": last, "best": 1.0, "evaluated": 100}
    known |= {"checkpoints": 5, "training_cpu_seconds": 6.0, "date": "2026-11-25"}
    return known | {"machine": "m", "command": "c"} | more


def test_published_returns_are_means_of_five_epochs(tmp_path):
    for seed in (1, 2):
        name = f"TwoArmHandoff-PandaPanda-OSC-POSE-SEED{seed}"
        path = tmp_path / "runs" / name / "run" / "progress.csv"
        path.parent.mkdir(parents=True)
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(
                [
                    "evaluation/Returns Mean",
                    "exploration/num steps total",
                    "time/epoch (s)",
                ]
            )
            writer.writerows([seed * k, 1000 * k, 360.0] for k in range(1, 11))
    case = learning.read_published(tmp_path)["cases"][
        "TwoArmHandover-PandaPanda-OSC-POSE"
    ]
    assert case["steps"] == [5000, 10000]
    assert case["returns"] == [[3.0, 8.0], [6.0, 16.0]]
    assert case["hours"] == [1.0, 1.0]


def test_published_curves_are_those_known_of_the_paper():
    """Lift with OSC_POSE is solved in the end, which takes a return above 300."""
    curve = learning.published("Lift", "Panda", "OSC_POSE")
    assert len(curve["returns"]) == 5
    assert curve["steps"][-1] == 3300 + 500 * 2500
    assert min(returns[-1] for returns in curve["returns"]) > 300
    assert learning.published("TwoArmHandover", "Panda,Panda", "OSC_POSE")
    assert learning.published("Lift", "UR5e", "OSC_POSE") is None


def test_the_table_has_the_published_final_medians():
    medians = {"Lift": 456, "Door": 462, "TwoArmPegInHole": 470}
    lines = learning.table(learning.known_rows()).splitlines()
    column = lines[0].split(" | ").index("published final return")
    rows = [line.removeprefix("| ").split(" | ") for line in lines]
    found = {(row[0], row[column].split()[0]) for row in rows if row[0] in medians}
    assert found == {(name, str(median)) for name, median in medians.items()}


def test_a_case_is_the_mean_of_its_seeds():
    rows = [row(1, 0.9), row(0, 0.7), row(0, 0.2, data="plain", checkpoints=1)]
    plain, both = cloning.table(rows).splitlines()[2:4]
    assert "| 80.0 % (70.0, 90.0) |" in both
    low, high = success_interval(160, 200)
    assert f"{100 * low:.1f} to {100 * high:.1f} %" in both
    assert "| 20.0 % |" in plain
    assert plain.count("|  |") == 1


def test_noise_and_recoveries_are_recorded_apart_and_together():
    kinds = cloning.KINDS
    assert kinds["plain"] == (0, 0)
    both = np.add(kinds["noise"], kinds["recoveries"])
    assert tuple(both) == kinds["both"]
