"""The page of deviations is that of the files."""

import runpy
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_lists_every_deviation_of_the_files():
    text = runpy.run_path(str(DOCS / "write_deviations.py"))["text"]()
    assert (DOCS / "deviations.md").read_text(encoding="utf-8") == text, (
        "run python docs/write_deviations.py"
    )
    assert "15.2" in text  # Spot's trunk, the largest of them
