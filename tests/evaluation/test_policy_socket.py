"""Served policies take the same actions, bit by bit, and failures are told."""

import json
import socket
import threading
import time
from contextlib import ExitStack, contextmanager, suppress

import numpy as np
import pytest

from wbc_suite.errors import ConfigError, DatasetError, DeviceError
from wbc_suite.evaluation import (
    Case,
    PolicyServer,
    plan_rollouts,
    replicate,
    run_rollouts,
)
from wbc_suite.evaluation.policy_socket import SocketPolicy, decode, encode

LIMITS = "wbc_suite.evaluation.policy_socket."
PATIENCE = 60.0  # s, for a busy machine
BIG = np.ones(10_000)


@contextmanager
def served(begin, **options):
    with PolicyServer(begin, **options) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield server.address
        finally:
            server.shutdown()
            thread.join()


def raw(address):
    """Return a plain socket to a server."""
    host, _, port = address.removeprefix("socket://").rpartition("@")[2].partition(":")
    return socket.create_connection((host, int(port)), timeout=PATIENCE)


def is_closed(client):
    try:
        return client.recv(4096) == b""
    except ConnectionResetError:
        return True


def still_serves(address):
    policy = SocketPolicy(address, {"seed": 1})
    np.testing.assert_array_equal(policy({"x": 1.0}), 3.0)
    policy.close()


@contextmanager
def answering(line):
    """A server that answers every request with the same bytes."""

    def run():
        with suppress(OSError):
            connection, _ = listener.accept()
            with connection:
                while connection.recv(1 << 16):
                    connection.sendall(line)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=run)
        thread.start()
        yield f"socket://127.0.0.1:{listener.getsockname()[1]}"
        listener.close()
        thread.join()


def double(episode):
    return lambda seen: 2.0 * seen["x"] + episode["seed"]


@pytest.mark.parametrize(
    "value",
    [
        np.array([0.1, -0.0, np.nan, np.inf, 5e-324]),
        np.arange(12, dtype=np.uint8).reshape(2, 2, 3)[:, ::-1],
        np.float32(0.1),
        np.zeros((0, 3)),
        np.array([True, False]),
        np.arange(3, dtype=">i4"),
    ],
)
def test_arrays_arrive_bit_by_bit(value):
    sent = json.loads(json.dumps(encode(value)))
    found = decode(sent)
    assert found.shape == np.shape(value)
    assert found.dtype == np.asarray(value).dtype.newbyteorder("<")
    assert found.tobytes() == np.asarray(value).astype(found.dtype).tobytes()


@pytest.mark.parametrize(
    "value",
    [
        None,
        {},
        {"dtype": "O", "shape": [1], "data": ""},
        {"dtype": "<f8", "shape": [2], "data": "AAAA"},
        {"dtype": "<f8", "shape": [1], "data": "!"},
        {"dtype": "<f8", "shape": 1, "data": ""},
        {"dtype": "nonsense", "shape": [0], "data": ""},
        {"dtype": "<f8,<f8", "shape": [0], "data": ""},
        {"dtype": "<f8", "shape": [10**30], "data": ""},
        {"dtype": "<f8", "shape": [float("inf")], "data": ""},
        {"dtype": 8, "shape": [0], "data": ""},
    ],
)
def test_what_is_no_array_is_refused(value):
    with pytest.raises(ValueError, match=r"."):
        decode(value)


def test_a_served_policy_sees_the_observation_and_the_episode():
    with served(double) as address:
        for seed in (3, 4):
            policy = SocketPolicy(address, {"seed": seed})
            np.testing.assert_array_equal(
                policy({"x": [1.0, 2.0]}), [2 + seed, 4 + seed]
            )
            policy.close()


