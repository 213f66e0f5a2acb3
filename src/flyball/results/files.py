"""Result files, labelled datasets and tables: written from a result, and read back without simulating.

A result file is NetCDF 4. Its root contains the labelled quantities, for other programs; its group ``flyball`` contains
the bit-exact data from which the result is rebuilt, and a checksum of them. Texts and arrays of that group are stored
in two variables, since HDF5 takes more than a millisecond for each variable.

A checksum of the whole file follows the end of the NetCDF data, so that a damaged file is never opened: HDF5 may hang
on it. A program that rewrites the file drops this checksum and keeps the other. A file that was changed after it was
written (an incomplete copy, a failing disk) is refused.
"""

from __future__ import annotations

import copy
import hashlib
import io
import json
import math
import os
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..model.output_files import write_file
from ..model.quantities import ENERGY, quantities
from ..tables.values import Values, values
from .contacts import CONTACT_COLUMNS, ContactBodies, Contacts
from .convergence import RESIDUALS, Convergence
from .events import EventRecord, Phase, phases_or_none
from .part_views.bodies import SET_MEMBER_ARRAYS, BodySetMotion
from .part_views.bodies import SET_MOTION_ARRAYS as OVER_TIME
from .part_views.forces import ForceView
from .part_views.joints import JointView
from .reactions import EventImpulses

if TYPE_CHECKING:
    import xarray

    from .result import Result


TEXTS_VARIABLE, NUMBERS_VARIABLE = "texts", "numbers"
MAX_CONCATENATED = 1 << 20  # size of arrays that are combined before writing


def text_type() -> Any:
    """Return the type of variable-length texts in a file."""
    import h5py

    return h5py.string_dtype()


def write_group(group: Any, texts: Mapping[str, str], arrays: Mapping[str, np.ndarray]) -> None:
    """Write texts and arrays of floats to a group."""
    told = json.dumps({"texts": dict(texts), "shapes": {name: np.shape(x) for name, x in arrays.items()}})
    group.create_variable(TEXTS_VARIABLE, (), dtype=text_type(), data=np.array(told, object))
    flat = [np.ravel(np.asarray(x, float)) for x in arrays.values()]
    group.dimensions["number"] = count = sum(map(len, flat))
    if count <= MAX_CONCATENATED:
        group.create_variable(NUMBERS_VARIABLE, ("number",), data=np.concatenate(flat))
        return
    made, at = group.create_variable(NUMBERS_VARIABLE, ("number",), dtype=float), 0
    for x in flat:
        made[at : at + len(x)] = x
        at += len(x)


def read_group(group: Any) -> dict[str, Any]:
    """Read texts and arrays of a group; before format 4 each is a separate variable."""
    found = {name: _read_variable(x) for name, x in group.variables.items()}
    if NUMBERS_VARIABLE not in found:
        return found
    told, numbers, at = json.loads(found[TEXTS_VARIABLE]), found[NUMBERS_VARIABLE], 0
    out: dict[str, Any] = told["texts"]
    for name, shape in told["shapes"].items():
        count = math.prod(shape)
        out[name] = numbers[at : at + count].reshape(shape)
        at += count
    return out


def _read_variable(variable: Any) -> Any:
    if variable.dimensions == ():
        value = variable[()]
        return value.decode() if isinstance(value, bytes) else str(value)
    return np.ascontiguousarray(variable[...])


StoredData = dict[str, Any]


def pack_contacts(result: Result) -> tuple[dict[str, str], dict[str, np.ndarray]]:
    """Return contacts and sets of bodies as texts and arrays; empty if there are none."""
    texts: dict[str, str] = {}
    arrays: dict[str, np.ndarray] = {}
    if result.bulk:
        texts["bulk"] = json.dumps(list(result.bulk))
        for k, b in enumerate(result.bulk.values()):
            arrays |= {f"bulk_{k}_{name}": getattr(b, name) for name in (*SET_MEMBER_ARRAYS, *OVER_TIME)}
    arrays |= {f"exchanged_{name}": values for name, values in result.exchanged.items()}
    c = result.contacts
    if c is not None:
        texts["sides"] = json.dumps({"names": c.sides.names, "counts": c.sides.counts})
        arrays |= {f"contact_{name}": getattr(c, name) for name in ("begin", *CONTACT_COLUMNS)}
        if c.history is not None:
            texts["history"] = c.history.solver
            arrays |= {f"history_{name}": getattr(c.history, name) for name in ("t", "begin", "iteration", *RESIDUALS)}
    return texts, {name: np.asarray(values, float) for name, values in arrays.items()}


