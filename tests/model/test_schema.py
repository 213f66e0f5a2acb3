"""The JSON schema of model files accepts what loads, and finds what can be known of one field alone to be wrong."""

from __future__ import annotations

import dataclasses
import tomllib
from copy import deepcopy
from typing import Any

import jsonschema
import pytest

import flyball as fb
from flyball.cli.view import model_files
from flyball.model.element import Element
from flyball.model.event import Action
from flyball.model.json_schema import model_schema
from flyball.model.model_files import dumps
from flyball.model.snapshot import CATEGORIES
from tests.errors.test_every_field import CASES as EVERY_FIELD
from tests.pages import ROOT

SCHEMA = model_schema(fb.Mechanism)
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)
FILES = {p.stem: p for p in (*(ROOT / "examples").glob("*.toml"), *model_files().values())}
DATA = {name: tomllib.loads(path.read_text(encoding="utf-8")) for name, path in FILES.items()}
ELEMENTS = [c for c in (getattr(fb, n) for n in dir(fb)) if isinstance(c, type) and issubclass(c, (Element, Action))]


def messages(data: Any) -> list[str]:
    return [e.message for e in VALIDATOR.iter_errors(data)]


def test_it_is_a_schema_of_the_dialect_it_names():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert jsonschema.validators.validator_for(SCHEMA) is jsonschema.Draft202012Validator
    assert set(CATEGORIES) < set(SCHEMA["properties"])


@pytest.mark.parametrize("name", sorted(FILES))
def test_files_that_load_are_valid(name):
    assert messages(DATA[name]) == []


@pytest.mark.parametrize("case", EVERY_FIELD)
def test_every_field_of_every_element_is_accepted(case):
    made, *args = EVERY_FIELD[case]
    for m in {id(m): m for m, _ in made(*args)}.values():
        assert messages(tomllib.loads(dumps(m))) == []


@pytest.mark.parametrize(
    "table",
    [
        {"contacts": [{"between": "a", "others": ["b", "c"], "exclude": ["a", "b"], "law": "hertz"}]},
        {"events": [{"name": "e", "when": "t > 1", "do": {"type": "Stop"}}]},
        {"bulk": [{"name": "grains", "shape": {"type": "Sphere", "radius": 1}, "position": "grains.csv"}]},
        {"controllers": [{"type": "StateSpace", "name": "K", "inputs": "A.angle", "D": 3}]},
        {"frames": [{"name": "f", "body": "b", "orientation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}]},
        {"limits": [{"name": "stop", "coordinate": "A.angle", "lower": 0}]},
    ],
)
def test_short_forms_are_accepted(table):
    assert messages(table) == []


@pytest.mark.parametrize("cls", ELEMENTS, ids=lambda c: c.__name__)
def test_every_public_element_and_action_is_described(cls):
    table = SCHEMA["$defs"][cls.__name__]
    assert table["description"]
    for name, field in table["properties"].items():
        assert field["description"], name
        assert {"type", "anyOf", "$ref"} & set(field), name
    assert set(table["properties"]) - {"type", "repeat"} == {f.name for f in dataclasses.fields(cls)}


def test_units_defaults_and_choices_are_told():
    spring, table = (SCHEMA["$defs"][k]["properties"] for k in ("SpringDamper", "Table"))
    assert "[N/m]" in spring["stiffness"]["description"]
    assert spring["damping"]["default"] == 0.0
    assert table["interpolation"]["enum"] == ["cubic", "monotone", "linear"]
    assert SCHEMA["$defs"]["Contact"]["properties"]["law"]["enum"] == ["hard", "linear", "hertz", "hunt-crossley"]


def changed(data: dict[str, Any], change: Any):
    """Copies of a file's data, each with one table changed; with its category."""
    for category in set(data) & set(CATEGORIES):
        for k in range(len(data[category])):
            other = deepcopy(data)
            if change(category, other[category][k]):
                yield other, f"[[{category}]] {k + 1}"


def misspelt(category: str, table: dict[str, Any]) -> bool:
    key = list(table)[-1]
    table[key[:-1] + "_" + key[-1]] = table.pop(key)
    return True


def of_another_type(category: str, table: dict[str, Any]) -> bool:
    table[list(table)[-1]] = {"no": "such"}
    return True


def without_its_name(category: str, table: dict[str, Any]) -> bool:
    return category != "contacts" and table.pop("name", "") != ""


def of_unknown_type(category: str, table: dict[str, Any]) -> bool:
    table["type"] = "Revolut"
    return True


def without_its_type(category: str, table: dict[str, Any]) -> bool:
    return category != "limits" and table.pop("type", "") != ""


@pytest.mark.parametrize("name", sorted(FILES))
@pytest.mark.parametrize("change", [misspelt, of_another_type, without_its_name, of_unknown_type, without_its_type])
def test_typical_mistakes_are_found(name, change):
    for data, where in changed(DATA[name], change):
        assert messages(data), where


def test_a_message_names_the_mistake():
    data = deepcopy(DATA["four-bar"])
    data["joints"][1]["type"] = "Revolut"
    data["bodies"][0]["mas"] = data["bodies"][0].pop("mass")
    data["planar"] = "yes"
    told = "; ".join(messages(data))
    for words in ("'Revolut' is not one of", "'mas' was unexpected", "'yes' is not of type 'boolean'"):
        assert words in told
    assert "'joint' was unexpected" in messages({"joint": []})[0]


def test_types_of_the_users_own_are_included():
    @fb.elements.element
    class Rail(fb.elements.Joint):
        """A guide of one's own.

        Parameters
        ----------
        name : str
        gauge : number [m]
        """

        gauge: fb.elements.Length

    try:
        made = model_schema(fb.Mechanism)
    finally:
        del Element.registry["Rail"]
    assert "Rail" in made["properties"]["joints"]["items"]["properties"]["type"]["enum"]
    assert made["$defs"]["Rail"]["properties"]["gauge"]["description"] == "number [m]"
