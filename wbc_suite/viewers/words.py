"""Say in words how a limb stands and what keeps it from its target."""

import re

import numpy as np

from wbc_suite.viewers.snapshot import LimbStatus

__all__ = ["describe_reason", "explain", "plain"]

_ON_ITS_WAY = ("moving", "acceleration limit")
"""How reasons begin that are gone in a moment."""

_JOINT_LIMIT = re.compile(r"joint limit: (?P<joint>.+?)(?: \((?P<side>\w+)\))?$")
_SPEED_LIMIT = re.compile(r"velocity limit: (?P<joint>.+?)(?: \(\w+\))?$")
_COLLISION = re.compile(r"self-collision: (?P<one>.+?) - (?P<other>.+)$")
_FLOOR = re.compile(r"floor: (?P<link>.+)$")
_CONTACT = re.compile(r"contact: (?P<link>.+?) - (?P<thing>.+)$")
_WEAK = re.compile(r"motor limit: (?P<joint>.+)$")
_LAG = re.compile(r"lag: (?P<joint>.+)$")
_CONFLICT = re.compile(r"conflict: (?P<other>.+)$")


def plain(name: str) -> str:
    """Write a joint's or a link's name as words: `right_elbow_joint`, `right elbow`."""
    return name.removesuffix("_joint").removesuffix("_link").replace("_", " ").strip()


def describe_reason(reason: str) -> str:
    """Turn one of the controller's reasons into part of a sentence."""
    if match := _JOINT_LIMIT.match(reason):
        side = {"upper": " upper", "lower": " lower"}.get(match["side"] or "", "")
        return f"{plain(match['joint'])} is at its{side} limit"
    if match := _SPEED_LIMIT.match(reason):
        return f"{plain(match['joint'])} is at its top speed"
    if match := _COLLISION.match(reason):
        return f"{plain(match['one'])} would touch {plain(match['other'])}"
    if match := _FLOOR.match(reason):
        return f"{plain(match['link'])} would touch the floor"
    if match := _CONTACT.match(reason):
        return f"{plain(match['link'])} presses on {plain(match['thing'])}"
    if match := _WEAK.match(reason):
        return f"{plain(match['joint'])} has no more force"
    if match := _LAG.match(reason):
        return f"{plain(match['joint'])} lags behind"
    if match := _CONFLICT.match(reason):
        return f"it pulls against {plain(match['other'])}"
    return reason


def explain(status: LimbStatus, *, at_most: int = 3) -> str:
    """Return why a limb is not at its target; empty when it is, or will be.

    Args:
        status: How the limb stands.
        at_most: How many reasons to name.
    """
    short = _shortfall(status)
    reasons = [r for r in status.reasons if not r.startswith(_ON_ITS_WAY)]
    if status.reached or not short or (status.reasons and not reasons):
        return ""
    parts = [describe_reason(reason) for reason in reasons[:at_most]]
    return f"{short}: {', '.join(parts) or 'out of reach'}"


def _shortfall(status: LimbStatus) -> str:
    """Return what is missing, as people say it; nothing when it is hardly seen."""
    if status.position_error >= 0.005:
        return f"{100 * status.position_error:.0f} cm short"
    if status.orientation_error >= 0.05:
        return f"{np.rad2deg(status.orientation_error):.0f}° short"
    return ""
