"""What editors and ``help`` show of an element: its fields, those without a name first."""

from __future__ import annotations

import dataclasses
import inspect

import pytest

import flyball as fb
from flyball.model.element import Element

ALL = sorted(
    {name for name in dir(fb) if isinstance(getattr(fb, name), type) and issubclass(getattr(fb, name), Element)}
)


@pytest.mark.parametrize("name", [*ALL, "Set", "Lock", "Release", "Impulse", "Note", "Stop"])
def test_fields_are_shown(name: str) -> None:
    cls = getattr(fb, name)
    shown = inspect.signature(cls).parameters
    assert set(shown) == {f.name for f in dataclasses.fields(cls)}
    for p in shown.values():
        f = cls.__dataclass_fields__[p.name]
        assert (p.kind is p.KEYWORD_ONLY) == f.kw_only
        assert p.kind is not p.VAR_POSITIONAL
    assert list(inspect.signature(cls.__init__).parameters) == ["self", *shown]


def test_they_stay_once_one_is_made() -> None:
    before = str(inspect.signature(fb.Rope))
    assert before.startswith(
        "(name: str, bodies: tuple[str, ...], *, at: Points | None = None, stiffness: Stiffness | None"
    )
    fb.Rope("r", ("a", "b"), length=1)
    assert str(inspect.signature(fb.Rope)) == before


def test_points_in_place_of_names_are_explained() -> None:
    with pytest.raises(fb.ModelError, match=r"field 'bodies' must be a list of texts, got \('a', \(0, 0\)\)"):
        fb.Rope("rope", ("a", (0, 0)))
