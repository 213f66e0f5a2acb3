"""Studies as labelled datasets and files; `flyball.results.study_reading` reads them back."""

from __future__ import annotations

import dataclasses
import json
import os
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.writing import write
from .files import GROUP, SLASH, sealed_file
from .stored import text_type

if TYPE_CHECKING:
    import xarray

    from .study import Study

FORMAT = 1
RUN, TIME = "run", "time"
DOUBTED = {"comment": "1: done, but perhaps not what its tolerance asks for"}
BY_RUN = ("reasons", "remarks", "doubtful")
"""Texts by the numbers of runs."""
TOLD = ("name", "design", "parameters", "of", "units", "options", "base", "mark", "analysis", "seconds", "message")


def to_xarray(study: Study) -> xarray.Dataset:
    """See `Study.to_xarray`."""
    import xarray as xr

    dims: tuple[str, ...] = study.parameters if study.axes else (RUN,)
    curve = any(x.ndim > 1 for x in study.values.values())
    coords: dict[str, Any] = {TIME: (TIME, study.t, {"units": "s"})} if curve else {}
    if study.axes:
        coords |= {name: (name, axis) for name, axis in zip(study.parameters, study.axes, strict=True)}
    else:
        coords |= {name: (RUN, study.points[:, k]) for k, name in enumerate(study.parameters)}
    data: dict[str, Any] = {}
    for name, unit in zip(study.of, study.units, strict=True):
        x = study[name]
        data[name] = ((*dims, TIME) if x.ndim > len(dims) else dims, x, {"units": unit} if unit else {})
    data["status"] = (dims, study.status.reshape(study.shape), {"comment": "0 still to be done, 1 done, 2 failed"})
    data["doubtful"] = (dims, _doubted(study).reshape(study.shape), DOUBTED)
    return xr.Dataset(data, coords, attrs=_about(study))


def _doubted(study: Study) -> np.ndarray:
    """Which runs are doubtful, (runs,) of 0 and 1."""
    out = np.zeros(len(study), np.int8)
    out[list(study.doubtful)] = 1
    return out


def _about(study: Study) -> dict[str, str]:
    from .. import __version__

    return {"title": study.name, "source": f"flyball {__version__}", "comment": f"study, {study.design}"}


def save_study(study: Study, path: str | os.PathLike) -> None:
    """Write it to one NetCDF file: beside the file that may be there, which it then replaces."""
    write(path, sealed_file(lambda file: _write(study, file)))


def _write(study: Study, file: Any) -> None:
    texts = {k: getattr(study, k) for k in TOLD}
    texts["options"] = {k: _plain(x) for k, x in study.options.items()}
    texts |= {k: getattr(study, k) for k in BY_RUN}
    file.attrs.update(_about(study) | {"Conventions": "CF-1.11"})
    file.dimensions[RUN], file.dimensions[TIME] = len(study), len(study.t)
    file.create_variable(TIME, (TIME,), data=study.t).attrs["units"] = "s"
    for k, name in enumerate(study.parameters):
        file.create_variable(safe(f"parameter {name}"), (RUN,), data=np.ascontiguousarray(study.points[:, k]))
    for (name, x), unit in zip(study.values.items(), study.units, strict=True):
        made = file.create_variable(safe(name), (RUN, TIME)[: x.ndim], data=np.ascontiguousarray(x))
        made.attrs["units"] = unit or "1"
    file.create_variable("status", (RUN,), data=study.status)
    file.create_variable("doubtful", (RUN,), data=_doubted(study)).attrs.update(DOUBTED)
    group = file.create_group(GROUP)
    group.attrs["study"] = FORMAT
    group.create_variable("study", (), dtype=text_type(), data=np.array(json.dumps(texts), object))
    for k, axis in enumerate(study.axes):
        group.dimensions[f"n_{k}"] = len(axis)
        group.create_variable(f"axis_{k}", (f"n_{k}",), data=axis)


def _plain(x: Any) -> Any:
    return dataclasses.asdict(x) if dataclasses.is_dataclass(x) and not isinstance(x, type) else x


def safe(name: str) -> str:
    """A name that a variable of a file may have."""
    return name.replace("/", SLASH)
