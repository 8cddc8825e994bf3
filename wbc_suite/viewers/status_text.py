"""Texts and HTML of the teleoperation page: session, recording, limbs and reasons."""

import html
from collections.abc import Mapping

import numpy as np

from wbc_suite.control.reasons import (
    Contact,
    Reason,
    TorqueLimit,
    TrackingError,
    is_transient,
)
from wbc_suite.devices.action_ports import LimbKind
from wbc_suite.qp import ActiveLimit, Conflict, LimitKind, LinkPair, OutOfReach
from wbc_suite.viewers.scene_setup import Colour, css
from wbc_suite.viewers.session_state import (
    LimbInfo,
    LimbStatus,
    SessionInfo,
    Snapshot,
    plain,
)

BLUE, GREEN, YELLOW, RED = "#3f7fbf", "#2f9e56", "#b08a2e", "#c8553d"
FIRST_DRAG = "Drag an arrow of a handle: the limb follows."
FIRST_GRIP = "The sliders below open and close grippers."
FIRST_WALK = "Hold W A S D to move, Q E to turn."
FIRST_KEY = "Key ? shows all keys."
RECORD_MOVES = "Record starts a new episode: the robot returns to its start."
RECORD_MOVED = "The robot was returned to its start."


def describe_reason(reason: Reason) -> str:
    """Return one of the controller's reasons as part of a sentence."""
    match reason:
        case ActiveLimit(kind=LimitKind.POSITION, subject=joint, side=side):
            return f"{plain(str(joint))} is at its {side} limit"
        case ActiveLimit(kind=LimitKind.VELOCITY, subject=joint):
            return f"{plain(str(joint))} is at its velocity limit"
        case ActiveLimit(subject=LinkPair(first, second)):
            return f"{plain(first)} would touch {plain(second)}"
        case ActiveLimit(kind=LimitKind.FLOOR, subject=link):
            return f"{plain(str(link))} would touch the floor"
        case Conflict(other):
            return f"conflict with {plain(other)}"
        case Contact(link, other):
            return f"{plain(link)} presses on {plain(other)}"
        case TorqueLimit(joint):
            return f"{plain(joint)} is at its torque limit"
        case TrackingError(joint) | ActiveLimit(LimitKind.TRACKING, joint):
            return f"{plain(str(joint))} lags behind its target"
        case OutOfReach():
            return "out of reach"
    return str(reason)


def explain(status: LimbStatus, *, at_most: int = 3) -> str:
    """Return why a limb is not where somebody moved its target.

    Empty if it is there, moves there, or nobody has moved its target.
    """
    error = _tracking_error(status) if status.moved else ""
    reasons = [r for r in status.reasons if not is_transient(r)]
    if status.reached or not error or (status.reasons and not reasons):
        return ""
    parts = [describe_reason(reason) for reason in reasons[:at_most]]
    return f"{error} short: {', '.join(parts) or 'out of reach'}"


def status_html(
    snapshot: Snapshot, info: SessionInfo, colours: Mapping[str, Colour]
) -> str:
    """Return the state of a session, with reasons of limbs that miss their target."""
    skipped = f" ({snapshot.skipped} skipped)" if snapshot.skipped else ""
    figures = (
        ("input to joint target", _or_dash(1e3 * snapshot.latency, "ms")),
        ("step time", _or_dash(1e3 * snapshot.step_time, "ms", digits=1)),
        ("period", _or_dash(1e3 * snapshot.step_period, "ms", digits=1)),
        ("overruns", f"{snapshot.overruns}{skipped}"),
        ("real time", _or_dash(snapshot.speed, "x", digits=2)),
    )
    cells = "".join(
        "<div style='flex:auto'><div style='font-size:1.05em;font-weight:600'>"
        f"{value}</div><div style='opacity:.75;font-size:.78em'>{label}</div></div>"
        for label, value in figures
    )
    reasons = "".join(
        "<div style='margin-top:.6em;padding:.4em .6em;border-radius:.3em;"
        f"border-left:.25em solid {css(colours[name])};"
        "background:rgba(200,120,60,.10);font-size:.88em'>"
        f"<b>{html.escape(info.limbs[name].title)}</b>: {html.escape(text)}</div>"
        for name, status in snapshot.limbs.items()
        if (text := explain(status))
    )
    fall = (
        f"<div style='margin-top:.6em;padding:.4em .6em;border-radius:.3em;"
        f"border-left:.25em solid {RED};background:rgba(200,85,61,.14);"
        f"font-size:.88em'>{html.escape(snapshot.fell)}</div>"
        if snapshot.fell
        else ""
    )
    return (
        "<div style='padding:0 .7em .6em'>"
        f"{_state_html(snapshot, info)}"
        f"<div style='display:flex;flex-wrap:wrap;gap:.4em 1em'>{cells}</div>"
        f"{_recording_html(snapshot)}{fall}{reasons}</div>"
    )


def timing_text(snapshot: Snapshot) -> str:
    """Return how the loop kept its period, for the end of a session."""
    step, period = (
        f"{1e3 * seconds:.1f} ms"
        for seconds in (snapshot.step_time, snapshot.step_period)
    )
    return (
        f"{snapshot.tick} steps, the last of {step} every {period}; "
        f"{snapshot.overruns} overruns, {snapshot.skipped} periods skipped."
    )


