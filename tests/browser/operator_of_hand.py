"""A person who lifts a cube with a tracked hand: looks, moves, closes, lifts."""

import time

import numpy as np
import pinocchio as pin

SPEED, TURNING = 0.25, 1.2  # m/s and rad/s, of an unhurried hand
GLANCE = 0.05  # s, between looks at the robot
APPROACH = np.array([0.0, 0.0, 0.10])  # m, above the cube
RISE = np.array([0.0, 0.0, 0.15])  # m
NEAR, STRAIGHT = 0.012, 0.12  # m and rad; what a person calls there
FINGERS = ("index", "middle")


class HandOperator:
    """Moves `wearer`'s hand until what is seen of `session`'s robot is as wanted.

    The wearer has `move(step)`, m, `turn(rotation)` about the wrist, both in the world,
    and `close(aperture)`, m. `look()` waits and returns seconds that have passed.
    """

    def __init__(self, session, wearer, side="right", object_name="cube", look=None):
        self.session, self.wearer, self.side = session, wearer, side
        self.cube = next(
            body for body in range(session.model.nbody)
            if session.model.body(body).name.startswith(object_name)
        )  # fmt: skip
        self.look = look or self.glance

    def glance(self):
        time.sleep(GLANCE)
        return GLANCE

    def site(self, name):
        """Return the pose of a site of the robot's hand, as it is seen."""
        model, snapshot = self.session.model, self.session.snapshot
        site = model.site(f"robot0_{self.side}_{name}")
        quat = snapshot.body_quaternions[site.bodyid[0]]
        R = pin.Quaternion(np.roll(quat, -1)).matrix()
        own = pin.Quaternion(np.roll(site.quat, -1)).matrix()
        place = snapshot.body_positions[site.bodyid[0]] + R @ site.pos
        return pin.SE3(R @ own, place)

    @property
    def between(self):
        """The point between the robot's thumb and fingers."""
        tips = [self.site(f"{finger}_tip").translation for finger in FINGERS]
        return 0.5 * (np.mean(tips, axis=0) + self.site("thumb_tip").translation)

    @property
    def cube_place(self):
        return self.session.snapshot.body_positions[self.cube].copy()

    def from_above(self):
        """Return the nearest orientation of the frame `pinch` over two of its faces."""
        quat = self.session.snapshot.body_quaternions[self.cube]
        sides = pin.Quaternion(np.roll(quat, -1)).matrix()[:, :2].T
        down, now, found = np.array([0.0, 0.0, -1.0]), self.site("pinch").rotation, []
        for y in (*sides, *-sides):
            y = y - (y @ down) * down
            y = y / np.linalg.norm(y)
            found.append(np.column_stack([np.cross(y, down), y, down]))
        return min(found, key=lambda R: np.linalg.norm(pin.log3(R @ now.T)))

    def turn_to(self, rotation, patience):
        """Turn until the frame `pinch` has this orientation."""
        for _ in self.looks(patience):
            error = pin.log3(rotation @ self.site("pinch").rotation.T)
            angle = np.linalg.norm(error)
            if angle < STRAIGHT:
                return
            self.wearer.turn(
                pin.exp3(error * min(1.0, 0.3 * TURNING * self.passed / angle))
            )
        raise AssertionError(f"the hand is still turned by {angle:.2f} rad")

    def move_to(self, place, patience, near=NEAR):
        """Move until the fingertips are around a point."""
        for _ in self.looks(patience):
            error = place - self.between
            distance = np.linalg.norm(error)
            if distance < near:
                return
            self.wearer.move(error * min(0.3, SPEED * self.passed / distance))
        raise AssertionError(f"the hand is still {1e3 * distance:.0f} mm away")

    def close(self, start, end, seconds):
        """Close or open the hand."""
        gone = 0.0
        while gone < seconds:
            gone += self.look()
            share = min(1.0, gone / seconds)
            self.wearer.close(start + share * (end - start))

    def looks(self, patience):
        gone = 0.0
        while gone < patience:
            self.passed = self.look()
            gone += self.passed
            yield gone
