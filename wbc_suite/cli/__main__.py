"""`python -m wbc_suite.cli` does what `wbc-suite` does."""

from wbc_suite.cli import main

main()