def pause_text(snapshot: Snapshot) -> str:
    """Return that the session is paused, and who may resume it."""
    match snapshot.paused_by:
        case None:
            return "Paused: anybody may resume"
        case "device":
            return "Paused: the device may resume"
        case client:
            return f"Paused: viewer {client + 1} may resume"


def task_html(task: str) -> str:
    """Return the task as the heading of the page."""
    return (
        "<h1 style='font-weight:600;font-size:1.1em;margin:0;padding:.5em .64em 0'>"
        f"{html.escape(task)}</h1>"
    )


def _state_html(snapshot: Snapshot, info: SessionInfo) -> str:
    """Return the state of the attempt, and the first thing to do."""
    state, colour = _state(snapshot, info)
    attempts = f"attempt {snapshot.epoch + 1}, {snapshot.solved} solved"
    hint = ""
    if snapshot.epoch == 0 and not any(x.moved for x in snapshot.limbs.values()):
        hints = {
            FIRST_DRAG: bool(info.limbs),
            FIRST_GRIP: bool(info.grippers),
            FIRST_WALK: bool(info.drive.any()),
            FIRST_KEY: True,
        }
        text = " ".join(text for text, is_possible in hints.items() if is_possible)
        hint = f"<div style='margin-bottom:.5em;font-size:.88em'>{text}</div>"
    return (
        "<div style='display:flex;flex-wrap:wrap;justify-content:space-between;"
        f"gap:0 1em;margin:.3em 0 .5em;padding:.2em .5em;"
        f"border-left:.3em solid {colour};background:{colour}22'>"
        f"<span style='font-weight:600'>{html.escape(state)}</span>"
        f"<span style='opacity:.75;font-size:.88em'>{attempts}</span></div>{hint}"
    )


def limbs_html(
    snapshot: Snapshot,
    limbs: Mapping[str, LimbInfo],
    colours: Mapping[str, Colour],
    *,
    client: int,
) -> str:
    """Return a table of the limbs: who holds them, and their tracking error.

    `client` is the number of the viewer who reads it.
    """
    rows = "".join(
        f"<tr><td><span style='color:{css(colours[name])}'>&#9632;</span> "
        f"{html.escape(limbs[name].title)}</td>"
        f"<td style='opacity:.75'>{html.escape(_notes(snapshot, name, client))}</td>"
        f"<td style='text-align:right'>{_error(limbs[name], status)}</td></tr>"
        for name, status in snapshot.limbs.items()
    )
    return f"<table style='width:100%;padding:.2em .7em;font-size:.88em'>{rows}</table>"


def _state(snapshot: Snapshot, info: SessionInfo) -> tuple[str, str]:
    """Return the state of the session and its colour."""
    if snapshot.message:
        return snapshot.message, RED
    if snapshot.fell:
        return "Fallen", RED
    if snapshot.paused:
        return pause_text(snapshot), YELLOW
    if snapshot.device:
        return ", ".join(snapshot.device).capitalize(), YELLOW
    if snapshot.success:
        return f"Solved in {snapshot.solved_at:.0f} s", GREEN
    state = "Not solved yet" if info.task else "Running"
    return f"{state}, {snapshot.time:.0f} s", BLUE


def _recording_html(snapshot: Snapshot) -> str:
    """Return the state of the recording, and what Record will do."""
    status = snapshot.recording
    if status is None:
        return ""
    dot, note, text = "", RECORD_MOVES, ""
    if status.recording:
        dot = f"<span style='color:{RED}'>&#9679;</span> "
        text = f"Recording episode {status.kept + 1}: {status.length} actions"
        note = RECORD_MOVED
    elif status.message:
        episodes = f"{status.kept} episode{'s' * (status.kept != 1)} in the file."
        text = f"{status.message} {episodes}"
    return (
        f"<div style='margin-top:.5em'>{dot}{html.escape(text)}</div>"
        f"<div style='font-size:.88em;opacity:.75'>{note}</div>"
    )


def _notes(snapshot: Snapshot, name: str, client: int) -> str:
    status = snapshot.limbs[name]
    notes = ["selected"] if name == snapshot.selected else []
    if status.holder is not None:
        you = status.holder == client
        notes.append("held by you" if you else f"held by viewer {status.holder + 1}")
    return ", ".join([*notes, *status.acting])


def _error(limb: LimbInfo, status: LimbStatus) -> str:
    if limb.kind is LimbKind.ORIENTATION:
        return f"{np.rad2deg(status.orientation_error):.0f}°"
    return f"{1e3 * status.position_error:.0f} mm"


def _tracking_error(status: LimbStatus) -> str:
    """Return the tracking error with its unit; empty if it is hardly visible."""
    if status.position_error >= 0.005:
        return f"{100 * status.position_error:.0f} cm"
    if status.orientation_error >= 0.05:
        return f"{np.rad2deg(status.orientation_error):.0f}°"
    return ""


def _or_dash(value: float, unit: str, *, digits: int = 0) -> str:
    return "&ndash;" if np.isnan(value) else f"{value:.{digits}f} {unit}"
