"""Infer how grippers of an imported robot open and close, and where they grasp.

Geometry proposes, and a simulated cube decides.
"""

from collections.abc import Iterator, Mapping
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.robot.adopt.cube_hold import CUBE, hand_alone, way_of_cube
from wbc_suite.robot.adopt.jaws import OPENING, TURNS, jaw_tip, points_on
from wbc_suite.robot.adopt.posed_robot import PosedRobot
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Frame, Joint, Link, Synergy, rigid_bodies
from wbc_suite.robot.poses import pose_fields
from wbc_suite.typing import Matrix, Vector

APART = 1e-3  # m; a motion that changes the distance of fingers less neither closes
INSETS = (0.01, 0.025, 0.04)
"""Distances of a grasp from the tips, m; Franka's is 9 mm behind them."""
STAYS, FAR = 0.02, 0.05
"""Ways of a cube that is gripped, in m: with less no other grasp is tried, with more it
is not held."""
PARALLEL = 0.7  # least cosine between axes that bend a finger the same way
ALIKE = 0.9  # least cosine between the axes of two fingers beside each other
STEPS = 21  # postures from open to closed that are compared
MOST_CHOICES = 4096  # combinations of directions of fingers that are compared


class Gripper(NamedTuple):
    """What is inferred about one gripper.

    Attributes:
        synergy: Joint values open and closed.
        tcp: A frame between the fingers, if the robot has none; z points from the palm
            to the fingers, y from one finger to the next.
        reason: Why, as a sentence.
        held: Whether it holds a cube of 4 cm in simulation.
        links: What touches an object: the palm and the moving links.
    """

    synergy: Synergy
    tcp: Frame | None
    reason: str
    held: bool
    links: tuple[str, ...]


def infer_grippers(robot: RobotDescription) -> dict[str, Gripper]:
    """Return what is found about groups whose name has the word `gripper`, by group.

    The outermost links of the hand are its fingers; a single one closes on the palm.
    Joints parallel to a finger's last one bend it. Those of all fingers take the ends
    of their ranges that bring the tips closest to each other and to their bases. Other
    joints of a thumb, which alone is parallel to no finger, take the value that brings
    it closest to the fingers; those of other fingers stay at zero. A hand
    of three fingers or more opens to zero.

    The grasp lies between the tips where they are as far apart as a cube of 4 cm. Of
    the proposals that hold this cube that is taken which moves it least: closed fully
    or only until the tips meet, with a grasp 10, 25 or 40 mm from the tips.
    """
    found: dict[str, Gripper] = {}
    for group in robot.groups:
        hand = _Hand.of(robot, group) if "gripper" in group else None
        if hand is not None:
            found[group] = _infer(robot, group, hand)
    return found


def _infer(robot: RobotDescription, group: str, hand: "_Hand") -> Gripper:
    side, name = group.removesuffix("gripper"), group.replace("gripper", "tcp")
    given = [frame for frame in robot.frames if frame.role == "tcp"]
    own = next((x for x in given if x.name == name or x.name.startswith(side)), None)
    proposals = list(hand.proposals(group, name))
    chosen, least = proposals[0], FAR
    for proposal in proposals:
        way = way_of_cube(hand.alone, proposal.synergy, own or proposal.tcp)
        if way < least:
            chosen, least = proposal, way
        if way < STAYS:
            break
    held = least < FAR
    said = "held" if held else "not held"
    reason = f"{chosen.reason}; a cube of 4 cm is {said} in simulation"
    synergy = chosen.synergy.model_copy(update={"reason": reason})
    links = tuple(link.name for link in hand.alone.links)
    return Gripper(synergy, None if own else chosen.tcp, reason, held, links)


class _Proposal(NamedTuple):
    """A way to grasp; the frame is on the palm."""

    synergy: Synergy
    tcp: Frame
    reason: str


class _Finger(NamedTuple):
    """The outermost link of a finger.

    Attributes:
        link: Its name.
        tip: Its tip in its own frame, shape (3,), m.
        base: The first link of the finger.
        joints: Joints from the palm to the tip that move it.
    """

    link: str
    tip: Vector
    base: str
    joints: tuple[Joint, ...]