def unpack_contacts(stored: StoredData, result: Result) -> None:
    """Restore contacts and sets of a result from its file.

    Raises
    ------
    ValueError
        If the arrays do not fit together.
    """
    for k, name in enumerate(json.loads(stored.get("bulk", "[]"))):
        result.bulk[name] = BodySetMotion(
            name, **{what: stored[f"bulk_{k}_{what}"] for what in (*SET_MEMBER_ARRAYS, *OVER_TIME)}
        )
    prefix = "exchanged_"
    result.exchanged = {k.removeprefix(prefix): v for k, v in stored.items() if k.startswith(prefix)}
    if "sides" not in stored:
        return
    sides = json.loads(stored["sides"])
    columns = {}
    for name, (kind, _) in {"begin": ("i8", 0), **CONTACT_COLUMNS}.items():
        columns[name] = np.ascontiguousarray(stored[f"contact_{name}"].astype(kind))
    history = None
    if "history" in stored:
        own = {name: stored[f"history_{name}"] for name in ("t", "iteration", *RESIDUALS)}
        history = Convergence(begin=stored["history_begin"].astype(int), solver=stored["history"], **own)
    planar = result.model.planar
    result.contacts = Contacts(
        t=result.t, sides=ContactBodies(sides["names"], sides["counts"]), history=history, planar=planar, **columns
    )


def pack_events(result: Result) -> tuple[dict[str, str], dict[str, np.ndarray]]:
    """Return events as texts and arrays; empty if there are none. States before and after are rows, nan if unknown."""
    if not len(result.events):
        return {}, {}
    states = {
        f"events_{k}": _state_rows([getattr(h, k) for h in result.events], len(result.final[1])) for k in BEFORE_AFTER
    }
    if n := len(result.model.parameters):
        for k in BEFORE_AFTER:
            every = [getattr(h, k) for h in result.events]
            told = [np.full(n, np.nan) if m is None else m.values.system.const[:n].real for m in every]
            states[f"events_{k}_parameters"] = np.array(told)
    told = [
        h.as_dict() | ({"struck": x.as_plain_data()} if isinstance(x := h.impulses, EventImpulses) else {})
        for h in result.events
    ]
    return {"events": json.dumps(told)}, states


BEFORE_AFTER = ("before", "after")


def _state_rows(moments: list[Any], n: int) -> np.ndarray:
    out = np.full((len(moments), n), np.nan)
    for k, m in enumerate(moments):
        if m is not None:
            out[k] = m.y
    return out


def unpack_events(stored: dict[str, Any], result: Result) -> None:
    """Restore the events of a result from its file.

    Raises
    ------
    ValueError
        If the arrays do not fit together.
    """
    told = json.loads(stored.get("events", "[]"))
    sides = [stored[f"events_{k}"] for k in BEFORE_AFTER] if told else [np.zeros((0, 0))] * 2
    if any(len(x) != len(told) for x in sides):
        raise ValueError(f"{len(told)} events, and states of {[len(x) for x in sides]}")
    if told:
        sides = [[None if np.isnan(y).any() else y for y in x] for x in sides]
        tables = zip(*(_event_tables(stored, k, result) for k in BEFORE_AFTER), strict=True)
        result.events = [  # type: ignore[assignment]
            EventRecord(**_event_fields(one, before is not None), before=before, after=after, tables=both)
            for one, before, after, both in zip(told, *sides, tables, strict=True)
        ]


def _event_fields(one: dict[str, Any], known: bool) -> dict[str, Any]:
    """Return the fields of an event; ``known``: with its states, from which all impulses are computed."""
    struck = one.pop("struck", None)
    if struck is not None and known:
        one["impulses"] = EventImpulses(struck["own"], np.array(struck["rows"]), tuple(map(tuple, struck["blows"])))
    return one | {"done": tuple(one["done"])}


