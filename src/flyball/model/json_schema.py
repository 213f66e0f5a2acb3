"""The format of model files as a JSON schema (draft 2020-12), by which editors complete, explain and check them.

The schema is made from the elements: types and defaults of their fields, and the entries of their docstrings. It has
what can be known of one field alone. What depends on several fields, on units or on other elements (a name that does
not exist) is found when the file is loaded.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Mapping
from typing import Any

from pydantic import TypeAdapter
from pydantic.json_schema import GenerateJsonSchema

from ..docstrings import ArgumentHelp, argument_help, first_doc_line
from ..errors import ModelError
from .assembly_tables import ASSEMBLIES, DEFINITIONS, MAX_REPEATED, REPEAT, AssemblyTable
from .element import Element, Flag, Number, Numbers, Unit, fields_with
from .event import Action
from .model import Model
from .model_files import DEFAULT_KINDS, FEW_KINDS, MANY_KINDS, ONE_KIND, element_types
from .roads.opencrg import OpenCRG as OpenCRG
from .roads.random_road import RandomRoad as RandomRoad
from .shapes import SHAPES, SURFACES
from .shapes.solid import Solid
from .snapshot import CATEGORIES

DIALECT = "https://json-schema.org/draft/2020-12/schema"
SETTINGS = {"name": str, "planar": Flag, "gravity": Numbers, "parameters": dict[str, Number]}
"""Types of the keys before the first table."""
REPEAT_SCHEMA = {
    "description": "Number of parts that this table stands for; in its texts {i}, {i+1}, ... are counted from 0.",
    "type": "integer",
    "minimum": 1,
    "maximum": MAX_REPEATED,
}
_SENTENCE_END = re.compile(r"(?<=[.;])\s+(?=[A-Z])")


class _FieldSchema(GenerateJsonSchema):
    """Schemas of types as values of TOML, which has no null."""

    def nullable_schema(self, schema: Any) -> Any:
        """Return the schema of the type: a field without a value is left out."""
        return self.generate_inner(schema["schema"])

    def union_schema(self, schema: Any) -> Any:
        """Return ``{"type": ["number", "string"]}`` in place of a list of such schemas."""
        schema = super().union_schema(schema)
        members = schema.get("anyOf", [])
        plain = bool(members) and all(list(x) == ["type"] for x in members)
        return {"type": [x["type"] for x in members]} if plain else schema

    def field_title_should_be_set(self, schema: Any) -> bool:
        """Return False: the names of fields are their titles."""
        return False


def model_schema(cls: type[Model]) -> dict[str, Any]:
    """Return the JSON schema of the files that describe a mechanism of class ``cls``.

    Types of the user's own are included if the modules that define them have been imported.
    """
    usual = inspect.signature(cls.__init__).parameters
    properties = {k: _type_schema(kind) | {"default": usual[k].default} for k, kind in SETTINGS.items()}
    _describe(properties, cls)
    properties |= {category: _category_schema(category) for category in CATEGORIES}
    assemblies = _list_of(AssemblyTable, {"$ref": f"#/$defs/{AssemblyTable.__name__}"})
    inner = {"type": "object", "properties": dict(properties) | {ASSEMBLIES: assemblies}, "additionalProperties": False}
    properties[DEFINITIONS] = {
        "description": "Mechanisms of which copies are added by [[assemblies]], by name.",
        "type": "object",
        "additionalProperties": inner,
    }
    properties[ASSEMBLIES] = assemblies
    return {
        "$schema": DIALECT,
        "title": "flyball model",
        "description": first_doc_line(cls),
        "type": "object",
        "properties": properties,
        "additionalProperties": False,
        "$defs": _definitions(),
    }


def _category_schema(category: str) -> dict[str, Any]:
    """Return the schema of all tables of a category."""
    if category in ONE_KIND:
        return _list_of(ONE_KIND[category], {"$ref": f"#/$defs/{ONE_KIND[category].__name__}"})
    base = MANY_KINDS[category][0] if category in MANY_KINDS else FEW_KINDS[category][DEFAULT_KINDS[category]]
    return _list_of(base, _selected_by_type(element_types(category), DEFAULT_KINDS.get(category, "")))


def _list_of(cls: type, items: dict[str, Any]) -> dict[str, Any]:
    return {"description": first_doc_line(cls), "type": "array", "items": items}


def _selected_by_type(names: list[str], default: str = "") -> dict[str, Any]:
    """Return the schema of a table whose ``type`` is one of these names, or may be left out if there is a default.

    Conditions find the errors of the named type only. Editors complete fields by ``anyOf``, whose first member accepts
    every table: they do not read conditions.
    """
    references = [{"$ref": f"#/$defs/{name}"} for name in names]
    conditions = [
        {"properties": {"type": {"const": name}}} | ({} if name == default else {"required": ["type"]})
        for name in names
    ]
    return {
        "type": "object",
        "properties": {"type": {"type": "string", "enum": names} | ({"default": default} if default else {})},
        "required": [] if default else ["type"],
        "allOf": [{"if": c, "then": r} for c, r in zip(conditions, references, strict=True)],
        "anyOf": [{}, *references],
    }


def _definitions() -> dict[str, Any]:
    """Return the schemas of all elements, shapes and actions by name."""
    found = {cls.__name__: _table_schema(cls) for cls in (*ONE_KIND.values(), AssemblyTable)}
    for category in (*MANY_KINDS, *DEFAULT_KINDS):
        found |= {name: _table_schema(Element.registry[name], typed=True) for name in element_types(category)}
    shapes = {c.__name__: c for c in (*SHAPES, *SURFACES)}
    shapes |= {k: c for k, c in Element.registry.items() if issubclass(c, Solid) and _is_own(c)}
    several: list[tuple[Any, Mapping[str, Any]]] = [(Solid, shapes), (Action, Action.registry)]
    for base, members in (*several, *(_values_of_fields(category) for category in VALUE_CATEGORIES)):
        found |= {name: _table_schema(c, typed=True) for name, c in members.items()}
        found[base.__name__] = {"description": first_doc_line(base)} | _selected_by_type(sorted(members))
    return dict(sorted(found.items()))


VALUE_CATEGORIES = ("road surfaces", "tyre models")
"""Elements that are values of fields of others, each with its ``type``."""


def _values_of_fields(category: str) -> tuple[type[Element], dict[str, type[Element]]]:
    """Return the base class of a category, and the classes that a file may name."""
    classes = [c for c in Element.registry.values() if c.category == category]
    base = next(c for c in classes if Element in c.__bases__)
    return base, {c.__name__: c for c in classes if "__signature__" in vars(c)}


def _is_own(cls: type) -> bool:
    """Return whether a class is one of the user's."""
    return cls.__module__.partition(".")[0] != "flyball"


