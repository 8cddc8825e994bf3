"""`wbc-suite doctor`: explain this machine."""

import typer

__all__ = ["doctor"]

_MARKS = {"fine": "ok  ", "optional": "note", "broken": "BAD "}


def doctor() -> None:
    """Explain this machine: what draws, what solves, what is missing, what mends it.

    Ends with exit code 1 when something that is needed is broken.
    """
    from wbc_suite.cli.diagnosis import State, diagnose

    broken = 0
    for finding in diagnose():
        print(f"{_MARKS[finding.state]}  {finding.topic:<11} {finding.text}")
        if finding.cure:
            print(f"      {'':<11} -> {finding.cure}")
        broken += finding.state is State.BROKEN
    if broken:
        print("Something that is needed is broken: see BAD above.")
        raise typer.Exit(1)
    print("All that is needed is here.")
