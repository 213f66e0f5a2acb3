"""Model files: a mechanism as readable TOML, which is read back exactly, or described by a Python file.

Numbers are written so that reading restores every bit, and strings ("60 rpm", "2*k") as the user wrote them. An unknown
table, type or field is refused with the line, the nearest known names and the rule.
"""

from __future__ import annotations

import dataclasses
import importlib
import os
import re
import sys
import tomllib
from collections.abc import Mapping
from contextlib import redirect_stdout
from contextvars import ContextVar
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from ..errors import FlyballError, ModelError
from .assembly_tables import ASSEMBLIES, DEFINITIONS, AssemblyTable, repeated
from .body import Bodies, Body, Driver, Frame, Ground, Initial
from .contact import Contact, Material, MaterialPair
from .contact_point import Touch
from .controller import IMU, Controller, Sensor
from .element import Element, written_fields
from .event import Event
from .expression_parser import function_name
from .force import Force, Unilateral
from .joint import Coupling, Joint
from .linked_files import LinkedFile, current_folder, paths_from
from .messages import listing, suggest_part
from .model import Model, suggest
from .output_files import DESCRIPTION, file_extension, write_file
from .roads.road import Road
from .snapshot import CATEGORIES, part_owners
from .table import Table
from .table_2d import Table2D

M = TypeVar("M", bound=Model)

PARAMETERS = "parameters"
SETTINGS = ("name", "planar", "gravity", PARAMETERS)
ONE_KIND = {
    "materials": Material,
    "material_pairs": MaterialPair,
    "ground": Ground,
    "bodies": Body,
    "bulk": Bodies,
    "drivers": Driver,
    "initial": Initial,
    "contacts": Contact,
    "events": Event,
}
MUTUAL = "controllers"  # categories whose elements may refer to each other
ORDER = tuple(x for c in CATEGORIES for x in ((c, ASSEMBLIES) if c == "bulk" else (c,)))
"""Tables in the order in which their parts are added."""
AFTER_OTHERS = ("couplings", "sensors", "controllers", "forces", "drivers")  # these may refer to their own kind
SELF_NAMED = ("material_pairs", "contacts")  # categories with automatic names
MANY_KINDS = {
    "joints": (Joint, "joints"),
    "couplings": (Coupling, "joints"),
    "controllers": (Controller, "controllers"),
    "forces": (Force, "forces"),
    "limits": (Unilateral, "forces"),
}
DEFAULT_KINDS = {"frames": "Frame", "sensors": "Sensor", "limits": "Limit", "tables": "Table"}  # default types
FEW_KINDS: dict[str, dict[str, type[Element]]] = {
    "frames": {"Frame": Frame, "Road": Road},
    "sensors": {"Sensor": Sensor, "IMU": IMU},
    "tables": {"Table": Table, "Table2D": Table2D},
}
_OPEN: ContextVar[tuple[Path, ...]] = ContextVar("open", default=())  # files that are being read
_SOURCE = ("file", "of")  # fields of the tables of assemblies that name the mechanism
WIDTH = 100  # longer lists of shapes are written with one shape per line
_HEADER = re.compile(r"^\s*\[\[\s*\"?(\w+)\"?\s*\]\]")
_PLACE = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")


def save(model: Model, path: str | os.PathLike) -> None:
    """Write a mechanism to a TOML file.

    Raises
    ------
    ModelError
        If the file cannot be written, or a value of the mechanism cannot be written to a file.
    """
    file_extension(path, DESCRIPTION)
    write_file(path, dumps(model, Path(path).parent))


