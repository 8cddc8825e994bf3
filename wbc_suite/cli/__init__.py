"""The command line: `wbc-suite`. One module per command; only this package prints."""

__all__ = ["main"]


def main() -> None:
    """Run the command line; what a user did wrong ends in one line and exit code 2."""
    from wbc_suite.cli.app import run

    run()
