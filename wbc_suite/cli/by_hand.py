"""What `teleop` and `record --device` share: a session, its device, its page."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from wbc_suite.cli.options import device_options
from wbc_suite.cli.serving import serve_until_interrupted

if TYPE_CHECKING:
    import gymnasium

    from wbc_suite.devices import Device, PipelineConfig
    from wbc_suite.recording.desk import RecordingDesk

__all__ = ["DeviceMaker", "device_maker", "drive", "stages_of"]

ONE_DAY = 86_400  # s; nobody's session is cut off by the benchmark's horizon
GLANCE = 0.2  # s; between looks at whether a session without a page still runs

DeviceMaker = Callable[["gymnasium.Env[Any, Any]"], "Device"]


def device_maker(name: str, pairs: list[str] | None) -> DeviceMaker:
    """Return what makes a device, for the scene that it drives in.

    Args:
        name: See `find_device`.
        pairs: Its options, `NAME=VALUE`.
    """
    from wbc_suite.devices import find_device

    make, options = find_device(name), device_options(pairs)

    def build(env: "gymnasium.Env[Any, Any]") -> "Device":
        if name.lower() == "mjgui":
            options["env"] = env  # it shows the scene
        return make(**options)

    return build


def stages_of(*, device: bool, scale: float, mirror: bool) -> "PipelineConfig":
    """Return the pipeline's stages, with a leash for who uses a device."""
    from wbc_suite.devices.pipeline.config import Leash
    from wbc_suite.viewers.teleop_session import DRAGGED

    changes: dict[str, object] = {"mirror": mirror, "scale": scale}
    if device:
        changes["leash"] = Leash()
    return DRAGGED.model_copy(update=changes)


def drive(
    env: "gymnasium.Env[Any, Any]",
    *,
    names: tuple[str, str],
    rate: float,
    seed: int,
    address: tuple[str, int | None] | None,
    device: "Device | None",
    stages: "PipelineConfig",
    desk: "RecordingDesk | None",
) -> None:
    """Let people drive until somebody ends it, or all that was planned is recorded.

    Args:
        env: Environment, made; the caller closes it.
        names: Robot and benchmark, for people.
        rate: Actions per second, Hz.
        seed: Of every reset but those of recordings.
        address: Where the page is served, host and port; None for a device alone.
        device: What people move beside the page.
        stages: Between people and the controller.
        desk: What records.
    """
    from wbc_suite.viewers.keeping_time import calm_python
    from wbc_suite.viewers.page_process import PageProcess
    from wbc_suite.viewers.teleop_session import TeleopSession

    session = TeleopSession(
        env, period=1.0 / rate, seed=seed, device=device, pipeline=stages, desk=desk
    )
    robots, benchmark = names
    page = None
    try:
        if address is not None:  # it gets ready while the controllers are compiled
            label = f"{robots} · {benchmark}"
            page = PageProcess(session, *address, label=label)
        if device is not None:
            device.start()
        print("Compiling; this takes a few seconds the first time ...", flush=True)
        session.tick()
        if page is not None:
            page.wait()
        calm_python()
        session.start(urgent=True)
        print(getattr(device, "help", ""), end="", flush=True)
        if page is None:
            while session.running and not session.quit.wait(GLANCE):
                pass
        else:
            title = f"Teleoperation of {robots}, {benchmark}:"
            serve_until_interrupted(page, title, until=session.quit)
            page.check()
    finally:
        session.stop()
        if page is not None:
            page.stop()
        if device is not None:
            device.stop()