def dumps(model: Model, folder: str | os.PathLike | None = None) -> str:
    """Return the text of the mechanism's TOML file; relative paths are as seen from ``folder``, else as given."""
    lines = [f"name = {_text(model.name)}", f"planar = {_value(model.planar)}", f"gravity = {_value(model.gravity)}"]
    if model.parameters:
        lines += ["", "[parameters]"]
        lines += [f"{_key(k)} = {_value(v)}" for k, v in model.parameters.items()]
    owners = part_owners(model)
    for category in CATEGORIES:
        for e in getattr(model, category):
            if e.name in owners:
                _require_unchanged(model, e, owners[e.name])
                continue
            lines += ["", f"[[{category}]]"]
            told = category in MANY_KINDS or category in DEFAULT_KINDS
            kind = {"type": type(e).__name__} if told and type(e).__name__ != DEFAULT_KINDS.get(category) else {}
            fields = kind | _written(e, folder)
            _refuse_functions(e, fields)
            lines += [f"{k} = {_value(v)}" for k, v in fields.items()]
    text = "\n".join(lines) + "\n"
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise ModelError(f"{model.name!r} cannot be written: a text contains {error.object[error.start]!r}") from None
    return text


def _require_unchanged(model: Model, e: Element, owner: Element) -> None:
    """Refuse to leave out an element that no longer is what its owner gives."""
    if e not in owner.parts(model):
        raise ModelError(f"{e.title} differs from what {owner.title} gives, which a file cannot say; change that")


def _written(e: Element, folder: str | os.PathLike | None) -> dict[str, Any]:
    """Return the element's fields as plain data, with paths of meshes as seen from the folder."""
    data = written_fields(e)
    if folder is None:
        return data
    if isinstance(e, LinkedFile):
        data["path"] = e.path_from(folder)
    for name in data:
        several = isinstance(data[name], list)
        parts, tables = (x if several else [x] for x in (getattr(e, name), data[name]))
        for part, table in zip(parts, tables, strict=True):
            if isinstance(part, LinkedFile) and part.path is not None:
                table["path"] = part.path_from(folder)
    return data


def _refuse_functions(e: Element, fields: Mapping[str, Any]) -> None:
    for name, value in fields.items():
        for law in value if isinstance(value, (list, tuple)) else (value,):
            if callable(law):
                raise ModelError(
                    f"{e.title}: {name} is the Python function '{function_name(law)}', and a model file cannot "
                    "contain a Python function; use an expression or a Table"
                )


