"""Choice of grasps: among all sites and arms, by a look-ahead over what follows."""

import itertools
import math
from bisect import insort
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pinocchio as pin

from wbc_suite.experts.arm import Arm
from wbc_suite.experts.look_ahead import Prediction
from wbc_suite.experts.scene import ExpertScene
from wbc_suite.scene.objects.grasp_site import GraspSite
from wbc_suite.typing import Vector

DOWN = np.array([0.0, 0.0, -1.0])
TILTS = (0.0, 0.25, -0.25, 0.5, -0.5)  # rad, about the closing axis
OVERLAP = 200.0  # cost of what hands meet on the way, 1/m
ANGLE = 0.4  # cost of an approach that deviates from the wanted one, 1/rad
CLEAR = 0.001  # m, between fingers and what an object lies on
ROOM = 0.006  # m, between fingers and what is behind an object: hands miss by 4 mm
MISS = 0.005  # m, between fingers and things beside an object, likewise
MOST_LIFT = 0.03  # m, by which hands stay back for that
STEEP = 0.7  # cosine, of approaches from above
PAIRED = 8  # grasps of each arm that are looked at with those of the other
GOOD = 1.0  # of predictions; tilted grasps are looked at if none is so good


@dataclass(frozen=True, kw_only=True)
class Approach:
    """How an object may be approached.

    Attributes:
        raised: How far it is raised once it is grasped, m.
        away: Distance from which the hand approaches, m.
        upright: Greatest angle of the approach to the wanted direction, rad.
        direction: Wanted direction of approach, a unit vector in the world.
        place: Name of the place to grasp, where the object has several.
        leave: How far the hand withdraws along its approach in the end, m.
    """

    raised: float = 0.1
    away: float = 0.08
    upright: float = 0.8
    direction: Vector = field(default_factory=DOWN.copy)
    place: str = ""
    leave: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Choice:
    """A grasp of an object by an arm, and what follows.

    Attributes:
        before: Pose of the hand before it approaches.
        away: Distance from there to the grasp, m.
        grasp: Pose T_oh of the hand in the object's frame.
        then: Chain of poses of the object that follows.
        depth: How deep the robot gets in other things, m.
        cost: Of the prediction, with penalties.
    """

    arm: Arm
    site: GraspSite
    before: pin.SE3
    away: float
    grasp: pin.SE3
    then: tuple[pin.SE3, ...]
    prediction: Prediction
    depth: float
    cost: float

    def hand_at(self, T_wo: pin.SE3) -> pin.SE3:
        """Return the pose of the hand for a pose of the object."""
        return T_wo * self.grasp


def choose_grasp(
    scene: ExpertScene,
    name: str,
    *,
    arms: Sequence[Arm],
    approach: Approach,
    then: Sequence[Sequence[pin.SE3]] = ((),),
    costs: Sequence[float] | None = None,
) -> Choice | None:
    """Return the best grasp of an object; None if no site lies along the direction.

    Args:
        scene: The scene.
        name: The object.
        arms: The arms that may do it.
        approach: How it may be approached.
        then: Alternatives of where it will be carried, each a chain of its poses.
        costs: Cost of each alternative beside its prediction, s.
    """
    found = _ranked(scene, name, arms, approach, then, costs)
    return found[0] if found else None


def choose_pair(
    scene: ExpertScene,
    name: str,
    *,
    arms: Sequence[Arm],
    approaches: Sequence[Approach],
    then: Sequence[pin.SE3],
) -> tuple[Choice, Choice] | None:
    """Return the best grasps of an object by two arms at once; None if one has none.

    For arms that share joints, such as those of a waist, a look-ahead with both hands
    decides among the `PAIRED` best of each.
    """
    shared = arms[0].shares_joints(arms[1])
    several = {"count": PAIRED, "enough": 0.0} if shared else {}
    one, other = (
        _ranked(scene, name, [arm], approach, [then], **several)
        for arm, approach in zip(arms, approaches, strict=True)
    )
    if not one or not other:
        return None
    if not shared:
        return one[0], other[0]
    at = scene.pose(name)

    def cost(pair: tuple[Choice, Choice]) -> float:
        chains = [(c.before, *(c.hand_at(T) for T in (at, *then))) for c in pair]
        return (
            arms[0]
            .look_ahead_beside(
                arms[1],
                (pair[0].site.grasp, pair[1].site.grasp),
                [*zip(*chains, strict=True)],
            )
            .cost
        )

    return min(itertools.product(one[:PAIRED], other[:PAIRED]), key=cost)