def _event_tables(stored: dict[str, Any], side: str, result: Result) -> list[Values]:
    """Return the mechanism with the parameters of each event, before or after it."""
    names, rows = list(result.model.parameters), stored.get(f"events_{side}_parameters")
    if rows is None:
        return [result.values] * len(stored[f"events_{side}"])
    made: dict[tuple[float, ...], Values] = {}
    for told in {tuple(row) for row in rows.tolist()}:
        known = not np.isnan(told).any()
        own = dict(zip(names, told, strict=True))
        made[told] = values(result.values.structure, own) if known else result.values
    return [made[tuple(row)] for row in rows.tolist()]


PHASE_PREFIX = "stretch_"
PHASE_ARRAYS = ("rows", "lost", "given", "switch", "end")


def pack_phases(result: Result) -> dict[str, np.ndarray]:
    """Return phases as arrays by name, without empty ones; none if nothing can switch."""
    if result.phases is None:
        return {}
    every = result.phases.all
    out = {PHASE_PREFIX + name: np.array([getattr(x, name) for x in every], float) for name in PHASE_ARRAYS}
    out[PHASE_PREFIX + "sigma"] = result.phases.sigma
    out[PHASE_PREFIX + "last_sigma"] = every[-1].ways[:, -1:]
    n = len(result.model.parameters)
    out[PHASE_PREFIX + "parameters"] = np.array([x.values.system.const[:n].real for x in every], float).reshape(
        len(every), n
    )
    return {name: x for name, x in out.items() if x.size}


def has_switches(stored: dict[str, Any]) -> bool:
    """Return whether a stored result was computed with rows that have modes."""
    return PHASE_PREFIX + "rows" in stored


def unpack_phases(stored: dict[str, Any], result: Result) -> None:
    """Restore the phases of a result from its file.

    Raises
    ------
    ValueError
        If the arrays do not fit together.
    """
    if PHASE_PREFIX + "rows" not in stored:
        return
    rows, times = stored[PHASE_PREFIX + "rows"].astype(int), len(result.t)
    n, ny = len(rows), len(result.final[1])
    empty = {"switch": (n, 5, 0), "sigma": (0, times), "last_sigma": (0, 1), "parameters": (n, 0), "end": (n, ny)}
    stored = {PHASE_PREFIX + name: np.zeros(shape) for name, shape in empty.items()} | stored
    sigma = stored[PHASE_PREFIX + "sigma"]
    if rows.sum() != times or sigma.shape[1] != times:
        raise ValueError(f"{rows.sum()} times between events, and {times} in all")
    made, first, out = dict[tuple[float, ...], Values](), 0, list[Phase]()
    for k, n in enumerate(rows.tolist()):
        told = tuple(stored[PHASE_PREFIX + "parameters"][k].tolist())
        if told not in made:
            own = dict(zip(result.model.parameters, told, strict=True))
            last = k == len(rows) - 1
            made[told] = result.values if last else values(result.values.structure, own)
        way = sigma[:, first : first + n] if n else stored[PHASE_PREFIX + "last_sigma"]
        numbers = (stored[PHASE_PREFIX + name][k] for name in ("lost", "given"))
        lost, given = map(float, numbers)
        out.append(
            Phase(n, stored[PHASE_PREFIX + "switch"][k], way, made[told], lost, given, stored[PHASE_PREFIX + "end"][k])
        )
        first += n
    result.phases = phases_or_none(out)


OWN_GROUP = "flyball"
SEAL_MARK = b"\nflyball SHA-256 "
RESULT_FORMAT = 4  # 1: before joint coordinates, 2: before checksums, 3: each text and array a variable of its own
MOTION_ARRAYS = ("t", "q", "v", "vdot", "multipliers", "states")
MAX_LABELLED = 3000  # largest number of labelled quantities in a file; HDF5 takes more than a millisecond for each
SLASH_SUBSTITUTE = "\N{DIVISION SLASH}"  # a name must not hold "/" in a NetCDF file


