"""Ray and Slurm executors, with stand-ins for ray and submitit.

test_clusters runs the real packages where they are installed.
"""

import sys
import types

import pytest

from wbc_suite.executors import Outcome, WorkItem, make_executor, run_items
from wbc_suite.executors.clusters import RayCluster, Slurm


def doubled(item, folder):
    return {"twice": 2 * item.payload["number"]}


def items(names):
    return [WorkItem(name=n, payload={"number": k}) for k, n in enumerate(names)]


class FakeRay(types.ModuleType):
    """Runs a task when it is waited for; the newest is finished first."""

    def __init__(self, lost=(), unloadable=()):
        super().__init__("ray")
        self.lost, self.unloadable = lost, unloadable
        self.most, self.options, self.started = 0, {}, False
        self.exceptions = types.SimpleNamespace(
            RayError=type("RayError", (Exception,), {})
        )
        self.exceptions.RayTaskError = type(
            "RayTaskError", (self.exceptions.RayError,), {}
        )

    def is_initialized(self):
        return self.started

    def init(self, **options):
        self.started = True

    def cluster_resources(self):
        return {"CPU": 2.0}

    def remote(self, **options):
        self.options = options

        def wrap(function):
            call = types.SimpleNamespace(remote=lambda *a: (function, a))
            return call

        return wrap

    def wait(self, references, num_returns):
        self.most = max(self.most, len(references))
        return [references[-1]], references[:-1]

    def get(self, reference):
        function, (work, item, folder) = reference
        if item.name in self.lost:
            raise self.exceptions.RayError("worker died")
        if item.name in self.unloadable:
            raise self.exceptions.RayTaskError("Traceback\nModuleNotFoundError: x")
        return function(work, item, folder)


class Hashable(tuple):
    """A reference of FakeRay; its item holds a dictionary."""

    __slots__ = ()
    __hash__ = object.__hash__


@pytest.fixture
def ray(monkeypatch):
    def install(**failures):
        module = FakeRay(**failures)
        plain = module.remote

        def remote(**options):
            wrap = plain(**options)

            def hashable(function):
                call = wrap(function)
                return types.SimpleNamespace(
                    remote=lambda *a: Hashable(call.remote(*a))
                )

            return hashable

        module.remote = remote
        monkeypatch.setitem(sys.modules, "ray", module)
        return module

    return install


def test_ray_runs_every_item_and_as_many_at_once_as_asked(ray, tmp_path):
    module = ray()
    executor = RayCluster(workers=3, attempts=4)
    outcomes = run_items(doubled, items("abcdef"), folder=tmp_path, executor=executor)
    assert [o.result["twice"] for o in outcomes] == [0, 2, 4, 6, 8, 10]
    assert module.most == 3
    assert module.options == {"num_cpus": 1, "max_retries": 3}


def test_ray_uses_all_processors_of_the_cluster(ray, tmp_path):
    module = ray()
    executor = make_executor("ray")
    run_items(doubled, items("abcd"), folder=tmp_path, executor=executor)
    assert module.most == 2
    assert module.started


def test_lost_workers_of_ray_fail_their_item_only(ray, tmp_path):
    ray(lost="b", unloadable="c")
    outcomes = run_items(
        doubled, items("abcd"), folder=tmp_path, executor=RayCluster(attempts=2)
    )
    errors = {o.name: o.error for o in outcomes if o.error}
    assert errors.keys() == {"b", "c"}
    assert "lost 2 times" in errors["b"]
    assert "ModuleNotFoundError: x" in errors["c"]
    assert "All machines need wbc_suite" in errors["c"]


class FakeJob:
    def __init__(self, call, fails):
        self.call, self.fails, self.polls = call, fails, 0

    def done(self):
        self.polls += 1
        return self.polls > 1

    def exception(self):
        return RuntimeError("node failed\nlong log") if self.fails else None

    def result(self):
        function, *arguments = self.call
        return function(*arguments)


class FakeSubmitit(types.ModuleType):
    """Jobs that finish at the second poll; chosen ones fail a number of times."""

    def __init__(self, failures):
        super().__init__("submitit")
        self.failures, self.submitted = dict(failures), []
        self.folder, self.cluster, self.parameters = None, None, {}

    def AutoExecutor(self, folder, cluster):
        self.folder, self.cluster = folder, cluster
        return self

    def update_parameters(self, **parameters):
        self.parameters = parameters

    def submit(self, *call):
        name = call[2].name
        self.submitted.append(name)
        left = self.failures.get(name, 0)
        self.failures[name] = left - 1
        return FakeJob(call, left > 0)


@pytest.fixture
def submitit(monkeypatch):
    monkeypatch.setattr("wbc_suite.executors.clusters.POLL_SECONDS", 0.0)

    def install(**failures):
        module = FakeSubmitit(failures)
        monkeypatch.setitem(sys.modules, "submitit", module)
        return module

    return install


def test_slurm_submits_failed_jobs_again_up_to_the_limit(submitit, tmp_path):
    module = submitit(b=1, c=5)
    executor = Slurm("local", attempts=2, parameters={"slurm_partition": "gpu"})
    outcomes = run_items(doubled, items("abc"), folder=tmp_path, executor=executor)
    assert [o.result.get("twice") for o in outcomes] == [0, 2, None]
    assert outcomes[2].error == "Its job failed: node failed"
    assert sorted(module.submitted) == ["a", "b", "b", "c", "c"]
    assert module.parameters == {"timeout_min": 240, "slurm_partition": "gpu"}
    assert (module.folder, module.cluster) == (tmp_path / "jobs", "local")


def test_a_second_call_submits_failed_items_only(submitit, tmp_path):
    submitit(b=3)
    executor = Slurm(attempts=1)
    run_items(doubled, items("ab"), folder=tmp_path, executor=executor)
    module = submitit()
    outcomes = run_items(doubled, items("ab"), folder=tmp_path, executor=Slurm())
    assert module.submitted == ["b"]
    assert [o.error for o in outcomes] == [None, None]


class Backwards:
    """An executor of a user: the last item first."""

    def run(self, work, items, folder):
        for item in reversed(items):
            yield Outcome(name=item.name, result=dict(work(item, folder)))


def test_an_executor_of_a_user_is_used_as_ours(tmp_path):
    reported = []
    outcomes = run_items(
        doubled,
        items("abc"),
        folder=tmp_path,
        executor=Backwards(),
        on_outcome=lambda item, outcome: reported.append(item.name),
    )
    assert reported == ["c", "b", "a"]
    assert [o.name for o in outcomes] == ["a", "b", "c"]
