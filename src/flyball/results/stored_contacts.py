"""Contacts and sets of bodies of a result as the texts and arrays that its file holds, and back."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from .bulk import ARRAYS as OVER_TIME
from .bulk import OWN, Bulk
from .contacts import ARRAYS, Contacts
from .convergence import Convergence
from .sides import Sides

if TYPE_CHECKING:
    from .result import Result

HISTORY = ("x", "velocity", "force", "iterations")
Stored = dict[str, Any]


def packed(result: Result) -> tuple[dict[str, str], dict[str, np.ndarray]]:
    """Texts and arrays; none where there is neither contact nor a set of bodies."""
    texts: dict[str, str] = {}
    arrays: dict[str, np.ndarray] = {}
    if result.bulk:
        texts["bulk"] = json.dumps(list(result.bulk))
        for k, b in enumerate(result.bulk.values()):
            arrays |= {f"bulk_{k}_{name}": getattr(b, name) for name in (*OWN, *OVER_TIME)}
    arrays |= {f"exchanged_{name}": values for name, values in result.exchanged.items()}
    c = result.contacts
    if c is not None:
        texts["sides"] = json.dumps({"names": c.sides.names, "counts": c.sides.counts})
        arrays |= {f"contact_{name}": getattr(c, name) for name in ("begin", *ARRAYS)}
        if c.history is not None:
            texts["history"] = json.dumps({"over": c.history.over, "solver": c.history.solver})
            arrays["contact_history"] = np.array([getattr(c.history, name) for name in HISTORY], float)
    return texts, {name: np.asarray(values, float) for name, values in arrays.items()}


def unpack(stored: Stored, result: Result) -> None:
    """Give a result what its file holds of contacts and sets.

    Raises
    ------
    ValueError
        If the arrays do not fit together.
    """
    for k, name in enumerate(json.loads(stored.get("bulk", "[]"))):
        result.bulk[name] = Bulk(name, **{what: stored[f"bulk_{k}_{what}"] for what in (*OWN, *OVER_TIME)})
    prefix = "exchanged_"
    result.exchanged = {k.removeprefix(prefix): v for k, v in stored.items() if k.startswith(prefix)}
    if "sides" not in stored:
        return
    sides = json.loads(stored["sides"])
    columns = {}
    for name, (kind, _) in {"begin": ("i8", 0), **ARRAYS}.items():
        columns[name] = np.ascontiguousarray(stored[f"contact_{name}"].astype(kind))
    history = None
    if "history" in stored:
        x, velocity, force, count = stored["contact_history"]
        history = Convergence(x, velocity, force, count.astype(int), **json.loads(stored["history"]))
    planar = result.model.planar
    result.contacts = Contacts(
        t=result.t, sides=Sides(sides["names"], sides["counts"]), history=history, planar=planar, **columns
    )
