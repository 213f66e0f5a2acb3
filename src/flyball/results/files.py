"""Results as labelled datasets, tables and files; `flyball.results.reading` reads them back.

A result file is NetCDF 4. Its root holds the labelled quantities, for other programs; its group ``flyball`` holds what
the motion was computed with, bit for bit, from which the result is rebuilt without simulating, and a checksum of it.
Behind the end of what NetCDF reads stands a checksum of the whole file, so that nothing reads a damaged file: HDF5 may
then not come back. A program that writes the file anew drops that one and keeps the other.
"""

from __future__ import annotations

import copy
import csv
import hashlib
import io
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..model.quantities import ENERGY, quantities
from ..model.writing import TABLE, replacing, write
from .numbers import with_unit
from .stored import put, text_type
from .stored_contacts import packed
from .stored_events import packed as events_packed
from .stored_stretches import packed as stretches_packed
from .views.forces import ForceView
from .views.joints import JointView

if TYPE_CHECKING:
    import pandas
    import xarray

    from .result import Result

GROUP = "flyball"
SEAL = b"\nflyball SHA-256 "
FORMAT = 4  # 1: before joint coordinates, 2: before checksums, 3: each text and array a variable by itself
ARRAYS = ("t", "q", "v", "vdot", "multipliers", "states")
MOST = 3000  # labelled quantities in a file; HDF5 takes more than a millisecond for each
SLASH = "\N{DIVISION SLASH}"  # a name must not hold "/" in a NetCDF file


def to_xarray(result: Result) -> xarray.Dataset:
    """All quantities as a dataset: ``ds["crank.position"]`` has the dimensions time and component.

    Units are in each variable's ``attrs["units"]``.
    """
    import xarray as xr

    data = {x.name: (x.dims, x.values, _attributes(x.unit, x.note)) for x in labelled(result)}
    coords: dict[str, Any] = {TIME: (TIME, result.t, {"units": "s"})}
    return xr.Dataset(data, coords | coordinates(result), attrs=_about(result))


def _attributes(unit: str, note: str) -> dict[str, str]:
    return {"units": unit} | ({"comment": note} if note else {})


def _about(result: Result) -> dict[str, str]:
    from .. import __version__

    return {"title": result.model.name, "source": f"flyball {__version__}", "status": result.health.message}


def to_dataframe(result: Result) -> pandas.DataFrame:
    """All curves as columns ``"slider.x"``; time [s] as index; units in ``attrs["units"]``."""
    import pandas as pd

    channels = result.channels()
    frame = pd.DataFrame({k: v for k, (_, v) in channels.items()}, index=pd.Index(result.t, name=TIME))
    frame.attrs["units"] = {k: unit for k, (unit, _) in channels.items()}
    return frame


def to_csv(result: Result, path: str | os.PathLike) -> None:
    """All curves as a table with a header such as ``slider.x [m]``; numbers are written exactly."""
    channels = result.channels()
    header = [f"{TIME} [s]", *(with_unit(k, unit) for k, (unit, _) in channels.items())]
    columns = [result.t.tolist(), *(np.asarray(v).tolist() for _, v in channels.values())]
    write_table(path, header, zip(*columns, strict=True))


