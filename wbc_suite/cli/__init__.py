"""The command line: `wbc-suite`. One module per command; only this package prints."""

__all__ = ["main"]


def main() -> None:
    """Run the command line; what a user did wrong ends in one line and exit code 2.

    Ctrl-C ends it with 130, SIGTERM with 143.
    """
    from wbc_suite.cli.interrupts import signals_end_the_process

    with signals_end_the_process():
        from wbc_suite.cli.app import run

        run()
