"""Finding one's way: help, completion and editors know all that is public."""

from __future__ import annotations

import ast
import inspect
import pydoc
import re

import pytest

import flyball as fb
from tests.program.copied import PACKAGE

PUBLIC = [n for n in dir(fb) if not n.startswith("_")]


ANALYSES = [
    (n, f)
    for n, f in inspect.getmembers(fb.Mechanism, inspect.isfunction)
    if f.__module__.startswith("flyball.mechanism_methods")
]


def test_the_map_names_every_public_class_and_nothing_else():
    told = set(re.findall(r"\b[A-Z]\w+", fb.__doc__))
    classes = {n for n in PUBLIC if inspect.isclass(getattr(fb, n))}
    assert classes - told <= {
        "PerformanceNotice",
        "SingularOrientationError",  # these of fb.rotations
        "SingularOrientationWarning",
    }
    for name in re.findall(r"\b[A-Z][a-zA-Z]+(?=,|;|$)", fb.__doc__, re.M):  # in lists
        assert hasattr(fb, name), name


def test_the_map_calls_methods_that_are_there():
    for name in re.findall(r"\bm\.(\w+)\(", fb.__doc__):
        assert callable(getattr(fb.Mechanism, name)), name
    methods = {n for n, f in ANALYSES if not n.startswith("_")}
    assert methods | {"add", "save"} <= set(re.findall(r"\bm\.(\w+)\(", fb.__doc__))
    for name in re.findall(r"\brun\.(\w+)\(", fb.__doc__):
        assert callable(getattr(fb.Result, name)), name


def names_for_editors(path, room: str) -> set[str]:
    """Names that a file imports, as one reads it who does not run it."""
    out = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            for a in node.names:
                if a.name == "*":
                    folder = PACKAGE.joinpath(*node.module.split("."))
                    out |= names_for_editors(folder / "__init__.py", node.module)
                elif a.asname == a.name:
                    out.add(a.name)
    return out


def test_editors_see_every_public_name():
    """What is loaded when first asked for stands in lines that editors and type checkers read."""
    assert names_for_editors(PACKAGE / "__init__.py", "") == set(PUBLIC)
    assert fb.__all__ == PUBLIC


def test_a_star_import_brings_all_public_names():
    scope: dict = {}
    exec("from flyball import *", scope)
    assert set(PUBLIC) <= set(scope)


def test_names_of_results_are_classes_that_analyses_return():
    """Each is annotated on the method that returns it."""
    returned = {str(f.__annotations__.get("return")) for _, f in ANALYSES}
    assert returned >= {"Result", "Equilibrium", "Modes", "Sensitivity"}
    for name in returned:
        assert hasattr(fb, name), name


def test_help_begins_with_the_map():
    import pydoc

    text = pydoc.plain(pydoc.render_doc(fb))
    assert "Describe a mechanism" in text[:1500]
    assert "class Revolute" in text


@pytest.mark.parametrize(("wrong", "meant"), [("Revolut", "Revolute"), ("body", "Body"), ("Zzz", "")])
def test_a_wrong_name_of_the_package_gets_candidates(wrong, meant):
    with pytest.raises(AttributeError, match=rf"no attribute '{wrong}'( \(did you mean '{meant}\w*'\?\))?$") as error:
        getattr(fb, wrong)
    assert ("did you mean" in str(error.value)) == (wrong != "Zzz")


@pytest.mark.parametrize("kind", [fb.SpringDamper, fb.Sphere, fb.Body, fb.PID])
def test_help_of_an_element_says_nothing_of_pydantic(kind):
    assert "pydantic" not in pydoc.plain(pydoc.render_doc(kind)).lower()