def test_errors_of_the_server_are_told():
    def begin(episode):
        raise RuntimeError("no weights")

    with served(begin) as address, pytest.raises(DeviceError, match="no weights"):
        SocketPolicy(address, {"seed": 0})
    with served(lambda _: lambda seen: seen["y"]) as address:
        policy = SocketPolicy(address, {"seed": 0})
        with pytest.raises(DeviceError, match="KeyError"):
            policy({"x": 1.0})
        policy.close()


NONSENSE = (
    b"\x00\xff\n",
    b"[1]\n",
    b"{}\n",
    b'{"observation": {}}\n',
    b"",
    b"[" * 200_000 + b"\n",
    b'{"reset":' * 5_000 + b"\n",
    b'{"reset": {"seed": ' + b"9" * 10_000 + b"}}\n",
    b'{"reset": [' + b"[]," * 100_000 + b"[]]}\n",
    b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" + b'{"reset": {"seed": 1}}\n',
)


def test_a_server_survives_nonsense(capfd):
    begun = []

    def begin(episode):
        begun.append(episode)
        return double(episode)

    with served(begin) as address:
        for sent in NONSENSE:
            with raw(address) as client:
                client.sendall(sent)
                client.shutdown(socket.SHUT_WR)
                while not is_closed(client):
                    pass
        still_serves(address)
    assert begun == [{"seed": 1}]
    assert capfd.readouterr() == ("", "")


def test_a_client_survives_nonsense():
    for line in (b"[" * 200_000 + b"\n", b"[]\n", b"\xff\n", b"x" * 2_000_000):
        with answering(line) as address, pytest.raises(DeviceError, match="Lost"):
            SocketPolicy(address, {})


def test_what_a_server_says_commands_no_terminal():
    line = json.dumps({"error": "\x1b[2J\x9b31m" + "x" * 10_000}).encode() + b"\n"
    with answering(line) as address, pytest.raises(DeviceError) as told:
        SocketPolicy(address, {})
    assert str(told.value).isprintable()
    assert r"\x1b[2J\x9b31m" in str(told.value)
    assert len(str(told.value)) < 3_000


def test_endless_lines_are_cut_off(monkeypatch):
    monkeypatch.setattr(LIMITS + "MAX_BYTES", 100_000)
    with served(double) as address:
        with raw(address) as client, suppress(OSError):
            for _ in range(1_000):
                client.sendall(b"x" * 10_000)
            raise AssertionError("ten million bytes were taken")
        still_serves(address)


def test_large_messages_are_received_a_few_at_a_time(monkeypatch):
    monkeypatch.setattr(LIMITS + "LARGE", 1_000)
    monkeypatch.setattr(LIMITS + "LARGE_AT_ONCE", 2)
    monkeypatch.setattr(LIMITS + "FIRST", PATIENCE)
    with served(double) as address, ExitStack() as stack:
        half = [stack.enter_context(raw(address)) for _ in range(2)]
        for client in half:
            client.sendall(b'{"pad": "' + b"x" * 500_000)
        still_serves(address)  # small messages pass
        third = SocketPolicy(address, {"seed": 0})
        answers = []
        asked = threading.Thread(target=lambda: answers.append(third({"x": BIG})))
        asked.start()
        asked.join(0.2)
        assert answers == []
        half[0].close()
        asked.join(PATIENCE)
        np.testing.assert_array_equal(answers[0], 2.0 * BIG)
        third.close()


def test_silent_and_slow_connections_are_closed(monkeypatch):
    monkeypatch.setattr(LIMITS + "FIRST", 0.05)
    with served(double) as address:
        with raw(address) as silent:
            assert is_closed(silent)
        monkeypatch.setattr(LIMITS + "FIRST", PATIENCE)
        monkeypatch.setattr(LIMITS + "TRANSFER", 0.05)
        with raw(address) as slow:
            slow.sendall(b"{")
            assert is_closed(slow)
        monkeypatch.setattr(LIMITS + "IDLE", 0.05)
        with raw(address) as idle:
            idle.sendall(b'{"reset": {"seed": 1}}\n')
            assert idle.recv(100) == b"{}\n"
            assert is_closed(idle)


