"""Work is done once, whoever does it, and whatever happens to the workers."""

import json
import os
import signal
import sys

import pytest

from wbc_suite.errors import ConfigError, DatasetError, UnknownNameError
from wbc_suite.executors import (
    EXECUTORS,
    Outcome,
    Processes,
    ResultFolder,
    Serial,
    WorkItem,
    make_executor,
    register_executor,
    run_items,
)


def doubled(item, folder):
    with (folder / "calls").open("a") as calls:
        calls.write(f"{item.name}\n")
    return {"twice": 2 * item.payload["number"]}


def killed_once(item, folder):
    """Item b kills its worker the first time, c the worker every time."""
    mark = folder / f"{item.name}.seen"
    before = mark.exists()
    mark.touch()
    if item.name == "c" or (item.name == "b" and not before):
        os.kill(os.getpid(), signal.SIGKILL)
    return doubled(item, folder)


def failing(item, folder):
    if item.name == "b":
        raise ConfigError("b is wrong.")
    if item.name == "c":
        raise ZeroDivisionError
    return doubled(item, folder)


def items(names="abcd"):
    return [WorkItem(name=n, payload={"number": k}) for k, n in enumerate(names)]


def calls(folder):
    path = folder / "calls"
    return sorted(path.read_text().split()) if path.exists() else []


@pytest.mark.parametrize("executor", [Serial(), Processes(2)])
def test_every_item_is_done_once_and_in_order_of_asking(executor, tmp_path):
    outcomes = run_items(doubled, items(), folder=tmp_path, executor=executor)
    assert [o.name for o in outcomes] == list("abcd")
    assert [o.result["twice"] for o in outcomes] == [0, 2, 4, 6]
    assert calls(tmp_path) == list("abcd")


def test_what_is_done_is_not_done_twice(tmp_path):
    first = run_items(doubled, items("ab"), folder=tmp_path, executor=Serial())
    told = []
    again = run_items(
        doubled,
        items("abc"),
        folder=tmp_path,
        executor=Serial(),
        on_outcome=lambda item, outcome: told.append(item.name),
    )
    assert again[:2] == first
    assert told == list("abc")
    assert calls(tmp_path) == list("abc")


def test_an_item_told_otherwise_is_done_again(tmp_path):
    run_items(doubled, items("ab"), folder=tmp_path, executor=Serial())
    other = [WorkItem(name="a", payload={"number": 21})]
    (outcome,) = run_items(doubled, other, folder=tmp_path, executor=Serial())
    assert outcome.result == {"twice": 42}


def test_a_torn_result_file_is_as_good_as_none(tmp_path):
    (item,) = items("a")
    results = ResultFolder(tmp_path)
    results.write(item, Outcome(name="a", result={"twice": 0}))
    assert results.read(item) == {"twice": 0}
    path = tmp_path / "results" / "a.json"
    path.write_text(path.read_text()[:-9])
    assert results.read(item) is None
    path.write_text(json.dumps([1, 2]))
    assert results.read(item) is None


@pytest.mark.parametrize("change", [("twice", "twicf"), (": 14", ": 15")])
def test_a_damaged_result_file_is_as_good_as_none(tmp_path, change):
    (item,) = items("a")
    results = ResultFolder(tmp_path)
    results.write(item, Outcome(name="a", result={"twice": 14, "sum": 0.1}))
    assert results.read(item) == {"twice": 14, "sum": 0.1}
    path = tmp_path / "results" / "a.json"
    path.write_text(path.read_text().replace(*change))
    assert results.read(item) is None


def test_errors_are_told_and_tried_again_next_time(tmp_path):
    outcomes = run_items(failing, items(), folder=tmp_path, executor=Serial())
    assert outcomes[1].error == "ConfigError: b is wrong."
    assert "ZeroDivisionError" in str(outcomes[2].error)
    assert calls(tmp_path) == list("ad")
    outcomes = run_items(doubled, items(), folder=tmp_path, executor=Serial())
    assert [o.error for o in outcomes] == [None] * 4
    assert calls(tmp_path) == list("abcd")


MADE = []
"""What `prepare` makes in this process."""


def make(item):
    MADE.append(item.name)


def made(item, folder):
    return {"made": list(MADE), "parent": os.getppid()}


@pytest.mark.skipif(sys.platform != "linux", reason="macOS cannot fork its libraries")
def test_prepared_workers_have_what_this_process_made(tmp_path):
    MADE.clear()
    executor = Processes(2, prepare=make)
    outcomes = run_items(made, items(), folder=tmp_path, executor=executor)
    assert [o.result["made"] for o in outcomes] == [["a"]] * 4
    assert {o.result["parent"] for o in outcomes} == {os.getpid()}
    run_items(made, items(), folder=tmp_path, executor=executor)
    assert MADE == ["a"]  # nothing is left to do, so that nothing is prepared


def stopped(item, folder):
    """Item b ends its worker by SIGTERM, which this process must not hear of."""
    if item.name == "b":
        os.kill(os.getpid(), signal.SIGTERM)
    return {"alive": True}


def test_a_prepared_worker_that_is_stopped_does_not_stop_this_process(tmp_path):
    heard = []
    before = signal.signal(signal.SIGTERM, lambda *_: heard.append("SIGTERM"))
    try:
        executor = Processes(2, attempts=1, prepare=make)
        outcomes = run_items(stopped, items(), folder=tmp_path, executor=executor)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert [o.error is None for o in outcomes] == [True, False, True, True]
    assert heard == []


@pytest.mark.slow
def test_a_killed_workers_item_is_done_again_and_a_killer_is_given_up(tmp_path):
    executor = Processes(2, attempts=2)
    outcomes = run_items(
        killed_once, items("abcdef"), folder=tmp_path, executor=executor
    )
    assert [o.name for o in outcomes if o.error] == ["c"]
    assert "died 2 times" in str(outcomes[2].error)
    assert outcomes[1].result == {"twice": 2}
    assert set(calls(tmp_path)) == set("abdef")


def test_names_that_are_no_file_names_are_refused():
    for name in ("", "a/b", "..", "x" * 200, "a b"):
        with pytest.raises(ConfigError, match="cannot name an item"):
            WorkItem(name=name, payload={})


def test_two_items_of_one_name_are_refused(tmp_path):
    with pytest.raises(DatasetError, match="same name"):
        run_items(doubled, items("aa"), folder=tmp_path, executor=Serial())


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(DatasetError, match="file"):
        ResultFolder(tmp_path / "file" / "below")


def test_executors_have_names():
    assert isinstance(make_executor("serial"), Serial)
    assert make_executor("process", workers=3).workers == 3
    with pytest.raises(UnknownNameError, match="process"):
        make_executor("proces")
    with pytest.raises(ConfigError, match="must be at least 1"):
        make_executor("process", workers=0)


def test_an_executor_of_ones_own_is_registered_by_one_line(forget):
    forget(EXECUTORS, "mine")
    register_executor("mine", lambda workers: ("mine", workers))
    assert make_executor("Mine", workers=2) == ("mine", 2)


@pytest.mark.parametrize(("name", "package"), [("ray", "ray"), ("slurm", "submitit")])
def test_a_missing_package_is_named_with_its_extra(name, package, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, package, None)
    with pytest.raises(ConfigError, match=rf"wbc-suite\[{name}\]"):
        make_executor(name)
