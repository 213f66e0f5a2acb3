"""Results read back from the files that `flyball.results.files` writes; nothing is simulated."""

from __future__ import annotations

import json
import os
from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar

import numpy as np

from ..errors import ModelError
from ..model.model import Model, suggest
from .departure import Departure
from .files import ARRAYS, FORMAT, GROUP
from .health import Health
from .result import Result

M = TypeVar("M", bound=Model)


def load_result(path: str | os.PathLike, cls: type[M]) -> Result:
    """Rebuild a result, its mechanism being of class ``cls``; nothing is simulated and nothing compiled.

    Raises
    ------
    ModelError
        If there is no such file, or it is no result of flyball.
    """
    path = Path(path)
    if not path.is_file():
        there = [p.name for p in path.parent.glob("*.nc")] if path.parent.is_dir() else []
        raise ModelError(f"there is no file {os.fspath(path)!r}{suggest(path.name, there)}")
    stored = _stored(path)
    return _rebuilt(stored, cls, os.fspath(path))


def _stored(path: Path) -> dict[str, Any]:
    """Texts and arrays of the file's own group."""
    import h5netcdf

    remedy = "give a file that Result.save or 'flyball run' wrote"
    try:
        with h5netcdf.File(path, "r") as file:
            if GROUP not in file.groups:
                raise ModelError(f"{path} is no result of flyball (it holds no group {GROUP!r}); {remedy}")
            group = file.groups[GROUP]
            if int(group.attrs["format"]) > FORMAT:
                raise ModelError(f"{path} was written by flyball {group.attrs['version']}, a later version than this")
            return {k: _read(v) for k, v in group.variables.items()}
    except (OSError, KeyError) as error:
        raise ModelError(f"{path} cannot be read as a NetCDF result ({error}); {remedy}") from None


def _read(variable: Any) -> Any:
    if variable.dimensions == ():
        value = variable[()]
        return value.decode() if isinstance(value, bytes) else str(value)
    return np.ascontiguousarray(variable[...])


def _rebuilt(stored: dict[str, Any], cls: type[M], where: str) -> Result:
    from ..model.io import loads
    from ..model.shapes.mesh import paths_from
    from ..tables.structure import structure
    from ..tables.values import values

    try:
        with paths_from(Path(where).parent):
            model = loads(stored["model"], cls, where)
        x = values(
            structure(model, tree=json.loads(stored["tree"])),
            dict(zip(json.loads(stored["parameters"]), stored["parameter_values"].tolist(), strict=True)),
        )
        arrays = {k: stored[k] for k in ARRAYS}
        final = stored["final"]
        health = _health(json.loads(stored["health"]))
    except KeyError as error:
        raise ModelError(f"{where} is no complete result of flyball: {error} is missing") from None
    s = x.structure
    wanted = {"q": s.nq, "v": s.nv, "multipliers": len(s.rows) + len(s.prescribed)}
    wanted["states"] = len(s.states)
    for name, n in wanted.items():
        if arrays[name].shape[1] != n:
            raise ModelError(
                f"{where}: its model has {n} {name}, its motion {arrays[name].shape[1]}; the file is damaged"
            )
    result = Result(model, x, health=health, **arrays)
    result.final = (float(final[0]), final[1:])
    result.wound = json.loads(stored.get("wound", "{}"))
    return result


def _health(data: dict[str, Any]) -> Health:
    """Health as it was saved; what is found late is already known here."""
    known = {f.name for f in fields(Health)}
    found = SimpleNamespace(
        freedoms=data["freedoms"],
        redundant=tuple(data["redundant"]),
        undetermined={k: tuple(v) for k, v in data["undetermined"].items()},
    )
    late: dict[str, Any] = {"mobility": found, "energy_drift": data["energy_drift"]}
    late["acceleration_violation"] = data.get("acceleration_violation", 0.0)
    late["creep"] = {k: tuple(v) for k, v in data.get("creep", {}).items()}
    late["warnings"] = tuple(data.get("warnings", ()))
    data["remarks"] = tuple(data.get("remarks", ()))
    data["departures"] = tuple(map(Departure.from_dict, data.get("departures", ())))
    return Health(**{k: v for k, v in data.items() if k in known}, late=late)
