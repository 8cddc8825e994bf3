"""Work in pieces: finished pieces are kept, failed and changed ones run again."""

import json

import pytest

from wbc_suite.errors import DatasetError
from wbc_suite.recording.resumable_work import run_pieces, work_folder


def run_once(item, folder):
    with (folder / "calls").open("a") as calls:
        calls.write(f"{item.payload['name']} ")
    if (folder / "fail").exists() and item.payload["name"] == "b":
        raise DatasetError("b is damaged.")
    return {"upper": str(item.payload["name"]).upper()}


class Run:
    def __init__(self, folder):
        self.source, self.out = folder / "source.hdf5", folder / "out.hdf5"
        self.source.write_text("1")
        self.folder = work_folder(self.out)
        self.folder.mkdir()

    def __call__(self, names, **more):
        finished = []
        done = run_pieces(
            run_once,
            [{"name": name, **more} for name in names],
            source=self.source,
            out=self.out,
            executor=None,
            on_piece=lambda item, _: finished.append(item.payload["name"]),
        )
        return [result["upper"] for _, result in done], finished


@pytest.fixture
def run(tmp_path):
    return Run(tmp_path)


def calls(run):
    return (run.folder / "calls").read_text().split()


def test_results_come_in_the_order_of_the_pieces(run):
    assert run("cab") == (["C", "A", "B"], ["c", "a", "b"])
    assert run.folder.name == "out.hdf5.work"


def test_finished_pieces_do_not_run_again_and_are_reported(run):
    run("abc")
    assert run("abc") == (["A", "B", "C"], ["a", "b", "c"])
    assert calls(run) == ["a", "b", "c"]


def test_a_failed_piece_is_named_and_the_others_are_kept(run):
    (run.folder / "fail").touch()
    with pytest.raises(DatasetError, match=r"^1 of 3 pieces failed: b is damaged"):
        run("abc")
    (run.folder / "fail").unlink()
    assert run("abc")[0] == ["A", "B", "C"]
    assert calls(run) == ["a", "b", "c", "b"]


def test_other_options_and_a_changed_source_run_again(run):
    run("a")
    run("a", size=3)
    run.source.write_text("another")
    run("a", size=3)
    assert calls(run) == ["a", "a", "a"]


def test_payloads_are_stored_with_the_results(run):
    run("a", size=3)
    (path,) = (run.folder / "results").iterdir()
    record = json.loads(path.read_text())
    assert record["payload"]["size"] == 3
    assert record["payload"]["source"] == str(run.source)
    assert record["result"] == {"upper": "A"}
