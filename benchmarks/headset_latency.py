"""Latency of the headset: from sending a frame to the resulting joint targets.

A session runs at 100 Hz as `wbc-suite teleop --device headset` does. A client in a
process of its own sends frames of two tracked hands 90 times a second, with
`time.perf_counter` as their time, and receives the view. The latency ends with the step
that used the frame.

Reported, in ms: median, 99th percentile (bounds: 20 and 50) and maximum.

Usage: python benchmarks/headset_latency.py [--quick] [--json FILE]
"""

import math
import multiprocessing
import threading
import time

from harness.report import Report, options
from websockets.sync.client import connect

import numpy as np  # isort: skip  (after harness: it sets the number of BLAS threads)

import wbc_suite
from wbc_suite.devices import PipelineConfig
from wbc_suite.devices.headset import Headset
from wbc_suite.devices.pose_frame import Pose, PoseFrame, PoseLimb
from wbc_suite.devices.stream_client import StreamClient
from wbc_suite.viewers.headset_view import SessionView
from wbc_suite.viewers.loop_timing import prepare_interpreter
from wbc_suite.viewers.teleop_session import TeleopSession

RATE, SENT = 100.0, 90.0  # Hz
COLUMNS = ("case", "frames", "median_ms", "p99_ms", "max_ms")
HAND = [(0.02 * (k % 5), 0.02 * (k // 5), 0.001 * k) for k in range(25)]


def wear(url: str, seconds: float) -> None:
    """Send frames of two hands that move in circles, and take what is displayed."""
    with StreamClient(url) as client:
        view = connect(url.replace("http", "ws", 1) + "frames", compression=None)
        threading.Thread(target=lambda: list(view), daemon=True).start()
        began = time.perf_counter()
        while (now := time.perf_counter()) < began + seconds:
            turn = 2.0 * math.pi * 0.3 * (now - began)
            place = (0.05 * math.cos(turn), 0.05 * math.sin(turn), 1.0)
            limb = PoseLimb(
                pose=Pose(position=place, orientation=(1.0, 0.0, 0.0, 0.0)),
                fingers=HAND,
            )
            client.send(
                PoseFrame(
                    format="wbc-pose-frame/1",
                    time=now,
                    limbs={"right": limb, "left": limb},
                )
            )
            time.sleep(max(0.0, now + 1.0 / SENT - time.perf_counter()))


def measure(robot: str, seconds: float) -> dict[str, object]:
    """Return latencies of one robot."""
    env = wbc_suite.make(
        "Lift",
        robots=robot,
        controller_configs="WHOLE_BODY_IK",
        control_freq=RATE,
        horizon=10**7,
    )
    device = Headset(port=0)
    device.start()
    session = TeleopSession(
        env, period=1.0 / RATE, device=device, pipeline=PipelineConfig()
    )
    session.tick()
    device.show(SessionView(session, robot))
    latencies, used, read, step = [], [0.0], device.read, env.step

    def noted_step(action: np.ndarray) -> object:
        result = step(action)
        sent = read_state[0]
        if sent > used[0]:
            latencies.append(time.perf_counter() - sent)
            used[0] = sent
        return result

    read_state = [0.0]

    def noted_read() -> object:
        state = read()
        read_state[0] = state.time
        return state

    device.read, env.step = noted_read, noted_step
    prepare_interpreter()
    session.start(urgent=True)
    make = multiprocessing.get_context("spawn")
    wearer = make.Process(target=wear, args=(device.url, seconds))
    wearer.start()
    wearer.join()
    session.stop()
    device.stop()
    times = 1e3 * np.array(latencies[round(RATE) :])  # the first second fills caches
    return {
        "case": robot,
        "frames": len(times),
        "median_ms": float(np.median(times)),
        "p99_ms": float(np.percentile(times, 99)),
        "max_ms": float(times.max()),
    }


def main() -> None:
    """Measure GR1 and Panda."""
    arguments = options(__doc__, "10 s each, not 60").parse_args()
    report = Report()
    for robot in ("GR1", "Panda"):
        report.rows.append(measure(robot, 10.0 if arguments.quick else 60.0))
    report.show("Headset to joint targets at 100 Hz, ms", COLUMNS)
    report.write(arguments.json)


if __name__ == "__main__":
    main()
