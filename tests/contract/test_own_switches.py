"""A kind of switch in the user's own file: its guard is called by address, its rows and words are its own."""

from __future__ import annotations

import math
from dataclasses import field
from typing import ClassVar

import numpy as np
import pytest

import flyball as fb
from flyball.constraints.switches.switch_kind import ANY_FORCE, G_HOLDS, G_UPPER, INTERVAL, OFF
from flyball.elements import Number, ProblemRow, Switch, SwitchKind, Unilateral, element
from flyball.model.element import Element
from flyball.numerics.complementarity.dense_problem import AT_REST, BILATERAL, FRICTION_LINE
from flyball.testing import ContractError, check_element


class CatchKind(SwitchKind):
    """A row that closes where a quantity falls through zero slowly, and opens at a force."""

    @staticmethod
    def guard(mode, way, x, rate, force, numbers, units):
        return x if mode == 0.0 else math.nan

    def _engages(self, n, s, still):
        caught = n.mode[s] != OFF
        return caught or (abs(n.x[s]) <= n.near[s] and abs(n.rate[s]) <= n.S.switch_numbers.stiffness[s])

    def velocity_rows(self, n, s, at, still):
        return [ProblemRow(s, BILATERAL)] if self._engages(n, s, still) and n.mode[s] == OFF and not still else []

    def acceleration_rows(self, n, s, at, still):
        if not (still and self._engages(n, s, still)):
            return []
        return [ProblemRow(s, FRICTION_LINE, const=float(n.S.switch_numbers.strength[s]), state=AT_REST)]


CATCH = CatchKind(
    guards=(G_HOLDS,), forces=INTERVAL, numbers=("stiffness", "strength"), role="is caught", closing=("catch", "catches"),
    opening=("escape", "escapes"), states=("caught", "free"),
)  # fmt: skip


@element
class Magnet(Unilateral):
    """A magnetic catch at zero: it takes what comes slower than ``speed``, and holds it up to a force."""

    coordinate: str = field(kw_only=False)
    speed: Number = 1.0
    strength: Number = 5.0
    stiffness: ClassVar = None

    def along(self):
        return (self.coordinate,)

    def switch_weights(self, n, label):
        return (1.0,)

    def switches(self):
        return (Switch(CATCH, along=self.along(), weighted=True),)

    def switched(self, n, label, separation):
        return (n.speed, n.strength)


@pytest.fixture(autouse=True, scope="module")
def forgotten():
    yield
    for name in ("Magnet", "Hook", "Printer", "Bolt"):
        Element.registry.pop(name, None)
        Element.modules.pop(name, None)


def run(coordinates, pull, **catch):
    m = fb.Mechanism("door", planar=True)
    m.add(fb.Body("b", mass=1.0, inertia=0.1, position=(0.0, 0.0), velocity=(-0.5, 0.0)))
    m.add(fb.Prismatic("P", "ground", "b", at=(-1.0, 0.0), axis=(1.0, 0.0), displacement=1.0))
    m.add(fb.Actuator("pull", "P.displacement", force=pull), Magnet("catch", "P.displacement", **catch))
    return m.simulate(4.0, coordinates=coordinates, outputs=401)


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_slow_ones_are_caught_and_escape_at_the_force(coordinates):
    r = run(coordinates, "3*max(t - 2.5, 0)", strength=3.0)
    assert [(x.kind, x.name) for x in r.events] == [("impact", "catch"), ("escape", "catch")]
    assert r.events.t == pytest.approx([2.0, 3.5], rel=1e-9)
    held = (r.t > 2.0) & (r.t < 3.5)
    assert r["catch"].force[held] == pytest.approx(-3.0 * np.maximum(r.t[held] - 2.5, 0.0), abs=1e-9)
    assert r["catch"].closed[held] == pytest.approx(1.0)
    assert r["b"].velocity[-1, 0] == pytest.approx(3.0 * (1.5**2 - 1.0) / 2.0, rel=1e-8)
    assert abs(r.energy.balance).max() < 1e-8


def test_fast_ones_pass():
    r = run("joint", "0", speed=0.4)
    assert not len(r.events)
    assert r["b"].velocity[-1, 0] == pytest.approx(-0.5)