def to_xarray(result: Result) -> xarray.Dataset:
    """Return all quantities as a dataset: ``ds["crank.position"]`` has the dimensions time and component.

    Units are in each variable's ``attrs["units"]``.
    """
    import xarray as xr

    data = {x.name: (x.dims, x.values, _variable_attributes(x.unit, x.note)) for x in labelled_quantities(result)}
    coords: dict[str, Any] = {TIME_LABEL: (TIME_LABEL, result.t, {"units": "s"})}
    return xr.Dataset(data, coords | dimension_labels(result), attrs=_file_attributes(result))


def _variable_attributes(unit: str, note: str) -> dict[str, str]:
    return {"units": unit} | ({"comment": note} if note else {})


def _file_attributes(result: Result) -> dict[str, str]:
    from .. import __version__

    return {"title": result.model.name, "source": f"flyball {__version__}", "status": result.health.message}


def save(result: Result, path: str | os.PathLike, *, with_labelled: bool = True) -> None:
    """Write everything, the model included, to one NetCDF file; on request with labelled quantities."""
    folder = Path(path).parent
    write_file(path, sealed_file_bytes(lambda file: _write_result(result, file, with_labelled, folder)))


def sealed_file_bytes(fill: Callable[[Any], None]) -> memoryview:
    """Return the bytes of a NetCDF file that a function fills, followed by their checksum.

    It is written in memory: on a full disk HDF5 would crash the process by a segmentation fault.
    """
    import h5netcdf

    image = io.BytesIO()
    with h5netcdf.File(image, "w") as file:
        fill(file)
    image.seek(0, io.SEEK_END)
    image.write(SEAL_MARK + hashlib.sha256(image.getbuffer()).hexdigest().encode())
    return image.getbuffer()


def _write_result(result: Result, file: Any, with_labelled: bool, folder: Path) -> None:
    file.attrs.update(_file_attributes(result) | {"Conventions": "CF-1.11"})
    file.dimensions[TIME_LABEL] = len(result.t)
    file.create_variable(TIME_LABEL, (TIME_LABEL,), data=result.t).attrs["units"] = "s"
    for name, labels in dimension_labels(result).items() if with_labelled else ():
        file.dimensions[name] = len(labels)
        file.create_variable(name, (name,), dtype=text_type(), data=np.array(labels, object))
    listed = False
    for x in labelled_quantities(_uncached_copy(result), MAX_LABELLED, forget=True) if with_labelled else ():
        made = file.create_variable(_variable_name(x.name), x.dims, data=np.ascontiguousarray(x.values))
        made.attrs.update(_variable_attributes(x.unit, x.note))
        listed = listed or not x.name.startswith(f"{ENERGY}.")
    if not listed:
        what = "too many parts to list" if with_labelled else "a motion that is not at its end"
        file.attrs["comment"] = f"{what}: read this file with flyball.load_result"
    _write_solution(result, file.create_group(OWN_GROUP), folder)


def _uncached_copy(result: Result) -> Result:
    """Return a copy without cached data; data computed from it for writing are discarded with it."""
    out = copy.copy(result)
    for name, x in vars(type(result)).items():
        if isinstance(x, cached_property):
            vars(out).pop(name, None)
    vars(out).pop("_views", None)
    return out


def is_sealed(path: Path) -> bool | None:
    """Return whether a file is unchanged since it was written; None if it has no checksum."""
    size = path.stat().st_size - len(SEAL_MARK) - 64
    if size < 0:
        return None
    with open(path, "rb") as file:
        file.seek(size)
        found = file.read()
    return found[len(SEAL_MARK) :] == file_hash(path, size).encode() if found.startswith(SEAL_MARK) else None


def file_hash(path: Path, size: int) -> str:
    """Return the SHA-256 of the first ``size`` bytes of a file."""
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while size > 0 and (part := file.read(min(size, 1 << 20))):
            digest.update(part)
            size -= len(part)
    return digest.hexdigest()