def _type_schema(kind: Any) -> dict[str, Any]:
    """Return the schema of a type; definitions that it refers to are those of `_definitions`."""
    schema = TypeAdapter(kind).json_schema(schema_generator=_FieldSchema)
    schema.pop("$defs", None)
    return schema


def _table_schema(cls: type, typed: bool = False) -> dict[str, Any]:
    """Return the schema of the table of an element; ``typed``: its ``type`` names the element."""
    schema = _type_schema(cls)
    _describe(schema["properties"], cls)
    kind = {"type": {"description": first_doc_line(cls), "type": "string", "const": cls.__name__}}
    if not issubclass(cls, (Solid, Action)) and getattr(cls, "category", "") not in VALUE_CATEGORIES:
        schema["properties"] |= {REPEAT: REPEAT_SCHEMA}
    return {
        "description": first_doc_line(cls),
        "type": "object",
        "properties": (kind if typed else {}) | schema["properties"],
        "required": schema.get("required", []),
        "additionalProperties": False,
    }


def _describe(properties: Mapping[str, dict[str, Any]], cls: type) -> None:
    """Add descriptions from the docstrings of a class and of those that it extends; remove defaults that are None.

    A field that has no entry there is described by its unit.

    Raises
    ------
    ModelError
        If a docstring has a line in its section Parameters that is not ``name : type``.
    """
    units = fields_with(cls, Unit) if dataclasses.is_dataclass(cls) else {}
    entries = {name: ArgumentHelp(f"number [{unit.dimension}]") for name, unit in units.items() if unit.dimension}
    for c in reversed(cls.__mro__[:-1]):
        try:
            described = argument_help(c)
        except ValueError as error:  # of a class of the user's
            raise ModelError(f"no schema of {error}") from None
        entries |= {k: entry for k, entry in described.items() if entry.text or not entries.get(k, entry).text}
    for name, schema in properties.items():
        entry = entries.get(name, ArgumentHelp())
        sentence = _SENTENCE_END.split(entry.text)[0]
        plain = entry.choices or entry.type in ("str", "bool", "int")  # as the schema says itself
        schema["description"] = sentence if sentence and plain else f"{entry.type}: {sentence}".removesuffix(": ")
        if schema.get("default", "") is None:
            del schema["default"]
