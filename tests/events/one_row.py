"""An element of the tests' own that is a row with a mode."""

from __future__ import annotations

from typing import ClassVar

import pytest

from flyball.constraints.switches.lock import LOCK
from flyball.constraints.switches.switch_kind import SwitchKind
from flyball.model.element import Element, element
from flyball.model.force import Switch

BOTH = pytest.mark.parametrize("coordinates", ["absolute", "joint"])


@element
class Row(Element):
    """A row with a mode, of the test's."""

    of: tuple[str, ...]
    kind: SwitchKind = LOCK
    par: tuple[float, ...] = ()
    weights: tuple[float, ...] = (1.0,)
    category: ClassVar[str] = "limits"

    def switches(self):
        return (Switch(self.kind, along=self.of),)

    def switched(self, n, *told):
        return self.par

    def acts(self):
        return False

    def switch_weights(self, n, *told):
        return self.weights


@pytest.fixture(autouse=True)
def forgotten():
    yield
    Element.registry.pop("Row", None)


def rows(m, *all_of):
    """With rows of the test's."""
    for r in all_of:
        m.limits.append(r)
        m.by_name[r.name] = r
    return m
