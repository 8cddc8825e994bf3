"""Timing of teleoperation: latency from input to joint targets, and jitter.

A session runs at 100 Hz as `wbc-suite teleop` does, with its page served, two viewers
connected and an episode being recorded, while one of them drags a hand: an input every
4 to 20 milliseconds, at random times. Viewers are clients that take all that the page
sends, in a process of their own: a browser without a graphics card would take the
processors that are measured.

Reported, in ms:

- latency: from an input's arrival at the page to the joint targets that follow from it
  (bounds: median 20, 99th percentile 50)
- jitter: by how much a period differs from 10 ms, from one step's beginning to the next
  one's (bound: 99th percentile 1)
- targets: the same from one step's joint targets to the next one's, which are found at
  the end of the controller's work
- behind: how late a step begins, which does not add up (in the JSON)
- bare: jitter of a process at the same rate that does nothing else, meanwhile: what the
  machine can do
- load: processes waiting for a processor, per processor, when the run begins; above 1
  the machine is shared, and wall times say more about other work than about this
- grown: memory that the processes of session and page hold more at the end than at the
  beginning, MB (bound: 50 in ten minutes, `--seconds 600`)
- kept: the same once the episode is in its file
- stolen: of the processors' time, what went to other machines on the same one, per cent
- quiet: jitter in those seconds in which nothing was stolen, and their number: what is
  the session's own, where `stolen` is above 1 and `bare` as large as `jitter`

Usage: python benchmarks/teleop_loop.py [--quick] [--json FILE] [--seconds S]
"""

import asyncio
import contextlib
import multiprocessing
import os
import tempfile
import time
from collections import deque
from pathlib import Path

from harness.memory import resident
from harness.processors import processor_times, stolen_time
from harness.report import Report, options

import numpy as np  # isort: skip  (after harness: it sets the number of BLAS threads)

import pinocchio as pin

import wbc_suite
from wbc_suite.recording.episode_control import EpisodeCommand, EpisodeControl
from wbc_suite.viewers.loop_timing import (
    LoopTimer,
    prepare_interpreter,
    raise_priority,
)
from wbc_suite.viewers.page_process import PageProcess
from wbc_suite.viewers.teleop_session import TeleopSession
from wbc_suite.wrappers import DataCollection

RATE = 100.0  # Hz
ROBOTS = ("Panda", "GR1")
VIEWERS = 2
COLUMNS = (
    "case",
    "latency_median_ms",
    "latency_p99_ms",
    "jitter_p99_ms",
    "targets_p99_ms",
    "bare_p99_ms",
    "quiet_p99_ms",
    "quiet_seconds",
    "grown_mb",
    "kept_mb",
    "load",
    "stolen",
)
CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (2.0, 0.0, 1.5),
    "fov": 1.0,
    "near": 0.01,
    "far": 100.0,
    "image_height": 600,
    "image_width": 960,
    "look_at": (0.0, 0.0, 1.0),
    "up_direction": (0.0, 0.0, 1.0),
}
"""What a browser says first; viser's clients count from then on."""

SETTLE = 1.0  # s; the first ticks fill caches


class Clock:
    """Notes when a session's steps begin and have targets, and what inputs took."""

    def __init__(self, env, session):
        self.begun, self.found, self.latencies = [], [], []
        step = env.step

        def noted_step(action):
            self.begun.append(time.perf_counter())
            result = step(action)
            self.found.append(time.perf_counter())
            return result

        env.step = noted_step
        session._times._latencies = Latencies(self.latencies)


class Latencies(deque):
    """The session's newest latencies, which are copied to a list of all."""

    def __init__(self, copies):
        super().__init__(maxlen=512)
        self.copies = copies

    def extend(self, latencies):
        """Append latencies of one tick, s."""
        found = list(latencies)
        self.copies.extend(found)
        super().extend(found)