def data_checksum(stored: Mapping[str, Any], kind: int = RESULT_FORMAT) -> str:
    """Return the SHA-256 of texts and arrays by name, in an order and byte order independent of the machine."""
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


def _variable_name(name: str) -> str:
    return name.replace("/", SLASH_SUBSTITUTE).strip() or "_"


def _write_solution(result: Result, group: Any, folder: Path) -> None:
    """Write the arrays exactly, the model as the text of its file, parameters as used, health as JSON."""
    from .. import __version__
    from ..model.model_files import dumps

    s = result.values.structure
    group.attrs["format"] = RESULT_FORMAT
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
    arrays = {name: getattr(result, name) for name in MOTION_ARRAYS} | {
        "parameter_values": result.values.system.const[: len(result.model.parameters)],
        "final": np.r_[result.final[0], result.final[1]],
    }
    if result.begun.y is not None and len(result.begun.y):
        arrays["begun"] = result.begun.y
    told, more = pack_contacts(result)
    happened, states = pack_events(result)
    texts, arrays = texts | told | happened, arrays | more | states | pack_phases(result)
    write_group(group, texts, arrays)
    group.attrs["checksum"] = data_checksum(texts | arrays)


# Every part of a result in files and datasets: name, dimensions, unit, values.


TIME_LABEL, COMPONENT_DIMENSION, QUATERNION_DIMENSION = "time", "component", "quaternion_component"


MAX_SET_VALUES = 1_000_000  # largest product of set members and output times that is labelled


class LabelledQuantity(NamedTuple):
    """One quantity over time."""

    name: str
    dims: tuple[str, ...]
    unit: str
    values: np.ndarray
    note: str = ""


def dimension_labels(result: Result) -> dict[str, list[str]]:
    """Labels of the dimensions other than time."""
    axes = {COMPONENT_DIMENSION: list("xy" if result.planar else "xyz")}
    return axes if result.planar else axes | {QUATERNION_DIMENSION: list("wxyz")}


def labelled_quantities(result: Result, max_count: float = np.inf, forget: bool = False) -> Iterator[LabelledQuantity]:
    """Every quantity of the result: ``"crank.position"``, ``"A.force"``, ``"energy.total"`` and so on.

    If there would be more than ``max_count`` quantities, energies only. With ``forget`` data cached for a part are
    discarded, since those of all parts together need much memory.
    """
    tables = {name: quantities(result.model, name) for name in result.parts()}
    count = sum(x.array for table in tables.values() for x in table.values())
    for name in tables if count <= max_count else (ENERGY,):
        if name in result.bulk and len(result.t) * len(result.bulk[name]) > MAX_SET_VALUES:
            continue  # the arrays are stored once, for flyball
        view = result[name]
        for what, x in tables[name].items():
            if x.array:
                values = view.quantity(what)[1]
                dims = _set_dimensions(name, what, values) if name in result.bulk else _dimensions(what, values)
                yield LabelledQuantity(f"{name}.{what}", dims, x.unit, values, _body_note(view, what))
                del values
        if forget:
            del view
            result.forget()


def _dimensions(what: str, values: np.ndarray) -> tuple[str, ...]:
    if values.ndim == 1:
        return (TIME_LABEL,)
    return (TIME_LABEL, QUATERNION_DIMENSION if what == "quaternion" else COMPONENT_DIMENSION)


def _set_dimensions(name: str, what: str, values: np.ndarray) -> tuple[str, ...]:
    """Return the dimensions of a set of bodies: times, members, and components if there are any."""
    own = (TIME_LABEL, f"{name}_member")
    return own if values.ndim == 2 else (*own, *_dimensions(what, values[:, 0])[1:])


def _body_note(view: Any, what: str) -> str:
    """Return a note on the body on which a reaction or force acts, and on its undetermined components."""
    if what not in ("force", "torque"):
        return ""
    if isinstance(view, JointView):
        free = ", ".join(view.undetermined)
        on = f"reaction {what} on {view.element.body_j}, world axes"
        return f"{on}; redundancy leaves undetermined: {free}" if free else on
    own = isinstance(view, ForceView) and not view.element.outputs
    return f"on {view.element.ends()['M']}, world axes" if own else ""
