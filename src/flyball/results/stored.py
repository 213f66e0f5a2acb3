"""What a result file keeps bit for bit: texts and arrays by name, in two variables of its own group.

HDF5 takes more than a millisecond for each variable and each dimension, and most of these are a few numbers.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

TEXTS, NUMBERS = "texts", "numbers"
MOST = 1 << 20  # numbers that are put together before they are written


def text_type() -> Any:
    """Of texts of any length in a file."""
    import h5py

    return h5py.string_dtype()


def put(group: Any, texts: Mapping[str, str], arrays: Mapping[str, np.ndarray]) -> None:
    """Write texts and arrays of floats to a group."""
    told = json.dumps({"texts": dict(texts), "shapes": {name: np.shape(x) for name, x in arrays.items()}})
    group.create_variable(TEXTS, (), dtype=text_type(), data=np.array(told, object))
    flat = [np.ravel(np.asarray(x, float)) for x in arrays.values()]
    group.dimensions["number"] = count = sum(map(len, flat))
    if count <= MOST:
        group.create_variable(NUMBERS, ("number",), data=np.concatenate(flat))
        return
    made, at = group.create_variable(NUMBERS, ("number",), dtype=float), 0
    for x in flat:
        made[at : at + len(x)] = x
        at += len(x)


def taken(group: Any) -> dict[str, Any]:
    """Texts and arrays of a group; from before format 4 each is a variable by itself."""
    found = {name: _read(x) for name, x in group.variables.items()}
    if NUMBERS not in found:
        return found
    told, numbers, at = json.loads(found[TEXTS]), found[NUMBERS], 0
    out: dict[str, Any] = told["texts"]
    for name, shape in told["shapes"].items():
        count = math.prod(shape)
        out[name] = numbers[at : at + count].reshape(shape)
        at += count
    return out


def _read(variable: Any) -> Any:
    if variable.dimensions == ():
        value = variable[()]
        return value.decode() if isinstance(value, bytes) else str(value)
    return np.ascontiguousarray(variable[...])
