"""What benchmarks share: rows, tables, timing, and the page made of them."""

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest
import write_benchmarks
from harness.report import Report, cell, look_up, options, rows_with

from wbc_suite.timing import time_block, times


@pytest.fixture
def report():
    report = Report()
    ours = report.add("Lift", "ours", [1.0, 2.0, 3.0], raw_us=1.6)
    theirs = report.add("Lift", "theirs", [20.0])
    report.rows.append({"case": "Lift", "side": "ours", "reach": {"worst_mm": 0.25}})
    report.compare("Lift/theirs", ours, theirs)
    return report


def test_rows_hold_median_and_percentile(report):
    row = report.rows[0]
    assert (row["median_us"], row["n"], row["raw_us"]) == (2.0, 3, 1.6)
    assert row["p99_us"] == pytest.approx(np.percentile([1, 2, 3], 99))
    assert report.ratios == {"Lift/theirs": 0.1}


def test_a_table_shows_only_rows_with_its_columns(report):
    assert rows_with(report.rows, ("case", "raw_us")) == report.rows[:1]
    assert rows_with(report.rows, ("side", "reach.worst_mm")) == report.rows[2:]
    assert look_up(report.rows[2], "reach.worst_mm") == 0.25
    assert look_up(report.rows[0], "reach.worst_mm") is None


def test_cells_show_three_digits():
    assert [cell(x) for x in (None, 7, 1234.5, 0.12345, 0.0, 1.2e-7, "a")] == [
        "",
        "7",
        "1234",
        "0.123",
        "0",
        "1e-07",
        "a",
    ]


def test_the_file_says_where_and_with_what(report, tmp_path, capsys):
    report.show("Steps", ("case", "side", "median_us"))
    report.write(tmp_path / "out.json")
    found = json.loads((tmp_path / "out.json").read_text())
    assert found["rows"] == report.rows
    assert found["ratios"] == {"Lift/theirs": 0.1}
    assert found["tables"][0]["title"] == "Steps"
    assert found["about"]["versions"]["mujoco"] == mujoco.__version__
    assert "theirs" in capsys.readouterr().out


def test_the_artefact_shows_tables_and_ratios(report, tmp_path):
    report.show("Steps", ("case", "side", "median_us"))
    script = tmp_path / "steps.py"
    script.write_text('"""What steps cost.\n\nWords.\n\nUsage: none\n"""\n')
    found = {"rows": report.rows, "ratios": report.ratios, "tables": report.tables}
    text = write_benchmarks.section(script, found)
    assert text.startswith("# What steps cost\n")
    assert "Words." in text
    assert "Usage" not in text
    assert "| Lift | theirs | 20 |" in text
    assert "| `Lift/theirs` | 0.1 |" in text


def test_the_page_shows_each_goal_once_with_its_figure(tmp_path, monkeypatch):
    monkeypatch.setattr(write_benchmarks, "RATIOS", tmp_path / "ratios.json")
    about = {"date": "2026-01-02", "machine": "m", "versions": {"mujoco": "4.0"}}
    first = {"ratios": {"GR1/mink": 0.123, "GR1/placo": 0.9, "x": 1.0}, "about": about}
    first["ratios"]["Tiago/mink"] = 0.25
    write_benchmarks.merged({Path("a.py"): first})
    later = {"ratios": {"GR1/placo": 0.8}, "about": about | {"date": "2026-03-04"}}
    ratios = write_benchmarks.merged({Path("a.py"): later})
    lines = write_benchmarks.goals(ratios).splitlines()
    assert lines[0] == "1 of 13 goals are missed."
    lines = lines[4:]
    assert len(lines) == len(write_benchmarks.GOALS) + len(write_benchmarks.AT_LEAST)
    (mink,) = (line for line in lines if "`GR1/mink`" in line)
    assert mink.endswith("| at most 0.2 | 0.123 | yes | 2026-01-02 |")  # kept
    (tiago,) = (line for line in lines if "`Tiago/mink`" in line)
    assert "| at most 0.2 | 0.25 | **no**, by 25 % |" in tiago
    (placo,) = (line for line in lines if "`GR1/placo`" in line)
    assert placo.endswith("| 0.8 | yes | 2026-03-04 |")
    (reset,) = (line for line in lines if "`Lift/Panda/reset/1ms`" in line)
    assert reset.endswith("| at most 1 |  |  |  |")  # not measured
    assert "x" not in ratios


def test_the_page_in_docs_has_a_figure_for_every_goal_and_lists_all_scripts():
    text = write_benchmarks.PAGE.read_text(encoding="utf-8")
    for name, *_ in (*write_benchmarks.GOALS, *write_benchmarks.AT_LEAST):
        (line,) = (x for x in text.splitlines() if x.startswith(f"| `{name}` |"))
        assert float(line.split("|")[4]) > 0.0
    assert write_benchmarks.contents() in text
    assert len(text.splitlines()) < 70


def test_every_script_takes_quick_and_json():
    arguments = options("Words.", "1 block").parse_args(["--quick", "--json", "a.json"])
    assert arguments.quick
    assert arguments.json.name == "a.json"


@pytest.fixture
def pendulum():
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><joint name='j'/><geom size='.1' pos='1 0 0'/></body>"
        "</worldbody><actuator><motor joint='j'/></actuator></mujoco>"
    )
    return model, mujoco.MjData(model)


def test_raw_physics_starts_where_each_step_began(pendulum, monkeypatch):
    model, data = pendulum
    began, held, raw_step = [], [], mujoco.mj_step

    def step(action):
        began.append(data.qpos.copy())
        data.ctrl[:] = action
        raw_step(model, data, nstep=5)

    def watched(model, scratch, nstep):
        held.append((scratch.qpos.copy(), scratch.ctrl.copy(), nstep))
        raw_step(model, scratch, nstep=nstep)

    monkeypatch.setattr(mujoco, "mj_step", watched)
    actions = [np.array([0.5]), np.array([-0.5])]
    block = time_block(step, actions, model=model, data=data, substeps=5)
    assert len(block.step) == len(block.raw) == 2
    assert [h[0] for h in held] == began
    assert [h[1] for h in held] == actions
    assert {h[2] for h in held} == {5}
    assert data.time == pytest.approx(10 * model.opt.timestep)


def test_times_are_of_the_process():
    assert all(t >= 0.0 for t in times(3, lambda: sum(range(1000))))
