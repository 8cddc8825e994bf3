# SciPy ships no type stubs: names that we use are Any.
from typing import Any

def __getattr__(name: str) -> Any: ...