def _value(value: Any) -> str:
    """Return a value in TOML syntax; numbers by ``repr``, which is exact."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        items = [_value(v) for v in value]
        if any(isinstance(v, Mapping) for v in value) and sum(map(len, items)) > WIDTH:
            return "[\n" + "".join(f"    {i},\n" for i in items) + "]"
        return f"[{', '.join(items)}]"
    raise ModelError(f"{value!r} cannot be written to a model file; use a number or a text")


def _text(text: str) -> str:
    import tomli_w

    return tomli_w.dumps({"a": text}).removeprefix("a = ").removesuffix("\n")


def _key(key: str) -> str:
    import tomli_w

    return tomli_w.dumps({key: 0}).removesuffix(" = 0\n")


def load(path: str | os.PathLike, cls: type[M]) -> M:
    """Read a mechanism of class ``cls`` from a TOML file.

    Raises
    ------
    ModelError
        If there is no such file, it is not TOML, or it does not describe a valid mechanism; the message names the file,
        the line, and the element.
    """
    path = Path(path)
    text = read_text(path)
    token = _OPEN.set((*_OPEN.get(), path.resolve()))
    with paths_from(path.parent):
        try:
            return loads(text, cls, os.fspath(path))
        except ModelError as error:
            if path.suffix.lower() == ".toml":
                raise
            raise ModelError(f"{path} is no model file, these end in .toml, .py, .urdf or .xml: {error}") from None
        finally:
            _OPEN.reset(token)


def read_text(path: Path) -> str:
    """Return the text of a model file.

    Raises
    ------
    ModelError
        If there is no such file, or it is no text.
    """
    try:
        return path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        there = [p.name for p in path.parent.glob("*.toml")] if path.parent.is_dir() else []
        raise ModelError(f"there is no file {os.fspath(path)!r}{suggest(path.name, there)}") from None
    except UnicodeDecodeError as error:
        raise ModelError(f"{path}: not a text in UTF-8 (byte {error.start}), so no model file") from None
    except OSError as error:
        raise ModelError(f"cannot read {os.fspath(path)!r}: {error.strerror}") from None


def loads(text: str, cls: type[M], source: str = "model") -> M:
    """Read a mechanism of class ``cls`` from the text of a TOML file; ``source`` names it in messages."""
    return described(parsed(text, source), text, cls, source, {})


def described(data: Mapping[str, Any], text: str, cls: type[M], source: str, definitions: Mapping[str, Any]) -> M:
    """Return the mechanism of the data of a file with that text, or of a definition in it."""
    known = [*SETTINGS, DEFINITIONS, *ORDER]
    for key, value in data.items():
        if key not in known:
            what = "table" if isinstance(value, (Mapping, list)) else "key"
            raise ModelError(f"{source}: unknown {what} {key!r}{suggest(key, known)}; a model has {', '.join(known)}")
    model = _settings(data, cls, source)
    found = data.get(DEFINITIONS, {})
    if not isinstance(found, Mapping) or not all(isinstance(x, Mapping) for x in found.values()):
        raise ModelError(
            f"{source}: {DEFINITIONS!r} must be tables of mechanisms, such as [[definitions.corner.bodies]]"
        )
    _add_all(model, _entries(data, text, source), {**definitions, **found}, source)
    return model


Entry = tuple[str, Mapping[str, Any], str]


def _entries(data: Mapping[str, Any], text: str, source: str) -> list[Entry]:
    """Return (category, fields, location in the file) of every element."""
    lines = _header_lines(text)
    out: list[Entry] = []
    for category in ORDER:
        tables = data.get(category, [])
        if not isinstance(tables, list) or not all(isinstance(t, Mapping) for t in tables):
            raise ModelError(f"{source}: {category!r} must be tables, each headed [[{category}]]")
        places = lines.get(category, [])
        for k, table in enumerate(tables):
            line = f" (line {places[k]})" if len(places) == len(tables) else ""
            named = "prefix" if category == ASSEMBLIES else "name"
            name = f" {table[named]!r}" if isinstance(table.get(named), str) else ""
            where = f"{source}: [[{category}]] {k + 1}{name}{line}"
            try:
                out.extend((category, one, where) for one in repeated(table, named))
            except ModelError as error:
                _refuse(error, where)
    return out


def _add_all(model: Model, entries: list[Entry], definitions: Mapping[str, Any], source: str) -> None:
    """Add every element; elements that refer to others further down in the file are added after them."""
    waiting = entries
    while waiting:
        failed: list[Entry] = []
        errors: list[ModelError] = []
        for entry in waiting:
            try:
                _add(model, *entry, definitions, source)
            except ModelError as error:
                failed.append(entry)
                errors.append(error)
        if len(failed) == len(waiting):
            if not _together(model, failed):
                raise errors[0]
            failed = [entry for entry in failed if entry[0] != MUTUAL]
        if failed and all(category not in AFTER_OTHERS for category, _, _ in failed):
            raise errors[0]  # only these can refer to one another
        waiting = failed
    place = {str(fields.get("name")): k for k, (_, fields, _) in enumerate(entries)}
    owned = part_owners(model)

    def order(e: Element) -> tuple[int, bool]:
        """Place in the file; of a part after its owner, or last in a table in which that is not."""
        owner = owned.get(e.name, e)
        found = place.get(owner.name, -1)  # copies of mechanisms are first
        return (found, owner is not e) if owner.category == e.category else (len(place), True)

    for category in AFTER_OTHERS:
        getattr(model, category).sort(key=order)


def _together(model: Model, entries: list[Entry]) -> bool:
    """Add controllers that refer to one another together; return whether there were any.

    Raises
    ------
    ModelError
        If one of them is invalid even with the others: an unknown name, or an algebraic loop between sampled
        controllers.
    """
    twins = [entry for entry in entries if entry[0] == MUTUAL]
    before = len(model.controllers)
    made = [_make_element(*entry) for entry in twins]
    try:
        model.add(*made)
    except ModelError as error:
        for e in model.controllers[before:]:
            model.by_name.pop(e.name)
        del model.controllers[before:]
        at = [where for e, (_, _, where) in zip(made, twins, strict=True) if e.title in str(error)]
        _refuse(error, [*at, twins[0][2]][0])
    return bool(made)


def parsed(text: str, source: str) -> dict[str, Any]:
    """Return the tables of a TOML text.

    Raises
    ------
    ModelError
        If it is not TOML; the message shows the faulty line with a caret.
    """
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ModelError(f"{source}: its lists are nested too deep") from None
    except ValueError as error:  # TOMLDecodeError, and numbers of more digits than Python reads
        message = str(error)
        place = _PLACE.search(message)
        if place is None:
            raise ModelError(f"{source}: {message}") from None
        lines = text.split("\n")
        last = max((k for k, x in enumerate(lines, 1) if x.strip()), default=1)
        line = min(int(place[1]), len(lines)) if place[1] else last
        shown = lines[line - 1].rstrip("\r").replace("\t", " ")
        column = int(place[2]) if place[2] else len(shown) + 1
        margin = f"{line:>6} | "
        caret = " " * (len(margin) + column - 1) + "^"
        reason = message[: place.start()]
        raise ModelError(f"{source}, line {line}: {reason}\n{margin}{shown}\n{caret}") from None


def _settings(data: Mapping[str, Any], cls: type[M], source: str) -> M:
    """Return the empty mechanism with its name, plane, gravity and parameters."""
    given = {k: data[k] for k in SETTINGS if k in data}
    for key, kind, what in (("planar", bool, "true or false"), ("parameters", Mapping, "a table of named numbers")):
        if key in given and not isinstance(given[key], kind):
            raise ModelError(f"{source}: {key!r} must be {what}, got {given[key]!r}")
    for key, value in given.get("parameters", {}).items():
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            raise ModelError(f"{source}: [parameters] {key!r} must be a number or a text with a unit, got {value!r}")
    try:
        return cls(**given)
    except Exception as error:
        _refuse(error, source)


def _header_lines(text: str) -> dict[str, list[int]]:
    """Return the line numbers of the ``[[...]]`` headers, by category."""
    out: dict[str, list[int]] = {}
    for k, line in enumerate(text.split("\n"), 1):
        if match := _HEADER.match(line):
            out.setdefault(match[1], []).append(k)
    return out


def _add(
    model: Model, category: str, table: Mapping[str, Any], where: str, definitions: Mapping[str, Any], source: str
) -> None:
    try:
        if category == ASSEMBLIES:
            fields = AssemblyTable(**table)
            part = _subassembly(fields, model, definitions, source)
            model.add(
                part, **{f.name: getattr(fields, f.name) for f in dataclasses.fields(fields) if f.name not in _SOURCE}
            )
            return
    except Exception as error:
        _refuse(error, where)
    made = _make_element(category, table, where)
    try:
        model.add(made)
    except Exception as error:
        _refuse(error, where)


def _subassembly(table: AssemblyTable, model: M, definitions: Mapping[str, Any], source: str) -> M:
    """Return the mechanism of which a table adds a copy."""
    if (table.file is None) == (table.of is None):
        raise ModelError("give file=, or of= the name of one of the definitions; one of them")
    if table.of is not None:
        if table.of not in definitions:
            known = list(definitions)
            raise ModelError(f"there is no definition {table.of!r}{suggest(table.of, known)}; {listing(known)}")
        data = {"name": table.of, "planar": model.planar} | dict(definitions[table.of])
        inner = {k: x for k, x in definitions.items() if k != table.of}
        return described(data, "", type(model), f"{source}: definition {table.of!r}", inner)
    path = (current_folder() / str(table.file)).resolve()
    if path.suffix.lower() != ".toml":
        raise ModelError(
            f"file {table.file!r} is no model file in TOML; other mechanisms are added in Python: m.add(part)"
        )
    if path in _OPEN.get():
        raise ModelError(f"file {table.file!r} contains itself: {' -> '.join(p.name for p in (*_OPEN.get(), path))}")
    return load(path, type(model))


def _make_element(category: str, table: Mapping[str, Any], where: str) -> Element:
    """Return the element that a table describes."""
    fields = dict(table)
    cls = ONE_KIND[category] if category in ONE_KIND else _kind(category, fields, where)
    if "name" not in fields and category not in SELF_NAMED:
        raise ModelError(f'{where}: it has no name; add name = "..."')
    try:
        return cls(**fields)
    except Exception as error:
        _refuse(error, where)


def element_types(category: str) -> list[str]:
    """Return the types that the tables of a category may name; those of the user's own classes last."""
    if category in FEW_KINDS:
        return sorted(FEW_KINDS[category])
    base, room = MANY_KINDS[category]
    importlib.import_module(f"..{room}", __package__)
    kinds = {k: c for k, c in Element.registry.items() if issubclass(c, base) and c.category == category}
    own = [k for k, c in kinds.items() if not c.__module__.startswith("flyball.")]
    return [*sorted(k for k, c in kinds.items() if c.__module__.count(f".{room}.")), *sorted(own)]


