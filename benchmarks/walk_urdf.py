"""Legged robots from URDF files: stand, then walk forward.

A robot stands for two seconds on the floor of Lift and walks for ten. Its collision
shapes are those of the file; meshes are used where they are found. Without a file it is
Spot, exported to URDF.

Usage: python benchmarks/walk_urdf.py [FILE ...] [--controller FILE] [--speed 0.5]
"""

import logging
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from harness.report import Report, options

import wbc_suite
from wbc_suite.errors import WbcError
from wbc_suite.robot import load_robot

STAND, WALK = 2.0, 10.0  # s
PERIOD = 0.05  # s between two actions
COLUMNS = ("case", "mass_kg", "stood_mm", "walked_m", "aside_m", "fell")


def walk(
    file: Path, controller: str, *, speed: float, seconds: float
) -> dict[str, Any]:
    """Stand and walk; return what happened."""
    robot = load_robot(file, root="free")
    env = wbc_suite.make(
        "Lift", robots=robot, controller_configs=controller, horizon=100_000
    )
    env.reset(seed=0)
    stand = env.hold_action
    # The table of Lift is in front.
    go = env.action_layout.pack({"walk": [-speed, 0.0, 0.0]}, base=stand)
    data, trunk = env.simulation.data, f"robot0_{robot.links[0].name}"
    info: dict[str, Any] = {}
    ways = [data.body(trunk).xpos.copy()]
    for action, duration in ((stand, STAND), (go, seconds)):
        for _ in range(round(duration / PERIOD)):
            *_, info = env.step(action)
        ways.append(data.body(trunk).xpos.copy())
    env.close()
    stood, walked = ways[1] - ways[0], ways[2] - ways[1]
    return {
        "case": file.stem,
        "side": Path(controller).stem,
        "mass_kg": robot.mass,
        "stood_mm": 1e3 * float(np.linalg.norm(stood[:2])),
        "walked_m": -float(walked[0]),
        "aside_m": abs(float(walked[1])),
        "fell": info["balance"]["fell"] or "no",
    }


def main() -> None:
    parser = options(__doc__, "2 s of walking")
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--controller", default="WHOLE_BODY_ID")
    parser.add_argument("--speed", type=float, default=0.5)
    arguments = parser.parse_args()
    logging.getLogger("wbc_suite").setLevel(logging.ERROR)
    seconds, report = 2.0 if arguments.quick else WALK, Report()
    with tempfile.TemporaryDirectory() as folder:
        spot = Path(folder) / "spot.urdf"
        spot.write_text(load_robot("Spot").to_urdf(), encoding="utf-8")
        for file in arguments.files or [spot]:
            try:
                row = walk(
                    file, arguments.controller, speed=arguments.speed, seconds=seconds
                )
            except WbcError as error:
                print(f"{file}: {error}")
                continue
            report.rows.append(row)
    report.show("On their own feet", COLUMNS)
    report.write(arguments.json)


if __name__ == "__main__":
    main()
