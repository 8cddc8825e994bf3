"""`wbc-suite teleop`: move a simulated robot in the browser."""

import sys
from typing import Annotated

import typer

from wbc_suite.cli.options import (
    BaseOption,
    CatalogueOption,
    GripperOption,
    SkinOption,
    chosen,
)
from wbc_suite.cli.serving import HostOption, PortOption, serve_until_interrupted

__all__ = ["teleop"]

ONE_DAY = 86_400  # s; nobody's session is cut off by the benchmark's horizon
SWITCH_INTERVAL = 1e-3  # s; Python's own 5 ms would hold the loop up for the page


def teleop(
    benchmark: Annotated[str, typer.Argument(help="Benchmark to play in.")] = "Lift",
    robots: Annotated[str, typer.Option(help="Robot.")] = "GR1",
    controller: Annotated[
        str, typer.Option(help="Whole-body controller, by name or TOML file.")
    ] = "WHOLE_BODY_IK",
    rate: Annotated[
        float, typer.Option(help="Targets taken per second, Hz.", min=5.0, max=200.0)
    ] = 100.0,
    gripper: GripperOption = None,
    base: BaseOption = None,
    skin: SkinOption = None,
    seed: Annotated[int, typer.Option(help="Seed of the scene.")] = 0,
    host: HostOption = "127.0.0.1",
    port: PortOption = None,
    catalogue: CatalogueOption = None,
) -> None:
    """Move a robot's hands, head, feet and base by dragging them in a web page."""
    import wbc_suite
    from wbc_suite.viewers.site import Site
    from wbc_suite.viewers.teleop_page import TeleopPage
    from wbc_suite.viewers.teleop_session import TeleopSession

    sys.setswitchinterval(SWITCH_INTERVAL)
    print(f"Building {benchmark} with {robots} ...", flush=True)
    env = wbc_suite.make(
        benchmark,
        robots=robots,
        controller_configs=controller,
        gripper_types=chosen(gripper),
        base_types=base,
        control_freq=rate,
        horizon=round(ONE_DAY * rate),
        skin=skin,
    )
    session = TeleopSession(env, period=1.0 / rate, seed=seed)
    print("Compiling; this takes a few seconds the first time ...", flush=True)
    session.tick()
    page = TeleopPage(session, Site(host, port), label=f"{robots} · {benchmark}")
    page.start()
    session.start()
    try:
        serve_until_interrupted(page.site, f"Teleoperation of {robots}, {benchmark}:")
    finally:
        session.stop()
        page.stop()
        env.close()