def test_silent_connections_make_room_and_others_keep_theirs():
    before = threading.active_count()
    with served(double, connections=3) as address, ExitStack() as stack:
        silent = [stack.enter_context(raw(address)) for _ in range(100)]
        still_serves(address)
        assert threading.active_count() <= before + 10
        assert is_closed(silent[0])
        policies = [SocketPolicy(address, {"seed": 1}) for _ in range(3)]
        with pytest.raises(DeviceError, match=r"taken|Lost"):
            SocketPolicy(address, {"seed": 1})
        for policy in policies:
            np.testing.assert_array_equal(policy({"x": 1.0}), 3.0)
            policy.close()
        wait_until_it_serves(address)


def wait_until_it_serves(address):
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:  # the server learns of closing later
        with suppress(DeviceError):
            return still_serves(address)
        time.sleep(0.01)
    raise AssertionError("closed connections are still counted")


def test_beyond_this_machine_it_asks_for_the_token():
    with served(double, host="0.0.0.0") as address:
        token, _, place = address.removeprefix("socket://").partition("@")
        near = "127.0.0.1:" + place.rpartition(":")[2]
        assert len(token) >= 20
        for wrong in ("", "guess@"):
            with pytest.raises(DeviceError, match="needs its token"):
                SocketPolicy(f"socket://{wrong}{near}", {"seed": 1})
        still_serves(f"socket://{token}@{near}")


def test_an_episode_that_ended_is_closed():
    closed = []

    class Policy:
        def __init__(self, episode):
            self.seed = episode["seed"]

        def __call__(self, observation):
            return 0.0

        def close(self):
            closed.append(self.seed)

    with served(Policy) as address:
        first = SocketPolicy(address, {"seed": 1})
        first._ask({"reset": {"seed": 2}})
        first.close()
        deadline = time.monotonic() + PATIENCE
        while closed != [1, 2]:
            assert time.monotonic() < deadline
            time.sleep(0.001)


@pytest.mark.parametrize(
    "named",
    [
        {"benchmark": "/etc/hostname"},
        {"benchmark": "tasks/lift.toml"},
        {"benchmark": "module:Benchmark"},
        {"robots": "robot.urdf"},
        {"robots": ["Panda", {"file": "../robot"}]},
        {"controller_configs": "mine.json"},
        {"gripper_types": {"right": "/etc/hostname"}},
        {"arena": "scene"},
    ],
)
def test_clients_name_no_files(named):
    with pytest.raises(DatasetError, match=r"names a file.*--trust-files"):
        replicate("hold")({"seed": 0, "benchmark": "Lift"} | named)


@pytest.mark.parametrize(
    "address", ["socket://", "socket://here", "socket://a:b", "socket://a:99999"]
)
def test_wrong_addresses_are_named(address):
    with pytest.raises(ConfigError, match="socket://HOST:PORT"):
        SocketPolicy(address, {})


def test_a_server_that_is_not_there_is_named():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"socket://127.0.0.1:{free.getsockname()[1]}"
    with pytest.raises(DeviceError, match="No policy answers"):
        SocketPolicy(address, {})


@pytest.mark.slow
@pytest.mark.parametrize("policy", ["expert", "random", "hold"])
def test_episodes_over_a_socket_are_those_in_process(policy, tmp_path):
    """`expert` asks its environment for the action that holds: a replica answers."""

    def episodes(name):
        more = (("horizon", 70), ("terminate_on_success", True))
        case = Case(benchmark="Lift", robots=("Panda",), policy=name, arguments=more)
        (item,) = plan_rollouts([case], seeds=[5, 6], chunk=2)
        lines = run_rollouts(item, tmp_path)["episodes"]
        return [{k: v for k, v in line.items() if k != "seconds"} for line in lines]

    here = episodes(policy)
    with served(replicate(policy)) as address:
        assert episodes(address) == here
    assert [line["succeeded"] for line in here] == [policy == "expert"] * 2