class Metronome:
    """A process that sleeps at the session's rate, and notes how well it is woken.

    Once a second it notes what was stolen from the processors.
    """

    def __init__(self):
        make = multiprocessing.get_context("spawn")
        self.pipe, theirs = make.Pipe()
        self.process = make.Process(target=self.run, args=(theirs,), daemon=True)
        self.process.start()
        self.pipe.recv()  # it is there

    def stop(self):
        """Return when it was woken, and rows of a time and what was stolen so far."""
        self.pipe.send("stop")
        woken, stolen = map(np.array, self.pipe.recv())
        self.process.join()
        return woken, stolen

    @staticmethod
    def run(pipe):
        """Be the metronome, in its own process."""
        raise_priority(rank=2)
        pipe.send("ready")
        timer, woken, stolen = LoopTimer(1.0 / RATE), [], []
        timer.start()
        while not pipe.poll():
            timer.wait_for_step()
            woken.append(time.perf_counter())
            if len(woken) % int(RATE) == 0:
                stolen.append((time.perf_counter(), stolen_time()))
            timer.finish_step()
        pipe.send((woken, stolen))


class Viewer:
    """A client of the page, in a process of its own: what a browser would be."""

    def __init__(self, page, number):
        make = multiprocessing.get_context("spawn")
        self.ready, self.stop = make.Event(), make.Event()
        self.number, self.url = number, page.url.rstrip("/")

    def start(self, T_hand=None):
        """Connect, and wait until the page answers; drag the hand if it is given."""
        make = multiprocessing.get_context("spawn")
        self.process = make.Process(target=self.run, args=(T_hand,), daemon=True)
        self.process.start()
        if not self.ready.wait(60.0):
            raise RuntimeError(f"viewer {self.number} did not connect")

    def run(self, T_hand):
        """Be the viewer, in its own process."""
        asyncio.run(self.view(T_hand))

    async def view(self, T_hand):
        """Take what the page sends, and throw it away; drag meanwhile."""
        import viser
        from websockets.asyncio.client import connect
        from websockets.typing import Subprotocol

        async with connect(
            self.url.replace("http", "ws"),
            origin=self.url,
            max_size=None,
            subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
        ) as socket:
            await say(socket, CAMERA)
            dragging = asyncio.ensure_future(self.drag(socket, T_hand))
            while not self.stop.is_set():
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(socket.recv(), 0.2)
            await dragging

    async def drag(self, socket, T_hand):
        """Drag a hand about where it is, at random times."""
        await asyncio.sleep(SETTLE)  # until the page has made this client's handles
        self.ready.set()
        if T_hand is None:
            return
        rng = np.random.default_rng(0)
        handle = {"name": "/gizmos/right_hand", "owner": str(self.number)}
        await say(socket, handle | {"type": "TransformControlsDragStartMessage"})
        begun = time.perf_counter()
        while not self.stop.is_set():
            await asyncio.sleep(rng.uniform(0.004, 0.02))
            since = time.perf_counter() - begun
            place = T_hand.translation.copy()
            place[2] += 0.05 * np.sin(2.0 * since)
            pose = {"position": place.tolist(), "wxyz": wxyz(T_hand)}
            moved = {"type": "TransformControlsUpdateMessage"}
            await say(socket, handle | pose | moved)
        await say(socket, handle | {"type": "TransformControlsDragEndMessage"})


async def say(socket, message):
    """Send a message as a browser packs it."""
    import msgspec

    await socket.send(msgspec.msgpack.encode(message))


def wxyz(T):
    """Return a pose's quaternion."""
    return np.roll(pin.Quaternion(T.rotation).coeffs(), 1).tolist()


