"""All commands put together.

Command modules import what is heavy inside their functions, so that help is instant.
"""

import sys
from typing import Annotated

import typer

from wbc_suite import __version__
from wbc_suite.cli import (
    bench,
    check,
    convert,
    datasets,
    demo,
    describe_action,
    doctor,
    export,
    inspect,
    listing,
    record,
    render,
    replay,
    rollout,
    schema,
    teleop,
    view,
)
from wbc_suite.errors import WbcError

__all__ = ["app", "run"]

app = typer.Typer(
    name="wbc-suite",
    help="Whole-body control of robots: describe, look at, teleoperate, benchmark.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("teleop")(teleop.teleop)
app.command("view")(view.view)
app.command("demo")(demo.demo)
app.command("record")(record.record)
app.command("replay")(replay.replay)
app.command("inspect")(inspect.inspect)
app.command("verify")(datasets.verify)
app.command("repair")(datasets.repair)
app.command("merge")(datasets.merge)
app.command("split")(datasets.split)
app.command("filter")(datasets.filter_episodes)
app.command("extract")(convert.extract)
app.command("convert")(convert.convert)
app.command("list")(listing.list_catalogue)
app.command("render")(render.render)
app.command("rollout")(rollout.rollout)
app.command("bench")(bench.bench)
app.command("check")(check.check_file)
app.command("export")(export.export_robot)
app.command("schema")(schema.print_schema)
app.command("describe-action")(describe_action.describe_action)
app.command("doctor")(doctor.doctor)


def _show_version(asked: bool) -> None:
    if asked:
        print(f"wbc-suite {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    *,
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Show the version.", is_eager=True, callback=_show_version
        ),
    ] = False,
) -> None:
    del version  # its callback has answered


def run() -> None:
    """Run the command that the arguments name."""
    try:
        app()
    except WbcError as error:
        print(f"wbc-suite: {error}", file=sys.stderr)
        sys.exit(2)
