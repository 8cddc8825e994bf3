"""Handles of several clients: what is received, who may drag, what is displayed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from fake_env import FakeEnv

from wbc_suite.devices.action_ports import LimbKind
from wbc_suite.viewers.drag_handles import DragHandles, HandleMode
from wbc_suite.viewers.teleop_session import TeleopSession

HAND, OTHER = "right_hand", "left_hand"


class Client:
    """A viser client that keeps its handles and notifications."""

    def __init__(self, number):
        self.client_id, self.nodes, self.notifications = number, {}, []
        self.scene = SimpleNamespace(add_transform_controls=self.add)

    def add(self, name, **options):
        node = SimpleNamespace(name=name, opacity=1.0, visible=True, **options)
        node.on_update = lambda callback: setattr(node, "callback", callback)
        self.nodes[name.split("/")[-1]] = node
        return node

    def add_notification(self, title, body, **_):
        self.notifications.append(f"{title}. {body}")

    def drag(self, name, phase, position=None, wxyz=None):
        """Send what a browser sends: it moves the node, then calls back."""
        node = self.nodes[name]
        node.position = node.position if position is None else np.array(position)
        node.wxyz = node.wxyz if wxyz is None else np.array(wxyz, dtype=float)
        call = node.callback(SimpleNamespace(target=node, phase=phase))
        with pytest.raises(StopIteration):  # a coroutine that waits for nothing
            call.send(None)


@pytest.fixture
def session():
    return TeleopSession(FakeEnv(), period=0.02)


@pytest.fixture
def handles(session):
    return DragHandles(session, {HAND: 0.2, OTHER: 0.1})


@pytest.fixture
def clients(handles):
    made = [Client(0), Client(1)]
    for client in made:
        handles.add_client(client)
    return made


def place(client, name=HAND):
    return client.nodes[name].position


def tick(session, handles):
    session.tick()
    handles.update(session.snapshot)


def test_handles_start_at_the_targets_with_their_size(session, clients):
    target = session.snapshot.limbs[HAND].target.translation
    np.testing.assert_allclose(place(clients[0]), target)
    assert (clients[0].nodes[HAND].scale, clients[0].nodes[OTHER].scale) == (0.2, 0.1)


def test_drag_moves_the_target_by_the_same_offset(session, handles, clients):
    start = place(clients[0]).copy()
    clients[0].drag(HAND, "start")
    clients[0].drag(HAND, "update", start + np.array([0.0, 0.1, 0.05]))
    tick(session, handles)
    target = session.snapshot.limbs[HAND].target.translation
    np.testing.assert_allclose(target - start, [0.0, 0.1, 0.05], atol=1e-12)
    clients[0].drag(HAND, "end")
    assert session.limbs[HAND].holder(session._clock()) is None


def test_quaternion_of_any_length_turns_the_target(session, clients):
    clients[0].drag(HAND, "start")
    clients[0].drag(HAND, "update", wxyz=[3.0, 0.0, 0.0, 3.0])  # 90 degrees about z
    session.tick()
    R = session.snapshot.limbs[HAND].target.rotation
    np.testing.assert_allclose(R, pin.exp3(np.array([0, 0, np.pi / 2])), atol=1e-9)


def test_second_client_cannot_drag_and_is_notified(session, handles, clients):
    first, second = clients
    first.drag(HAND, "start")
    second.drag(HAND, "start")
    assert second.notifications == [
        "Right hand is in use. Another viewer holds it until they release it."
    ]
    before = session.snapshot.limbs[HAND].target.translation
    second.drag(HAND, "update", [1.0, 1.0, 1.0])
    tick(session, handles)
    target = session.snapshot.limbs[HAND].target.translation
    np.testing.assert_array_equal(target, before)
    assert not second.nodes[HAND].visible
    assert first.nodes[HAND].visible
    assert second.nodes[OTHER].visible


def test_released_handle_is_placed_at_the_target_and_a_dragged_one_is_not(
    session, handles, clients
):
    dragged = place(clients[0]) + np.array([0.0, 0.0, 0.1])
    clients[0].drag(HAND, "start")
    clients[0].drag(HAND, "update", dragged)
    place(clients[0])[:] = [9.0, 9.0, 9.0]  # the browser is ahead of its messages
    tick(session, handles)
    np.testing.assert_array_equal(place(clients[0]), [9.0, 9.0, 9.0])
    np.testing.assert_allclose(place(clients[1]), dragged)
    clients[0].drag(HAND, "end")
    tick(session, handles)
    np.testing.assert_allclose(place(clients[0]), dragged)


def test_handle_with_its_clutch_disengaged_stays_until_it_is_recalled(
    session, handles, clients
):
    target = place(clients[0]).copy()
    session.enable(HAND, False)
    tick(session, handles)
    assert clients[0].nodes[HAND].opacity < 1.0
    clients[0].drag(HAND, "start")
    clients[0].drag(HAND, "update", target + 0.3)
    clients[0].drag(HAND, "end")
    tick(session, handles)
    np.testing.assert_allclose(place(clients[0]), target + 0.3)
    handles.recall(0)
    tick(session, handles)
    np.testing.assert_allclose(place(clients[0]), target)


def test_reset_brings_every_handle_back(session, handles, clients):
    target = place(clients[0]).copy()
    session.enable(HAND, False)
    tick(session, handles)
    clients[0].drag(HAND, "start")
    clients[0].drag(HAND, "update", target + 0.3)
    clients[0].drag(HAND, "end")
    session.reset()
    tick(session, handles)
    np.testing.assert_allclose(place(clients[0]), target)


def test_modes_and_hiding_are_those_of_one_client(session, handles, clients):
    first, second = (client.nodes[HAND] for client in clients)
    assert (first.disable_axes, first.disable_rotations) == (False, True)
    handles.set_mode(0, HandleMode.TURN)
    assert (first.disable_axes, first.disable_rotations) == (True, False)
    handles.set_mode(0, HandleMode.BOTH)
    assert (first.disable_axes, first.disable_rotations) == (False, False)
    assert handles.mode(1) is HandleMode.MOVE
    assert (second.disable_axes, second.disable_rotations) == (False, True)
    handles.show(0, HAND, shown=False)
    tick(session, handles)
    assert (first.visible, second.visible) == (False, True)


def test_key_alternates_between_moving_and_turning():
    assert HandleMode.MOVE.next() is HandleMode.TURN
    assert HandleMode.TURN.next() is HandleMode.MOVE
    assert HandleMode.BOTH.next() is HandleMode.MOVE


@pytest.mark.parametrize(
    ("kind", "moves", "turns"),
    [(LimbKind.POSITION, True, False), (LimbKind.ORIENTATION, False, True)],
)
def test_limb_of_fewer_components_has_only_their_controls(kind, moves, turns):
    session = TeleopSession(FakeEnv(), period=0.02)
    limbs = session.info.limbs
    changed = {**limbs, HAND: replace(limbs[HAND], kind=kind)}
    session.info = replace(session.info, limbs=changed)
    handles, client = DragHandles(session, {HAND: 0.2, OTHER: 0.2}), Client(0)
    handles.add_client(client)
    for mode in HandleMode:
        handles.set_mode(0, mode)
        node = client.nodes[HAND]
        assert (node.disable_axes, node.disable_rotations) == (not moves, not turns)


def test_leaving_client_releases_its_limb(session, handles, clients):
    clients[0].drag(HAND, "start")
    handles.remove_client(0)
    tick(session, handles)
    assert session.snapshot.limbs[HAND].holder is None
    clients[1].drag(HAND, "start")
    tick(session, handles)
    assert session.snapshot.limbs[HAND].holder == 1
