"""The expert of Door."""

from wbc_suite.benchmark.door import HINGE, LEVER, Door
from wbc_suite.experts.scene import ExpertScene, Steps
from wbc_suite.experts.skills import follow_arc, pick, turned_about

HANDLE = "door_handle"
TURN, PULL = 1.45, 0.4  # rad, of the lever and of the hinge
TURN_SPEED, PULL_SPEED = 1.2, 0.25  # rad/s


def door(scene: ExpertScene[Door]) -> Steps[None]:
    """Grasp the lever, turn it down, and pull the door open along its arc."""
    latched = scene.benchmark.config.latch
    for _ in range(3):
        rest = scene.pose(HANDLE)
        angle = scene.data.joint(LEVER).qpos.item()
        down = (TURN - angle) * latched
        ways = [turned_about(scene, rest, LEVER, share * down) for share in (0.5, 1.0)]
        ways += [turned_about(scene, ways[-1], HINGE, a) for a in (0.5 * PULL, PULL)]
        facing = -scene.object("door").rotation[:, 1]
        choice = yield from pick(
            scene, HANDLE, then=[ways], raised=0.0, direction=facing, upright=0.7
        )
        if choice is None:
            return
        if latched:
            yield from follow_arc(scene, choice.arm, LEVER, TURN, speed=TURN_SPEED)
        if (yield from follow_arc(scene, choice.arm, HINGE, PULL, speed=PULL_SPEED)):
            return