def _ranked(
    scene: ExpertScene,
    name: str,
    arms: Sequence[Arm],
    approach: Approach,
    then: Sequence[Sequence[pin.SE3]],
    costs: Sequence[float] | None = None,
    *,
    count: int = 1,
    enough: float = GOOD,
) -> list[Choice]:
    """Return the best grasps by cost, tilted ones too if none costs less than enough.

    What follows a grasp is left as soon as it costs more than `count` others.
    """
    ways = [*zip(map(tuple, then), costs or [0.0] * len(then), strict=True)]
    found: list[Choice] = []
    for tilt in TILTS:
        if found and found[0].cost < enough:
            break
        begun = [
            choice
            for arm in arms
            for site in scene.grasps(name)
            if abs(tilt) <= site.tilt and site.name == approach.place
            for choice in _begin(scene, name, arm, site, tilted(site, tilt), approach)
        ]
        for choice in sorted(begun, key=_cost):
            for way, extra in ways:
                most = found[count - 1].cost if len(found) >= count else math.inf
                whole = _follow(scene, name, choice, way, extra, most, approach.leave)
                if whole is not None:
                    insort(found, whole, key=_cost)
    return found


def _cost(choice: Choice) -> float:
    return choice.cost


def tilted(site: GraspSite, tilt: float) -> pin.SE3:
    """Return a site's pose turned about its closing axis by an angle, rad."""
    pose = site.pose
    turn = pin.exp3(tilt * np.array(site.closing))
    return pin.SE3(turn @ pose.rotation, pose.translation)


def _begin(
    scene: ExpertScene,
    name: str,
    arm: Arm,
    site: GraspSite,
    grasp: pin.SE3,
    approach: Approach,
) -> Iterator[Choice]:
    """Yield a grasp, until the object is raised; nothing if its direction is wrong."""
    at = scene.pose(name) * grasp
    along = float(at.rotation[:, 2] @ approach.direction)
    if along < math.cos(approach.upright):
        return

    def reach(back: float) -> tuple[pin.SE3, pin.SE3, Prediction]:
        held = grasp * pin.SE3(np.eye(3), back * DOWN)
        at = scene.pose(name) * held
        away = approach.away * at.rotation[:, 2]
        before = pin.SE3(at.rotation, at.translation - away)
        up = pin.SE3(at.rotation, at.translation - approach.raised * DOWN)
        return held, before, arm.look_ahead([before, at, up], site.grasp)

    back = _needed_lift(scene, name, arm, site.grasp, at)
    held, before, first = reach(back)
    met = _overlap_while_closing(scene, name, arm, site.grasp, first)
    if met > 0.0:  # something is behind the object: the hand stays back from it
        q, closing = arm.configuration(first.q[1]), arm.closing(site.grasp)
        z = (scene.pose(name) * held).rotation[:, 2]
        ahead = max(
            scene.overlap(arm, q, but=name, fingers=f, along=z) for f in closing
        )
        if 0.0 < ahead < MOST_LIFT - back - ROOM:
            held, before, first = reach(back + ahead + ROOM)
            met = _overlap_while_closing(scene, name, arm, site.grasp, first)
    angle = ANGLE * math.acos(min(1.0, along))
    yield Choice(
        arm=arm,
        site=site,
        before=before,
        away=approach.away,
        grasp=held,
        then=(),
        prediction=first,
        depth=max(met, 0.0),
        cost=first.cost + angle + OVERLAP * max(met, 0.0),
    )


def _follow(
    scene: ExpertScene,
    name: str,
    begun: Choice,
    way: tuple[pin.SE3, ...],
    extra: float,
    most: float,
    leave: float,
) -> Choice | None:
    """Return a grasp with what follows it; None if it costs more than `most`."""
    arm, first = begun.arm, begun.prediction
    spent = begun.cost - first.cost + extra
    if first.cost + spent > most:
        return None
    poses = [begun.hand_at(pose) for pose in way]
    if leave > 0.0:
        poses.append(poses[-1] * pin.SE3(np.eye(3), leave * DOWN))
    prediction = arm.look_ahead(poses, begun.site.grasp, after=first, most=most - spent)
    if prediction.cost + spent > most:
        return None
    carried = map(arm.configuration, prediction.q[len(first.q) :])
    depth = max(begun.depth, *(scene.overlap(arm, q, but=name) for q in carried), 0.0)
    cost = prediction.cost + spent + OVERLAP * (depth - begun.depth)
    return replace(begun, then=way, prediction=prediction, depth=depth, cost=cost)


def _needed_lift(
    scene: ExpertScene, name: str, arm: Arm, grasp: str, at: pin.SE3
) -> float:
    """Return how far a hand must stay back for its fingers to clear the support, m."""
    down = -at.rotation.item(2, 2)
    if down < STEEP:
        return 0.0
    room = (at.translation[2] - scene.bottom(name)) / down
    return min(max(arm.finger_reach(grasp) + CLEAR - room, 0.0), MOST_LIFT)


def _overlap_while_closing(
    scene: ExpertScene, name: str, arm: Arm, grasp: str, prediction: Prediction
) -> float:
    """Return how deep a hand that comes, closes and rises gets in other things, m.

    Fingers sweep over what lies beside the object while they close.
    """
    before, at, up = map(arm.configuration, prediction.q)
    closing = arm.closing(grasp)
    moments = [(before, closing[0]), *((at, f) for f in closing), (up, closing[-1])]
    return max(
        scene.overlap(arm, q, but=name, fingers=f, beside=MISS) for q, f in moments
    )
