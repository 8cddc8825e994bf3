"""Infos of several environments gathered into one, in Gymnasium's form."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Info = dict[str, Any]


def gather_infos(infos: Sequence[Info]) -> Info:
    """Return one info whose values have an entry for each environment.

    Each key has a mask `_{key}`, which environments have it. Numbers and arrays become
    arrays, with zeros for environments without the key; dictionaries are gathered
    likewise; all else becomes an array of objects, and so does `final_obs`.

    Source: Gymnasium's documentation of `VectorEnv`.
    """
    gathered: Info = {}
    for key in dict.fromkeys(key for info in infos for key in info):
        has = np.array([key in info for info in infos])
        values = [info.get(key) for info in infos]
        first = values[int(has.argmax())]
        if isinstance(first, dict) and key != "final_obs":
            gathered[key] = gather_infos([value or {} for value in values])
        else:
            gathered[key] = _stacked(first, values, plain=key != "final_obs")
        gathered[f"_{key}"] = has
    return gathered


def _stacked(first: Any, values: list[Any], *, plain: bool) -> NDArray[Any]:
    if plain and isinstance(first, np.ndarray):
        empty = np.zeros_like(first)
    elif plain and isinstance(first, bool | int | float | np.number):
        empty = type(first)(0)
    else:
        stacked = np.full(len(values), None, dtype=object)
        for k, value in enumerate(values):
            stacked[k] = value
        return stacked
    return np.array([empty if value is None else value for value in values])