def _kind(category: str, fields: dict[str, Any], where: str) -> type[Element]:
    """Return the class named by the table's ``type``."""
    if category in DEFAULT_KINDS:
        fields.setdefault("type", DEFAULT_KINDS[category])
    known = element_types(category)
    name = fields.pop("type", None)
    if category == "forces" and name == Touch.__name__:  # contact points of a motion, in its result file
        return Touch
    if name not in known:
        problem = "it has no type" if name is None else f"unknown type {name!r}{suggest_part(str(name), known)}"
        hint = "" if name is None else ". A type of your own is known once the Python file that defines it is imported"
        raise ModelError(f"{where}: {_elsewhere(name) or problem}; {category} are {', '.join(known)}{hint}")
    return Element.of_type(name, f"{where}: ")


def _elsewhere(name: Any) -> str:
    """Return the table to which a type belongs, if there is one."""
    for _, room in MANY_KINDS.values():
        importlib.import_module(f"..{room}", __package__)
    kind = Element.registry.get(str(name))
    return f"a {name} belongs in a table [[{kind.category}]]" if kind and kind.category in MANY_KINDS else ""


def _refuse(error: Exception, where: str) -> NoReturn:
    """Return the error as a ``ModelError`` with the location in the file in front."""
    kind = type(error) if isinstance(error, ModelError) else ModelError
    raise kind(f"{where}: {error}") from None