class _Hand:
    """A palm and its fingers, on their own.

    Attributes:
        alone: The palm, fixed, with what it carries.
        palm: Its first link.
        fingers: Its fingers.
    """

    def __init__(self, alone: RobotDescription, constant: dict[str, float]) -> None:
        self.alone, self.palm = alone, alone.links[0].name
        self._constant, self._posed = constant, PosedRobot(alone)
        self._leaders = {
            joint.name: joint.mimic.joint if joint.mimic else joint.name
            for joint in alone.joints
        }
        self.fingers = self._fingers()
        leaders = {self._leaders[j.name] for f in self.fingers for j in f.joints}
        found = [joint for joint in alone.joints if joint.name in leaders]
        self.ranges = {joint.name: joint.range for joint in found if joint.range}
        if len(found) == 1 and not self.ranges and len(self.fingers) == 1:
            self.ranges = {found[0].name: self._jaw_range(found[0])}

    @classmethod
    def of(cls, robot: RobotDescription, group: str) -> "_Hand | None":
        """Return the hand that a group moves, None without a shape or a limit."""
        joints = set(robot.groups[group])
        rigid = rigid_bodies(robot.links)
        moving = {x.name: rigid[str(x.parent)] for x in robot.links if x.joint}
        leaders = {
            x.name: x.joint.mimic.joint if x.joint.mimic else x.joint.name
            for x in robot.links
            if x.joint is not None
        }
        own = [name for name, leader in leaders.items() if leader in joints]
        tops = [name for name in own if moving[name] not in own]
        constant: dict[str, float] = {}
        while len(tops) == 1 and (below := [n for n in own if moving[n] == tops[0]]):
            joint = robot.link(tops[0]).joint
            if joint is not None and joint.mimic is None:
                constant[joint.name] = _zero(joint.range or (0.0, 0.0))
            tops = below
        palm = moving[tops[0]] if tops else ""
        tops = [name for name in tops if moving[name] == palm]
        if not tops:
            return None
        hand = cls(hand_alone(robot, palm, own), constant)
        return hand if hand.fingers and hand.ranges else None

    def _jaw_range(self, joint: Joint) -> tuple[float, float]:
        """Return limits of a jaw without: closed, and a sector away from the palm."""
        points = points_on(self.alone.links, self.palm)
        values = np.linspace(-np.pi, np.pi, TURNS)
        gaps: list[float] = []
        for value in values:
            self._posed.move({joint.name: value})
            away = np.linalg.norm(points - self._tip(self.fingers[0]), axis=1)
            gaps.append(float(away.min()))
        closed = int(np.argmin(gaps))
        step = round(OPENING / (2 * np.pi) * (TURNS - 1))
        wide = [gaps[(closed + k * step) % (TURNS - 1)] for k in (-1, 1)]
        opened = values[closed] + (OPENING if wide[1] > wide[0] else -OPENING)
        low, high = sorted((float(values[closed]), float(opened)))
        return low, high

    def _fingers(self) -> list[_Finger]:
        rigid = rigid_bodies(self.alone.links)
        links = {x.name: x for x in self.alone.links if x.joint is not None}
        shaped = {x: points_on(self.alone.links, x) for x in links}
        shaped = {name: points for name, points in shaped.items() if len(points)}
        chains: dict[str, list[Link]] = {}
        for name, link in links.items():
            chains[name] = [*chains.get(rigid[str(link.parent)], ()), link]
        inner = {x.name for name in shaped for x in chains[name][:-1]}
        fingers: list[_Finger] = []
        for name in shaped.keys() - inner:
            chain = chains[name]
            origin = self._posed.pose(name).actInv(self._posed.pose(chain[0].name))
            tip = jaw_tip(shaped[name], origin.translation)
            joints = tuple(x.joint for x in chain if x.joint is not None)
            fingers.append(_Finger(name, tip, chain[0].name, joints))
        order = list(links)
        fingers.sort(key=lambda finger: order.index(finger.link))
        return self._without_struts(fingers)

    def _without_struts(self, fingers: list[_Finger]) -> list[_Finger]:
        """Return the fingers without inner bars of linkages."""
        loops = {x for c in self.alone.connects for x in (c.link, c.other)}
        moved = [{self._leaders[j.name] for j in f.joints} for f in fingers]
        reach = [
            float(np.linalg.norm(self._tip(f) - self._base(fingers))) for f in fingers
        ]
        kept = [
            finger
            for k, finger in enumerate(fingers)
            if reach[k] > 0.8 * max(reach)
            or not (finger.link in loops or moved.count(moved[k]) > 2)
        ]
        return kept or fingers

    def _tip(self, finger: _Finger) -> Vector:
        return self._posed.pose(finger.link).act(finger.tip)

    def _base(self, fingers: list[_Finger]) -> Vector:
        """Return the middle of the first joints of fingers, m."""
        bases = [self._posed.pose(finger.base).translation for finger in fingers]
        return np.mean(bases, axis=0)

    def _tips(self, values: Mapping[str, float]) -> Matrix:
        """Return the tips in the palm's frame, shape (n, 3); of one, and the fixed."""
        self._posed.move(values)
        tips = np.array([self._tip(finger) for finger in self.fingers])
        if len(tips) == 1:
            tips = np.vstack([tips, self._against])
        palm = self._posed.pose(self.palm)
        return np.array([palm.actInv(tip) for tip in tips])

    @cached_property
    def _against(self) -> Vector:
        """The point of the palm that a single jaw comes closest to, shape (3,), m."""
        (name, limits), *_ = self.ranges.items()
        (jaw,), tips = self.fingers, list[Vector]()
        for value in limits:
            self._posed.move({name: value})
            tips.append(self._tip(jaw))
        points = points_on(self.alone.links, self.palm)
        away = np.linalg.norm(points[:, None] - np.array(tips), axis=2).min(axis=1)
        return points[away.argmin()]

    def _axis(self, joint: Joint) -> Vector:
        index = self._posed.model.getJointId(joint.name)
        return self._posed.data.oMi[index].rotation @ np.asarray(joint.axis)

    def _bending(self) -> tuple[list[dict[str, float]], list[str], list[Vector]]:
        """Return joints that bend, by finger, with signs; the others; fingers' axes."""
        self._posed.move({})
        units: list[dict[str, float]] = []
        others: list[str] = []
        axes: list[Vector] = []
        for finger in self.fingers:
            last = finger.joints[-1]
            axis = self._axis(last)
            axes.append(axis)
            signs: dict[str, float] = {}
            for joint in reversed(finger.joints):
                cosine = float(self._axis(joint) @ axis)
                leader = self._leaders[joint.name]
                ratio = joint.mimic.ratio if joint.mimic else 1.0
                if leader not in self.ranges:
                    continue
                if joint.type == last.type and abs(cosine) > PARALLEL:
                    signs.setdefault(leader, float(np.sign(cosine * ratio)))
                else:
                    others.append(leader)
            shared = next((u for u in units if u.keys() & signs.keys()), None)
            if shared is None:
                units.append(signs)
            else:
                turn = next(shared[n] * s for n, s in signs.items() if n in shared)
                for name, sign in signs.items():
                    shared.setdefault(name, turn * sign)
        bent = {name for unit in units for name in unit}
        return units, [n for n in dict.fromkeys(others) if n not in bent], axes

    def _ways(self) -> tuple[dict[str, float], dict[str, float]]:
        """Return the values of joints open and closed, which are best together."""
        units, others, axes = self._bending()
        opposed = [n for n in others if self._is_thumb(n, axes)]
        held = {name: _zero(self.ranges[name]) for name in others}
        best: tuple[float, dict[str, float], dict[str, float]] | None = None
        senses = list(product((1.0, -1.0), repeat=len(units)))[:MOST_CHOICES]
        for sense in senses:
            closed, opened = dict(held), dict(held)
            for unit, turn in zip(units, sense, strict=True):
                for name, sign in unit.items():
                    low, high = self.ranges[name]
                    ends = (low, high) if sign * turn > 0 else (high, low)
                    opened[name], closed[name] = ends
                    if len(self.fingers) > 2:
                        zero = _zero(self.ranges[name])
                        far = abs(closed[name] - zero) >= (high - low) / 2
                        opened[name] = zero if far else ends[0]
            cost = self._distances(closed)
            if best is None or cost < best[0] - APART:
                best = cost, opened, closed
        assert best is not None
        _, opened, closed = best
        for name in opposed:
            low, high = self.ranges[name]
            values = (_zero(self.ranges[name]), low, high, (low + high) / 2)
            gaps = [
                min(self._gaps(opened | {name: x}, closed | {name: x})[0])
                for x in values
            ]
            least = values[int(np.argmin(np.array(gaps) - APART * (np.arange(4) == 0)))]
            opened[name] = closed[name] = least
        return opened | self._constant, closed | self._constant

    def _is_thumb(self, leader: str, axes: list[Vector]) -> bool:
        """Whether a joint moves the only finger that is parallel to no other."""
        lone = [
            k
            for k, axis in enumerate(axes)
            if sum(abs(axis @ other) > ALIKE for other in axes) == 1
        ]
        return len(lone) == 1 and leader in {
            self._leaders[j.name] for j in self.fingers[lone[0]].joints
        }

    def _distances(self, values: dict[str, float]) -> float:
        """Return the sum of distances between tips, and of tips from the bases, m."""
        tips = self._tips(values)
        pairs = np.linalg.norm(tips[:, None] - tips[None], axis=2).sum() / 2
        if len(self.fingers) == 1:
            return float(pairs)
        base = self._posed.pose(self.palm).actInv(self._base(self.fingers))
        return float(pairs + np.linalg.norm(tips - base, axis=1).sum())

    def _gaps(
        self, opened: dict[str, float], closed: dict[str, float]
    ) -> tuple[list[float], list[tuple[Vector, Vector]]]:
        """Return the distance of opposed tips on the way from open to closed, m.

        The second list has the two points. Of three tips or more, one opposes the mean
        of the two nearest.
        """
        thumb = self._thumb()
        gaps: list[float] = []
        points: list[tuple[Vector, Vector]] = []
        for share in np.linspace(0.0, 1.0, STEPS):
            tips = self._tips(
                {n: (1 - share) * x + share * closed[n] for n, x in opened.items()}
            )
            rest = np.delete(tips, thumb, axis=0)
            away = np.linalg.norm(rest - tips[thumb], axis=1)
            other = rest[np.argsort(away)[:2]].mean(axis=0)
            points.append((tips[thumb], other))
            gaps.append(float(np.linalg.norm(other - tips[thumb])))
        return gaps, points

    def _thumb(self) -> int:
        """Return the finger that is least parallel to the others."""
        if len(self.fingers) < 3:
            return 0
        axes = np.array(self._bending()[2])
        return int(np.abs(axes @ axes.T).sum(axis=1).argmin())

    def proposals(self, group: str, name: str) -> Iterator[_Proposal]:
        """Yield ways to grasp, the most natural first."""
        opened, closed = self._ways()
        gaps, points = self._gaps(opened, closed)
        count = len(self.fingers)
        what = f"{count} fingers are" if count > 1 else "one jaw and its palm are"
        ends = [STEPS - 1]
        if count > 2 and (meeting := int(np.argmin(gaps))) not in (0, STEPS - 1):
            ends.append(meeting)
        for end, inset in product(ends, INSETS):
            share = end / (STEPS - 1)
            values = {n: (1 - share) * x + share * closed[n] for n, x in opened.items()}
            synergy = Synergy(
                gripper=group,
                name="grasp",
                open=opened,
                closed=values,
            )
            reason = (
                f"{what} {1e3 * gaps[0]:.0f} mm apart when open, and "
                f"{1e3 * gaps[end]:.0f} mm when closed"
            )
            near = [gap * self._taper(inset) for gap in gaps]
            first = next((k for k, gap in enumerate(near) if gap <= CUBE), None)
            place = int(np.argmin(gaps)) if first is None else first
            tcp = self._tcp(name, *points[place], inset=inset)
            yield _Proposal(synergy, tcp, reason)

    def _taper(self, inset: float) -> float:
        """Return the gap at a distance from the tips, m, over that at the tips."""
        finger = self.fingers[0]
        if len(self.fingers) > 1 or finger.joints[-1].type == "slide":
            return 1.0
        length = float(np.linalg.norm(finger.tip))
        return max(length - inset, 0.1 * length) / length

    def _tcp(self, name: str, thumb: Vector, other: Vector, *, inset: float) -> Frame:
        """Return a frame between two points in the palm's frame, m."""
        self._posed.move({})
        base = self._posed.pose(self.palm).actInv(self._base(self.fingers))
        middle = (thumb + other) / 2
        y = _unit(other - thumb)
        z = middle - base
        z = _unit(z - (z @ y) * y)
        pose = pin.SE3(np.column_stack([np.cross(y, z), y, z]), middle - inset * z)
        fields = {"name": name, "link": self.palm, "role": "tcp", **pose_fields(pose)}
        return Frame.model_validate(fields)


def _zero(limits: tuple[float, float]) -> float:
    """Return the value of a range that is nearest to zero."""
    low, high = limits
    return min(max(0.0, low), high)


def _unit(vector: Vector) -> Vector:
    """Return the direction of a vector; z if it has none."""
    length = float(np.linalg.norm(vector))
    return vector / length if length > 1e-6 else np.array([0.0, 0.0, 1.0])
