"""Served policies take the same actions, bit by bit, and failures are told."""

import json
import socket
import threading
from contextlib import contextmanager

import numpy as np
import pytest

from wbc_suite.errors import ConfigError, DeviceError
from wbc_suite.evaluation import (
    Case,
    PolicyServer,
    plan_rollouts,
    replicate,
    run_rollouts,
)
from wbc_suite.evaluation.policy_socket import SocketPolicy, decode, encode


@contextmanager
def served(begin):
    with PolicyServer(begin) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield server.address
        finally:
            server.shutdown()
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


def test_a_server_survives_nonsense():
    with served(double) as address:
        host, _, port = address.removeprefix("socket://").partition(":")
        for sent in (b"\x00\xff\n", b"[1]\n", b"{}\n", b'{"observation": {}}\n', b""):
            with socket.create_connection((host, int(port))) as raw:
                raw.sendall(sent)
        policy = SocketPolicy(address, {"seed": 1})
        np.testing.assert_array_equal(policy({"x": 1.0}), 3.0)
        policy.close()


@pytest.mark.parametrize("address", ["socket://", "socket://here", "socket://a:b"])
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
