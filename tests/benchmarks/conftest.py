"""The scripts' own modules are importable, as they are when a script runs."""

import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
for folder in ("benchmarks", "docs"):
    sys.path.insert(0, str(ROOT / folder))