def load_python(path: Path, cls: type[M]) -> M:
    """Execute a Python file; return its ``m``, ``mechanism`` or ``mechanism()``, a mechanism of class ``cls``.

    Its output is redirected to stderr.

    Raises
    ------
    ModelError
        If there is no such file, it fails (with its line), or it defines no mechanism.
    """
    import runpy

    if not path.is_file():
        there = [p.name for p in path.parent.glob("*.py")] if path.parent.is_dir() else []
        raise ModelError(f"there is no file {os.fspath(path)!r}{suggest(path.name, there)}")
    sys.path.insert(0, str(path.resolve().parent))
    try:
        with redirect_stdout(sys.stderr):
            names = runpy.run_path(str(path))
            found: list[Any] = [names.get(k) for k in ("m", "mechanism")]
            made = [x if isinstance(x, cls) else x() for x in found if isinstance(x, cls) or callable(x)]
    except ModelError as error:
        raise type(error)(f"{path}{_line_in(path, error)}: {error}") from None
    except FlyballError:
        raise
    except (Exception, SystemExit) as error:
        raise ModelError(f"{path}{_line_in(path, error)}: {type(error).__name__}: {error}") from None
    finally:
        sys.path.pop(0)
    for m in made:
        if isinstance(m, cls):
            return m
    raise ModelError(f"{path} defines no mechanism: name one m or mechanism, or define a function mechanism()")


def _line_in(path: Path, error: BaseException) -> str:
    """Return ', line n' of the last line of that file in the error's traceback."""
    if isinstance(error, SyntaxError) and error.lineno:
        return f", line {error.lineno}"
    line = ""
    trace = error.__traceback__
    while trace is not None:
        if os.path.abspath(trace.tb_frame.f_code.co_filename) == os.path.abspath(path):
            line = f", line {trace.tb_lineno}"
        trace = trace.tb_next
    return line
