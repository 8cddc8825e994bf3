"""All commands put together.

Command modules import what is heavy inside their functions, so that help is instant.
"""

import os
import sys
from typing import Annotated

import typer

from wbc_suite import __version__
from wbc_suite.cli import (
    adopt,
    bench,
    catalogue,
    datasets,
    demo,
    doctor,
    dress,
    evaluate,
    expert,
    multiply,
    record,
    replay,
    robots,
    teleop,
)
from wbc_suite.cli.output import print
from wbc_suite.errors import WbcError
from wbc_suite.sensing import gl_backend

app = typer.Typer(
    name="wbc-suite",
    help="Whole-body control of robots: describe, view, teleoperate, benchmark.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("teleop")(teleop.teleop)
app.command("view")(robots.view)
app.command("demo")(demo.demo)
app.command("adopt")(adopt.adopt)
app.command("record")(record.record)
app.command("multiply")(multiply.multiply)
app.command("replay")(replay.replay)
app.command("inspect")(datasets.inspect)
app.command("verify")(datasets.verify)
app.command("repair")(datasets.repair)
app.command("merge")(datasets.merge)
app.command("split")(datasets.split)
app.command("filter")(datasets.filter_episodes)
app.command("extract")(datasets.extract)
app.command("convert")(datasets.convert)
app.command("list")(catalogue.list_catalogue)
app.command("render")(robots.render)
app.command("dress")(dress.dress)
app.command("expert")(expert.expert)
app.command("evaluate")(evaluate.evaluate)
app.command("serve-policy")(evaluate.serve_policy)
app.command("bench")(bench.bench)
app.command("check")(catalogue.check_file)
app.command("export")(robots.export_robot)
app.command("schema")(catalogue.print_schema)
app.command("describe-action")(robots.describe_action)
app.command("doctor")(doctor.doctor)


def _show_version(asked: bool) -> None:
    if asked:
        print(f"wbc-suite {__version__}")
        raise typer.Exit


LOADS = (
    *("teleop", "view", "demo", "adopt", "record", "multiply", "replay", "render"),
    *("dress", "expert", "evaluate", "serve-policy", "bench"),
)
"""Commands that import for a second before they have something to say."""


@app.callback()
def _options(
    context: typer.Context,
    *,
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Show the version.", is_eager=True, callback=_show_version
        ),
    ] = False,
) -> None:
    del version  # its callback has answered
    asks_help = not {"-h", "--help"}.isdisjoint(sys.argv)
    if context.invoked_subcommand in LOADS and sys.stderr.isatty() and not asks_help:
        print("Loading ...", file=sys.stderr, flush=True)


def run() -> None:
    """Run the command that the arguments name."""
    libraries = gl_backend.missing_environment()
    if libraries:  # they are found only if they are known when Python starts
        arguments = [sys.executable, *sys.orig_argv[1:]]
        os.execve(sys.executable, arguments, os.environ | libraries)
    try:
        app()
    except WbcError as error:
        print(f"wbc-suite: {error}", file=sys.stderr)
        sys.exit(2)
