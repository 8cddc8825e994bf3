"""Cost of one camera image, compared with robosuite.

Pictures of one camera of Lift, 84 x 84 and 256 x 256: colours, depth (metres) and
segmentation, each with its own default quality, drawn by the same OpenGL backend.
Blocks of 8 pictures of both sides alternate in one run; robosuite runs in its own
environment (.venv-robosuite, `make bench-peers`) and is left out where it is missing.
Times are CPU times of the process, with all threads that draw; pictures a second are
those of the wall clock.

Usage: python benchmarks/cameras.py [--quick] [--json FILE] [--blocks N]
"""

import os
import sys

from harness.report import Report, options
from harness.robosuite import Robosuite

import wbc_suite
from wbc_suite.sensing import gl_backend
from wbc_suite.timing import Frames, time_frames

FRAMES = 8  # of one block
SIZES, KINDS = (84, 256), ("image", "depth", "segmentation")
COLUMNS = ("case", "side", "median_us", "p99_us", "frames_per_second", "n")


class Ours:
    """This project's environment."""

    def __init__(self, robot: str) -> None:
        self.env = wbc_suite.make("Lift", robots=robot)
        self.env.reset(seed=0)

    def block(self, kind: str, size: int) -> Frames:
        take = getattr(self.env.cameras, kind)
        more = {"level": "instance"} if kind == "segmentation" else {}
        return time_frames(
            FRAMES, lambda: take("agentview", width=size, height=size, **more)
        )


class Theirs:
    """robosuite's environment."""

    def __init__(self, robot: str, peer: Robosuite) -> None:
        self.peer = peer
        peer.ask("make", robot=robot, controller="OSC_POSE", pictures=True)

    def block(self, kind: str, size: int) -> Frames:
        answer = self.peer.ask("frames", kind=kind, size=size, count=FRAMES)
        return Frames(**answer)


def run(robot: str, peer: Robosuite | None, report: Report, *, blocks: int) -> None:
    """Time both sides, block by block in turns."""
    sides = {"ours": Ours(robot)}
    if peer is not None:
        sides["robosuite"] = Theirs(robot, peer)
    for size in SIZES:
        for kind in KINDS:
            case = f"Lift/{robot}/{kind}/{size}"
            found = {name: Frames() for name in sides}
            for side in sides.values():
                side.block(kind, size)  # makes the renderer
            for k in range(blocks):
                for name in list(sides)[:: 1 if k % 2 else -1]:
                    found[name].extend(sides[name].block(kind, size))
            rows = {
                name: report.add(
                    case, name, frames.cpu, frames_per_second=frames.per_second
                )
                for name, frames in found.items()
            }
            if peer is not None:
                report.compare(f"{case}/robosuite", rows["ours"], rows["robosuite"])
                rates = [rows[name]["frames_per_second"] for name in sides]
                report.ratios[f"{case}/robosuite/wall"] = rates[1] / rates[0]


def main() -> None:
    parser = options(__doc__, "Panda alone, 2 blocks of 8 pictures")
    parser.add_argument("--blocks", type=int, default=10, help="of each side")
    arguments = parser.parse_args()
    blocks = 2 if arguments.quick else arguments.blocks
    os.environ.setdefault("MUJOCO_GL", gl_backend.activate().name)  # for the peer
    report, peer = Report(), Robosuite.find()
    if peer is None:
        print("robosuite is left out: make bench-peers", file=sys.stderr)
    else:
        report.versions |= peer.versions
    for robot in ("Panda",) if arguments.quick else ("Panda", "GR1"):
        run(robot, peer, report, blocks=blocks)
    if peer is not None:
        peer.close()
    report.show("One picture, us of CPU time", COLUMNS)
    report.show_ratios()
    report.write(arguments.json)


if __name__ == "__main__":
    main()