def write_table(path: str | os.PathLike, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table (.csv)."""
    with replacing(path, TABLE) as file, io.TextIOWrapper(file, encoding="utf-8", newline="") as text:
        writer = csv.writer(text)
        writer.writerow(header)
        writer.writerows(rows)


def save(result: Result, path: str | os.PathLike, *, whole: bool = True) -> None:
    """Write everything, the model included, to one NetCDF file; the labelled quantities for other programs if told."""
    folder = Path(path).parent
    write(path, sealed_file(lambda file: _write(result, file, whole, folder)))


def sealed_file(fill: Callable[[Any], None]) -> memoryview:
    """The bytes of a NetCDF file that a function fills, with their checksum behind the end.

    In memory: where HDF5 meets a full disk it ends the process by a segmentation fault.
    """
    import h5netcdf

    image = io.BytesIO()
    with h5netcdf.File(image, "w") as file:
        fill(file)
    image.seek(0, io.SEEK_END)
    image.write(SEAL + hashlib.sha256(image.getbuffer()).hexdigest().encode())
    return image.getbuffer()


def _write(result: Result, file: Any, whole: bool, folder: Path) -> None:
    file.attrs.update(_about(result) | {"Conventions": "CF-1.11"})
    file.dimensions[TIME] = len(result.t)
    file.create_variable(TIME, (TIME,), data=result.t).attrs["units"] = "s"
    for name, labels in coordinates(result).items() if whole else ():
        file.dimensions[name] = len(labels)
        file.create_variable(name, (name,), dtype=text_type(), data=np.array(labels, object))
    listed = False
    for x in labelled(_unread(result), MOST, forget=True) if whole else ():
        made = file.create_variable(_safe(x.name), x.dims, data=np.ascontiguousarray(x.values))
        made.attrs.update(_attributes(x.unit, x.note))
        listed = listed or not x.name.startswith(f"{ENERGY}.")
    if not listed:
        what = "too many parts to list" if whole else "a motion that is not at its end"
        file.attrs["comment"] = f"{what}: read this file with flyball.load_result"
    _write_solution(result, file.create_group(GROUP), folder)


def _unread(result: Result) -> Result:
    """The same, of which nothing was worked out yet: what is worked out of it to be written goes with it."""
    out = copy.copy(result)
    for name, x in vars(type(result)).items():
        if isinstance(x, cached_property):
            vars(out).pop(name, None)
    vars(out).pop("_views", None)
    return out


def sealed(path: Path) -> bool | None:
    """Whether a file is as it was written; None if it has no checksum behind its end."""
    size = path.stat().st_size - len(SEAL) - 64
    if size < 0:
        return None
    with open(path, "rb") as file:
        file.seek(size)
        found = file.read()
    return found[len(SEAL) :] == file_hash(path, size).encode() if found.startswith(SEAL) else None


def file_hash(path: Path, size: int) -> str:
    """SHA-256 of the first bytes of a file."""
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while size > 0 and (part := file.read(min(size, 1 << 20))):
            digest.update(part)
            size -= len(part)
    return digest.hexdigest()


def checksum(stored: Mapping[str, Any], kind: int = FORMAT) -> str:
    """SHA-256 of texts and arrays by name, in an order and with bytes that do not depend on the machine."""
    digest = hashlib.sha256(str(kind).encode())
    for name in sorted(stored):
        value = stored[name]
        if isinstance(value, str):
            shape, data = "text", value.encode()
        else:
            numbers = np.ascontiguousarray(value, "<f8")
            shape, data = str(numbers.shape), numbers.tobytes()
        digest.update(f"{name} {shape} {len(data)}\n".encode() + data)
    return digest.hexdigest()


def _safe(name: str) -> str:
    return name.replace("/", SLASH).strip() or "_"


def _write_solution(result: Result, group: Any, folder: Path) -> None:
    """The arrays as they are, the model as its file's text, parameters as used, health as JSON."""
    from .. import __version__
    from ..model.io import dumps

    s = result.values.structure
    group.attrs["format"] = FORMAT
    group.attrs["version"] = __version__
    texts = {
        "model": dumps(result.model, folder),
        "health": json.dumps(result.health.as_dict()),
        "tree": json.dumps(list(s.tree)),
        "parameters": json.dumps(list(result.model.parameters)),
        "wound": json.dumps(result.wound),
        "carried": json.dumps(result.carried),
        "done": json.dumps(result.begun.done),
    }
    arrays = {name: getattr(result, name) for name in ARRAYS} | {
        "parameter_values": result.values.system.const[: len(result.model.parameters)],
        "final": np.r_[result.final[0], result.final[1]],
    }
    if result.begun.y is not None and len(result.begun.y):
        arrays["begun"] = result.begun.y
    told, more = packed(result)
    happened, states = events_packed(result)
    texts, arrays = texts | told | happened, arrays | more | states | stretches_packed(result)
    put(group, texts, arrays)
    group.attrs["checksum"] = checksum(texts | arrays)


# What every part of a result is called in files and datasets: name, dimensions, unit, values.


TIME, AXIS, QUATERNION = "time", "component", "quaternion_component"


MEMBERS = 1_000_000  # members of a set times output times that are labelled


class Labelled(NamedTuple):
    """One quantity over time."""

    name: str
    dims: tuple[str, ...]
    unit: str
    values: np.ndarray
    note: str = ""


def coordinates(result: Result) -> dict[str, list[str]]:
    """Labels of the dimensions other than time."""
    axes = {AXIS: list("xy" if result.planar else "xyz")}
    return axes if result.planar else axes | {QUATERNION: list("wxyz")}


def labelled(result: Result, most: float = np.inf, forget: bool = False) -> Iterator[Labelled]:
    """Every quantity of the result: ``"crank.position"``, ``"A.force"``, ``"energy.total"`` and so on.

    Energies only, where the mechanism has so many parts that there would be more than ``most`` quantities. With
    ``forget`` the result does not keep what was worked out for a part: of all parts at once that is much memory.
    """
    tables = {name: quantities(result.model, name) for name in result.parts()}
    count = sum(x.array for table in tables.values() for x in table.values())
    for name in tables if count <= most else (ENERGY,):
        if name in result.bulk and len(result.t) * len(result.bulk[name]) > MEMBERS:
            continue  # its arrays are in the file once, for flyball
        view = result[name]
        for what, x in tables[name].items():
            if x.array:
                values = view.quantity(what)[1]
                dims = _of_members(name, what, values) if name in result.bulk else _dims(what, values)
                yield Labelled(f"{name}.{what}", dims, x.unit, values, _note(view, what))
                del values
        if forget:
            del view
            vars(result).pop("_views", None)
            if (records := vars(result).get("records")) is not None:
                records.forget()


def _dims(what: str, values: np.ndarray) -> tuple[str, ...]:
    if values.ndim == 1:
        return (TIME,)
    return (TIME, QUATERNION if what == "quaternion" else AXIS)


def _of_members(name: str, what: str, values: np.ndarray) -> tuple[str, ...]:
    """Of a set of bodies: times, members, and components if there are some."""
    own = (TIME, f"{name}_member")
    return own if values.ndim == 2 else (*own, *_dims(what, values[:, 0])[1:])


def _note(view: Any, what: str) -> str:
    """On which body a reaction or force acts, and what redundancy leaves of it undetermined."""
    if what not in ("force", "torque"):
        return ""
    if isinstance(view, JointView):
        free = ", ".join(view.undetermined)
        on = f"reaction {what} on {view.element.body_j}, world axes"
        return f"{on}; redundancy leaves undetermined: {free}" if free else on
    own = isinstance(view, ForceView) and not view.element.outputs
    return f"on {view.element.ends()['M']}, world axes" if own else ""
