# Pinocchio ships no type stubs: every name is Any, so that strict checking of our
# own code stays meaningful.
from typing import Any

def __getattr__(name: str) -> Any: ...