def test_the_contract_covers_motions_and_the_guard():
    assert {"guard", "file", "books", "layers"} <= set(check_element(Magnet("catch", "P.displacement", speed=0.1)))


class PrinterKind(CatchKind):
    """Its guard gives in Python what no compiled code can."""

    @staticmethod
    def guard(mode, way, x, rate, force, numbers, units):
        return float(f"{x:.17g}")


@element
class Printer(Magnet):
    """A catch with such a guard."""

    def switches(self):
        return (Switch(PrinterKind(**vars(CATCH)), along=self.along(), weighted=True),)


def test_a_guard_that_cannot_be_compiled_breaks_the_contract():
    with pytest.raises(ContractError, match=r"Printer 'catch' fails the check 'guard': .*cannot be compiled"):
        check_element(Printer("catch", "P.displacement"))


def test_at_rest_a_kind_must_say_whether_it_holds():
    m = fb.Mechanism("door", planar=True)
    m.add(fb.Body("b", mass=1.0, inertia=0.1, position=(0.0, 0.0)))
    m.add(fb.Prismatic("P", "ground", "b", at=(0.0, 0.0), axis=(1.0, 0.0)), Magnet("catch", "P.displacement"))
    with pytest.raises(
        fb.ModelError, match=r"Magnet 'catch': CatchKind does not say .*; define push_direction\(self, x, "
    ):
        m.equilibrium()


@element
class Bolt(Magnet):
    """A latch whose event function is the distance from a bound."""

    def switches(self):
        kind = CatchKind(**(vars(CATCH) | {"guards": (G_UPPER,), "numbers": ("upper", "strength")}))
        return (Switch(kind, along=self.along(), weighted=True),)


def test_a_start_beyond_the_bound_of_a_guard_is_refused():
    m = fb.Mechanism("door", planar=True)
    m.add(fb.Body("b", mass=1.0, inertia=0.1, position=(0.0, 0.0), velocity=(0.5, 0.0)))
    m.add(fb.Prismatic("P", "ground", "b", at=(-1.0, 0.0), axis=(1.0, 0.0), displacement=1.5))
    m.add(Bolt("bolt", "P.displacement", speed=1.0))
    said = (
        r"Bolt 'bolt': the motion starts beyond it: .*P.displacement is 1.5 m and must be at most 1 m; change the start"
    )
    with pytest.raises(fb.ModelError, match=said):
        m.simulate(1.0)


class HookKind(SwitchKind):
    """A row that holds either way where its quantity is zero."""

    @staticmethod
    def guard(mode, way, x, rate, force, numbers, units):
        return x if mode == 0.0 else math.nan

    def velocity_rows(self, n, s, at, still):
        return [ProblemRow(s, BILATERAL)] if n.mode[s] != OFF or abs(n.x[s]) <= n.near[s] else []

    def acceleration_rows(self, n, s, at, still):
        return self.velocity_rows(n, s, at, still) if still else []

    def push_direction(self, x, bounds, near):
        return 0.0 if abs(x) <= near else None


HOOK = HookKind(guards=(G_HOLDS,), forces=ANY_FORCE, role="is held", closing=("hold", "holds"), states=("held", "free"))


@element
class Hook(Magnet):
    """A hook that holds a coordinate at zero either way."""

    def switches(self):
        return (Switch(HOOK, along=self.along(), weighted=True),)

    def switched(self, n, label, separation):
        return ()


@pytest.mark.parametrize("pull", [2.0, -2.0, 0.0])
def test_what_holds_either_way_is_not_about_to_open(pull):
    m = fb.Mechanism("gate", planar=True)
    m.add(fb.Body("b", mass=1.0, inertia=0.1, position=(0.0, 0.0)))
    m.add(fb.Prismatic("P", "ground", "b", at=(0.0, 0.0), axis=(1.0, 0.0)))
    m.add(fb.Actuator("pull", "P.displacement", force=pull), Hook("hook", "P.displacement"))
    (touch,) = m.equilibrium().touching
    assert touch.state == "closed"
    assert touch.normal == pytest.approx(abs(pull), abs=1e-12)
