"""Reading of result files written by `files`."""

from __future__ import annotations

import json
import os
import re
from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar

import numpy as np

from ..errors import ModelError
from ..model.model import Model, suggest
from .events import MotionStart
from .files import (
    MOTION_ARRAYS,
    OWN_GROUP,
    RESULT_FORMAT,
    data_checksum,
    has_switches,
    is_sealed,
    read_group,
    unpack_contacts,
)
from .files import unpack_events as events_unpack
from .files import unpack_phases as stretches_unpack
from .health import ContactHealth, Health, InitialDeviation
from .result import Result

ModelType = TypeVar("ModelType", bound=Model)


def read_result(path: str | os.PathLike, cls: type[ModelType]) -> Result:
    """Rebuild a result with a mechanism of class ``cls``; nothing is simulated or compiled.

    Raises
    ------
    ModelError
        If there is no such file, it is not a result of flyball, or it is damaged.
    """
    path = Path(path)
    if not path.is_file():
        there = [p.name for p in path.parent.glob("*.nc")] if path.parent.is_dir() else []
        raise ModelError(f"there is no file {os.fspath(path)!r}{suggest(path.name, there)}")
    stored, kind = _read_stored(path)
    where = os.fspath(path)
    try:
        result = _rebuild_result(stored, cls, where)
    except ModelError:
        raise
    except Exception as error:  # the file may hold anything, and names the user's classes
        raise _damaged_file_error(where, f"{type(error).__name__}: {error}") from None
    if kind < 3:
        late: dict[str, Any] = result.health.late
        note = f"{path.name} was written before result files had checksums: damage cannot be detected"
        late["warnings"] = (*result.health.warnings, note)
    return result


RESULT_FILE_REMEDY = "give a file that Result.save or 'flyball run' wrote"


def _damaged_file_error(where: str, what: str) -> ModelError:
    return ModelError(f"{where} is damaged: {what}. Take another copy of it, or simulate again")


def _read_stored(path: Path) -> tuple[dict[str, Any], int]:
    """Return texts and arrays of the file's own group, and their format."""
    import h5netcdf
    import h5py

    try:
        if is_sealed(path) is False:
            raise _damaged_file_error(os.fspath(path), "its contents do not match the checksum at its end")
        with h5py.File(path, "r") as whole:
            dict(whole.attrs)  # h5netcdf leaves a file open if this fails
            file = h5netcdf.File(whole, "r")
            if OWN_GROUP in file.groups and "study" in file.groups[OWN_GROUP].attrs:
                raise ModelError(f"{path} is a study, no result: read it with flyball.load_study")
            if OWN_GROUP not in file.groups:
                raise ModelError(
                    f"{path} is no result of flyball (it has no group {OWN_GROUP!r}); {RESULT_FILE_REMEDY}"
                )
            group = file.groups[OWN_GROUP]
            kind, written = int(group.attrs["format"]), group.attrs.get("checksum")
            if kind > RESULT_FORMAT:
                raise ModelError(f"{path} was written by flyball {group.attrs['version']}, a later version than this")
            stored = read_group(group)
    except ModelError:
        raise
    except Exception as error:  # HDF5 and its wrappers raise many kinds of errors for invalid or damaged files
        raise ModelError(
            f"{path} cannot be read as a NetCDF result ({_first_line(error)}); {RESULT_FILE_REMEDY}"
        ) from None
    if written is None and kind >= 3:
        raise _damaged_file_error(os.fspath(path), "its checksum is missing")
    if written is not None and written != data_checksum(stored, kind):
        raise _damaged_file_error(os.fspath(path), "its contents do not match its checksum")
    if kind < 3 and "model" in stored:
        stored["model"] = _updated_model_text(stored["model"])
    return stored, kind


def _first_line(error: Exception) -> str:
    """Return an error's message in one line."""
    return next(iter(str(error).splitlines()), "") or type(error).__name__


def _updated_model_text(model: str) -> str:
    """Update the text of a model written when tables were extrapolated linearly unless ``outside`` was given."""
    parts = re.split(r"(?m)^(?=\[)", model)
    names = {"linear": "line", "hold": "hold", "periodic": "repeat"}
    for k, part in enumerate(parts):
        if part.startswith("[[tables]]"):
            given = re.search(r'(?m)^outside = "(\w+)"\n', part)
            rest = part.replace(given[0], "") if given else part
            beyond = f'beyond = "{names[given[1]] if given else "line"}"'
            parts[k] = rest.replace("[[tables]]\n", f"[[tables]]\n{beyond}\n", 1)
    return "".join(parts)


def _rebuild_result(stored: dict[str, Any], cls: type[ModelType], where: str) -> Result:
    from ..model.linked_files import paths_from
    from ..model.model_files import loads
    from ..tables.structure import Choices, structure
    from ..tables.values import values

    try:
        with paths_from(Path(where).parent):
            model = loads(stored["model"], cls, where)
        x = values(
            structure(model, Choices(tree=tuple(json.loads(stored["tree"])), switches=has_switches(stored))),
            dict(zip(json.loads(stored["parameters"]), stored["parameter_values"].tolist(), strict=True)),
        )
        arrays = {k: stored[k] for k in MOTION_ARRAYS}
        final = stored["final"]
        health = _read_health(json.loads(stored["health"]))
    except KeyError as error:
        raise ModelError(
            f"{where} is no complete result of flyball: {error} is missing; {RESULT_FILE_REMEDY}"
        ) from None
    s = x.structure
    wanted = {"q": s.nq, "v": s.nv, "vdot": s.nv, "multipliers": len(s.rows) + len(s.prescribed)}
    wanted["states"] = len(s.states)
    for name, n in wanted.items():
        if arrays[name].shape != (len(arrays["t"]), n):
            raise _damaged_file_error(
                where, f"its model has {n} {name} at {len(arrays['t'])} times, its motion {arrays[name].shape}"
            )
    if not (np.diff(arrays["t"]) >= 0.0).all():
        raise _damaged_file_error(where, "its times do not ascend")
    result = Result(model, x, health=health, **arrays)
    result.final = (float(final[0]), final[1:])
    unpack_contacts(stored, result)
    result.wound = json.loads(stored.get("wound", "{}"))
    result.carried = json.loads(stored.get("carried", "{}"))
    result.begun = MotionStart(stored.get("begun"), json.loads(stored.get("done", "{}")))
    stretches_unpack(stored, result)
    events_unpack(stored, result)
    return result


def _read_health(data: dict[str, Any]) -> Health:
    """Restore the saved health; deferred figures are already included."""
    known = {f.name for f in fields(Health)}
    found = SimpleNamespace(
        freedoms=data["freedoms"],
        redundant=tuple(data["redundant"]),
        cut=data.get("redundant_cut", ""),
        undetermined={k: tuple(v) for k, v in data["undetermined"].items()},
    )
    late: dict[str, Any] = {"mobility": found, "energy_drift": data["energy_drift"]}
    late["acceleration_violation"] = data.get("acceleration_violation", 0.0)
    late["creep"] = {k: tuple(v) for k, v in data.get("creep", {}).items()}
    late["warnings"] = tuple(data.get("warnings", ()))
    late["doubtful"] = tuple(data.get("doubtful", ()))
    data["remarks"] = tuple(data.get("remarks", ()))
    if data.get("contact"):
        data["contact"] = ContactHealth.from_dict(data["contact"])
    data["departures"] = tuple(map(InitialDeviation.from_dict, data.get("departures", ())))
    return Health(**{k: v for k, v in data.items() if k in known}, late=late)