def measure(robot, seconds, folder):
    """Return one row."""
    env = wbc_suite.make(
        "Lift",
        robots=robot,
        controller_configs="WHOLE_BODY_IK",
        control_freq=RATE,
        horizon=10**7,
    )
    collection = DataCollection(env, folder / f"{robot}.hdf5", automatic=False)
    episode_control = EpisodeControl(collection.recorder)
    session = TeleopSession(
        collection, period=1.0 / RATE, episode_control=episode_control
    )
    clock = Clock(collection, session)
    page = PageProcess("127.0.0.1", 0, label=robot)
    session.tick()
    page.attach(session)
    prepare_interpreter()
    session.start(urgent=True)
    viewers = [Viewer(page, number) for number in range(VIEWERS)]
    hand = session.snapshot.limbs["right_hand"].target
    for viewer in viewers:
        viewer.start(hand if viewer.number == 0 else None)
    episode_control.request(EpisodeCommand.RECORD)
    while not session.snapshot.recording.recording:
        time.sleep(0.01)
    metronome, load = Metronome(), os.getloadavg()[0] / (os.cpu_count() or 1)
    time.sleep(SETTLE)
    first, before = (len(clock.begun), len(clock.latencies)), processor_times()
    held = memory()
    time.sleep(seconds)
    begun, found = (np.array(times[first[0] :]) for times in (clock.begun, clock.found))
    latencies, spent = clock.latencies[first[1] :], processor_times() - before
    (woken, stolen), grown = metronome.stop(), memory() - held
    episode_control.request(EpisodeCommand.RECORD)
    while session.snapshot.recording.recording:
        time.sleep(0.01)
    kept = memory() - held
    for viewer in viewers:
        viewer.stop.set()
        viewer.process.join()
    session.stop()
    page.stop()
    collection.close()
    behind = begun - begun[0] - np.arange(len(begun)) / RATE
    row = {"case": f"Lift/{robot}", "side": "ours", "inputs": len(latencies)}
    row |= figures("latency", latencies)
    row |= figures("jitter", jitter(begun))
    row |= figures("targets", jitter(found))
    row |= figures("behind", behind - behind.min())
    row |= figures("bare", jitter(woken[woken > begun[0]]))
    row |= quiet_figures(begun, stolen)
    row |= {"grown_mb": grown, "kept_mb": kept, "load": load, "seconds": seconds}
    return row | {"stolen": 100.0 * spent[-1] / spent.sum()}


def jitter(times):
    """Return by how much each period differs from the nominal one, s."""
    return np.abs(np.diff(times) - 1.0 / RATE)


def quiet_figures(begun, stolen):
    """Return the jitter of periods in seconds without stolen time, and these seconds.

    The times are kept in hundredths of a second: less than one may go unseen.
    """
    seconds = np.searchsorted(stolen[:, 0], begun) - 1  # in which each period ends
    quiet = np.append(np.diff(stolen[:, 1]) == 0.0, False)  # the last is not whole
    counts = (seconds[:-1] >= 0) & quiet[seconds[1:]]
    found = figures("quiet", jitter(begun)[counts]) if counts.any() else {}
    return found | {"quiet_seconds": int(counts.sum() / RATE)}


def memory():
    """Return the memory that this process and the page's hold, MB."""
    (page,) = (p for p in multiprocessing.active_children() if p.name == "page")
    return resident() + resident(page.pid)


def figures(name, times):
    """Return median and 99th percentile, ms."""
    found = 1e3 * np.asarray(times)
    return {
        f"{name}_median_ms": float(np.median(found)),
        f"{name}_p99_ms": float(np.percentile(found, 99)),
    }


def main():
    """Run from the command line."""
    parser = options(__doc__, "4 s each")
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS))
    arguments = parser.parse_args()
    seconds = 4.0 if arguments.quick else arguments.seconds
    report = Report()
    with tempfile.TemporaryDirectory() as folder:
        for robot in arguments.robots:
            report.rows.append(measure(robot, seconds, Path(folder)))
    report.show("Teleoperation at 100 Hz, two viewers, recording", COLUMNS)
    report.write(arguments.json)


if __name__ == "__main__":
    main()
