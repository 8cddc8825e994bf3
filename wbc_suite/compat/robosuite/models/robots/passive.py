"""What robosuite's models of arms have that ours do not: passive values, inertias."""

from typing import Any

from wbc_suite.compat.robosuite.models.own_files import changed
from wbc_suite.robot import RobotDescription

ARMATURE = 5.0
"""kg m^2; the k-th joint of an arm on a fixed base has 5 / k in robosuite."""
FRICTION = {"UR5e": 0.01, "Jaco": 0.01, "XArm7": 1.0}
"""Dry friction of all joints of an arm in robosuite, N m; 0.1 for all others."""
DAMPING = {"UR5e": (0.001,) * 6, "Sawyer": (*(0.1,) * 5, 0.2, 0.1)} | dict.fromkeys(
    ("Panda", "Jaco", "Kinova3", "XArm7"), (*(0.1,) * 5, 0.01, 0.01)
)
"""Damping of the joints of an arm in robosuite, N m s; 0.1 for all others."""

EFFORTS = {
    "Panda": (*(80.0,) * 5, 12.0, 12.0),
    "Jaco": (*(30.5,) * 5, 6.8, 6.8),
    "Kinova3": (*(32.0,) * 5, 13.0, 13.0),
    "XArm7": (80.0,) * 7,
}
"""Greatest torques of an arm in robosuite, N m, where they are not ours."""

INERTIAS: dict[str, tuple[float, tuple[float, ...], tuple[float, ...]]] = {
    "panda_link1": (3.0, (0, 0, -0.07), (0.3, 0.3, 0.3)),
    "panda_link2": (3.0, (0, -0.1, 0), (0.3, 0.3, 0.3)),
    "panda_link3": (2.0, (0.04, 0, -0.05), (0.2, 0.2, 0.2)),
    "panda_link4": (2.0, (-0.04, 0.05, 0), (0.2, 0.2, 0.2)),
    "panda_link5": (2.0, (0, 0, -0.15), (0.2, 0.2, 0.2)),
    "panda_link6": (1.5, (0.06, 0, 0), (0.1, 0.1, 0.1)),
    "panda_link7": (1.0, (0, 0, 0.09325), (0.1, 0.1, 0.1)),  # with its `right_hand`
    "panda_hand": (0.48, (0, 0, 0.1444), (0.09, 0.05, 0.07)),
    "panda_leftfinger": (0.02, (0, 0, 0.05), (0.02, 0.02, 0.02)),
    "panda_rightfinger": (0.02, (0, 0, 0.05), (0.02, 0.02, 0.02)),
}
"""Mass, kg, its centre, m, and moments of inertia, kg m^2, of links whose values in
robosuite are invented; those of other arms are the manufacturers', as ours. Its finger
tips have 0.01 kg m^2 at 10 g: the air drags them as cubes of 2.4 m. So it does ours."""

HAND = {"pos": (0.0, 0.0, 0.1065), "quat": (0.923785245, 0.0, 0.0, -0.382910984)}
"""Pose of a Panda's hand on its last link in robosuite: ours but 0.5 mm, 0.5 mrad."""
WRIST = {
    "link": "panda_hand",
    "pos": (0.0, 0.0, 0.0),
    "quat": (0.5**0.5, 0, 0, -(0.5**0.5)),
}
"""Pose of robosuite's sensor of force and torque, which bears no link of the arm."""

ACCEPTED = dict.fromkeys(("com", "inertia"), "robosuite's; no such link can have it")


def with_passive_joints(robot: RobotDescription) -> RobotDescription:
    """Return a robot on a fixed base with robosuite's passive values in its arm."""
    if robot.root.kind != "fixed" or any(f.role == "foot" for f in robot.frames):
        return robot
    arms = [js for name, js in robot.groups.items() if name.endswith("arm")]
    if len(arms) != 1:  # Baxter has an armature of 0.01
        return robot
    rests = DAMPING.get(robot.name, (0.1,) * 9)
    friction = FRICTION.get(robot.name, 0.1)
    links = []
    for link in robot.links:
        update: dict[str, Any] = {}
        if link.joint is not None and link.joint.name in arms[0]:
            k = arms[0].index(link.joint.name)
            changes = {"armature": ARMATURE / (k + 1), "damping": rests[k]}
            changes["frictionloss"] = friction
            if robot.name in EFFORTS:
                changes["effort"] = EFFORTS[robot.name][k]
            update["joint"] = link.joint.model_copy(update=changes)
        if link.name in INERTIAS:
            mass, com, moments = INERTIAS[link.name]
            update |= {"mass": mass, "com": com, "accept": ACCEPTED}
            update["inertia"] = (*moments, 0.0, 0.0, 0.0)
        if link.name == "panda_hand":
            update |= HAND
        links.append(link.model_copy(update=update) if update else link)
    frames = robot.frames
    if any(link.name == "panda_hand" for link in links) and robot.name == "Panda":
        frames = [
            f.model_copy(update=WRIST) if f.role == "wrist" else f for f in frames
        ]
    return changed(robot, links=tuple(links), frames=tuple(frames))
