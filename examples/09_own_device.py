"""Define a device: three numbers in a UDP packet move the hand of a robot.

Any program can send such packets. A device has three methods and needs no base class.

    PYTHONPATH=examples wbc-suite teleop --robots Panda --device 09_own_device:UdpStick
"""

import contextlib
import socket
import time

import numpy as np

import wbc_suite
from wbc_suite.devices import DeviceState, LimbInput, Pipeline, PipelineConfig, drive

SPEED = 0.2  # m/s at full deflection


class UdpStick:
    """Receives packets like `b"0.5 0 -1"`: forward, left and up, each from -1 to 1."""

    def start(self) -> None:
        """Listen on this machine."""
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)
        self.state = DeviceState(time=0.0)

    def read(self) -> DeviceState:
        """Read the newest packet; without one, return the last state."""
        with contextlib.suppress(BlockingIOError):
            while True:
                values = [float(word) for word in self.socket.recv(64).split()]
                twist = np.array([*values, 0.0, 0.0, 0.0]) * SPEED
                hand = LimbInput(twist=twist)
                self.state = DeviceState(time=time.monotonic(), limbs={"hand": hand})
        return self.state

    def stop(self) -> None:
        """Close the socket."""
        self.socket.close()


def main() -> None:
    """Lift the hand for a second, then stop sending: the watchdog holds it."""
    env = wbc_suite.make("Lift", robots="Panda", controller_configs="OSC_POSE")
    stick, pipeline = UdpStick(), Pipeline(env, PipelineConfig(ramp=0.0))
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    steps, report = 0, ""

    def act(_: DeviceState, __: dict[str, object]) -> None:
        nonlocal steps, report
        steps += 1
        if steps <= 20:  # one second at 20 Hz
            sender.sendto(b"0 0 1", stick.socket.getsockname())
        report = ", ".join(pipeline.acting.get("device", ()))

    drive(env, stick, pipeline, steps=40, real_time=False, on_step=act)
    sender.close()
    hand = pipeline.limbs["right"]
    rise = hand.port.measure().translation[2] - hand.home.translation[2]
    print(f"The hand rose by {100 * rise:.0f} cm.")
    print(f"Then the pipeline reported: {report}.")
    env.close()


if __name__ == "__main__":
    main()
