"""A mechanism that was made ready earlier answers as a fresh one does, to the last bit, whatever was asked between."""

from __future__ import annotations

import dataclasses
import gc
import random
import weakref
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.errors import FlyballError
from flyball.model.snapshot import ResultCache
from flyball.simulation.initial_state import find_initial_state
from flyball.tables.coordinate_choice import spanning_joints
from flyball.tables.element_numbers import element_numbers
from flyball.tables.structure import Choices, structure
from flyball.tables.table_definitions import NUMBERS, named_arrays
from flyball.tables.values import Values, values
from tests import mechanisms
from tests.complex_steps import with_parameters
from tests.contract import zoo
from tests.examples.test_examples import FILES
from tests.identities.test_complex_values import with_forces

CLOCKED = ("seconds", "compiling")  # what the clock says of a motion differs from run to run


def bits(x: Values) -> dict[str, bytes]:
    found = {k: a for name in NUMBERS for k, a in named_arrays(getattr(x.system, name), name)} | {"q": x.q, "v": x.v}
    return {name: a.tobytes() for name, a in found.items()}


def answers(mechanism: fb.Mechanism, /, **parameters: float) -> dict[str, bytes] | str:
    """All numbers of a short motion, or why there is none; by one engine: auto takes code that has come to be since."""
    engine = {} if mechanism.contacts or mechanism.bulk else {"specialize": False}  # contact has but one
    try:
        r = mechanism.simulate(0.02, outputs=3, parameters=parameters or None, **engine)
    except FlyballError as error:
        return str(error)
    said = dataclasses.asdict(r.health).items()
    told = {k: v for k, v in said if isinstance(v, (int, float, str)) and k not in CLOCKED}
    arrays = {k: getattr(r, k).tobytes() for k in ("t", "q", "v", "vdot", "multipliers", "states")}
    return arrays | {k: repr(v).encode() for k, v in told.items()}


def same_tables(m: fb.Mechanism, chosen: random.Random) -> None:
    """With other values of some parameters, in both coordinate layers, real and complex."""
    tree = spanning_joints(m)
    names = list(m.parameters)
    for _ in range(12):
        some = chosen.sample(names, min(len(names), chosen.choice((1, 1, 2))))
        env = m.environment()
        given = {k: (env[k] or 0.1) * (1.0 + 1e-3 * chosen.random()) for k in some}
        if chosen.random() < 0.2:
            given = {k: complex(v, 1e-30) for k, v in given.items()}
        fresh = deepcopy(m)  # asked for these values only
        for choices in (Choices(), *([Choices(tree=tree)] if tree else [])):
            try:
                wanted = bits(values(structure(fresh, choices), given))
            except FlyballError:
                continue
            found = bits(values(structure(m, choices), given))
            assert [k for k in wanted if found[k] != wanted[k]] == [], (given, choices)


@pytest.mark.parametrize("name", FILES)
def test_another_value_fills_in_what_depends_on_it(name):
    m = mechanisms.example(name)
    chosen = random.Random(name)
    if m.parameters:
        same_tables(m, chosen)
    m, _ = with_parameters(m)
    same_tables(m, chosen)


@pytest.mark.parametrize(("where", "name"), zoo.CASES)
def test_every_joint_is_filled_in(where, name):
    m, _ = with_parameters(zoo.joined(where, name))
    same_tables(m, random.Random(name))


def edited(m: fb.Mechanism, chosen: random.Random) -> None:
    """One change of any kind that a user could make."""
    kind = chosen.choice(("parameter", "gravity", "replace", "remove", "initial"))
    with_mass = [b for b in m.bodies if isinstance(b.mass, (int, float))]
    if kind == "parameter" and m.parameters:
        k = chosen.choice(list(m.parameters))
        m.parameters[k] = m.environment()[k] * (1.0 + 1e-3 * chosen.random())
    elif kind == "gravity":
        m.gravity = tuple(9.0 + chosen.random() if g != 0.0 else 0.0 for g in m.gravity_vector()[: len(m.gravity)])
    elif kind == "replace" and with_mass:
        b = chosen.choice(with_mass)
        m.replace(dataclasses.replace(b, mass=b.mass * (1.0 + 1e-3 * chosen.random())))
    elif kind == "remove" and m.forces:
        m.forces.remove(chosen.choice(m.forces))
    elif kind == "initial" and m.initial:
        m.initial.pop()


@pytest.mark.parametrize("name", FILES)
def test_whatever_was_asked_and_changed_before(name):
    m = mechanisms.example(name)
    chosen = random.Random(name)
    for _ in range(5):
        given = {}
        if m.parameters and chosen.random() < 0.6:
            k = chosen.choice(list(m.parameters))
            given[k] = m.environment()[k] * (1.0 + 1e-3 * chosen.random())
        wanted = answers(deepcopy(m), **given)
        assert answers(m, **given) == wanted
        assert answers(m, **given) == wanted
        edited(m, chosen)


def test_analyses_leave_the_tables_as_they_are():
    m = mechanisms.example("governor.toml")
    wanted = answers(deepcopy(m))
    x = compile_mechanism(m).values
    before = bits(x)
    assert not m.mobility().sets
    steady = m.equilibrium(turning=["bearing.angle"])
    m.modes(about=steady)
    m.simulate(0.02, coordinates="absolute", stabilization="partitioning")
    m.simulate(0.02, coordinates="absolute", stabilization="baumgarte", alpha=5.0)
    assert compile_mechanism(m).values is x
    assert bits(x) == before
    assert answers(m) == wanted


def test_threads_share_what_is_ready():
    m = mechanisms.example("andrews.toml")
    wanted = [answers(deepcopy(m), torque=0.033 + 1e-3 * k) for k in range(8)]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(lambda k: answers(m, torque=0.033 + 1e-3 * k), range(8))) == wanted
        assert list(pool.map(lambda k: answers(m, torque=0.033 + 1e-3 * (k % 2)), range(8))) == wanted[:2] * 4


def test_a_snapshot_is_the_same_until_something_changes():
    m = mechanisms.example("slider_crank.toml")
    s = m.snapshot()
    assert m.snapshot() is s
    assert s.snapshot() is s
    m.parameters["speed"] = m.parameters["speed"]
    assert m.snapshot() is s
    m.joints.append(m.joints.pop())
    assert m.snapshot() is s
    m.gravity = (0.0, -1.0)
    assert m.snapshot() is not s
    with pytest.raises(fb.ModelError, match=r"for good; change a copy of it: m.copy\(\)"):
        s.gravity = (0.0, -2.0)
    with pytest.raises(fb.ModelError, match="nothing can be added"):
        m.simulate(0.01).model.add(fb.Body("x", mass=1, inertia=1))
    c = s.copy()
    c.add(fb.Body("x", mass=1, inertia=1))
    assert "x" not in s.names()


def test_tables_that_differ_keep_nothing_of_the_others():
    x = compile_mechanism(mechanisms.example("slider_crank.toml")).values
    for made in (x, x.structure):
        assert dataclasses.replace(made).cache is not made.cache


def test_what_was_made_of_earlier_values_is_let_go():
    m = mechanisms.example("slider_crank.toml")
    seen = []
    for k in range(12):  # each kind of tables is asked for at every other value only
        m.parameters["speed"] = 10.0 + k
        structure(m, Choices(far=bool(k % 2)))
        seen.append(weakref.ref(m.snapshot()))
    gc.collect()
    assert sum(s() is not None for s in seen) <= 2


@pytest.mark.parametrize("wrap", [list, np.array])
def test_gravity_that_is_changed_in_place(wrap):
    m = fb.Mechanism("stone", planar=True, gravity=(0, -10))
    m.add(fb.Body("b", mass=1, inertia=1))
    m.gravity = wrap([0.0, -10.0])
    assert m.simulate(1.0)["b"].y[-1] == pytest.approx(-5.0)
    m.gravity[1] = -2.0
    assert m.simulate(1.0)["b"].y[-1] == pytest.approx(-1.0)


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_a_parameter_of_the_model_can_make_another_thing_of_a_point_mass(coordinates):
    m = fb.Mechanism("bob", planar=True, gravity=(0, -9.81), parameters={"off": 0.0})
    m.add(fb.Body("bob", mass=1, inertia=0, position=(1, 0)))
    m.add(fb.Revolute("pin", "ground", "bob", at=("1 + off", 0)))
    m.add(fb.PointForce("push", "bob", force=(1, 0)))
    for off in (0.0, 0.5, 0.0):  # held where it is, hung beside it
        m.parameters["off"] = off
        assert answers(m, off=off) == answers(deepcopy(m), off=off)
        assert (
            compile_mechanism(m).structure.nv == compile_mechanism(deepcopy(m)).structure.nv == (2 if off == 0.0 else 3)
        )


def test_numbers_that_another_thread_finds_first_are_not_taken_for_ours(monkeypatch):
    m = mechanisms.example("slider_crank.toml")
    drop = ResultCache.drop

    def meanwhile(self, kind, key):
        drop(self, kind, key)
        if kind == "first numbers":
            monkeypatch.undo()
            element_numbers(m, {"speed": 3.0})

    monkeypatch.setattr(ResultCache, "drop", meanwhile)
    assert element_numbers(m, {"speed": 7.0}).env["speed"] == 7.0
    assert element_numbers(m, {"speed": 3.0}).env["speed"] == 3.0


def test_functions_whose_globals_change_are_made_again():
    scope = {"k": 1.0}
    exec("def pull(t):\n    return k", scope)
    m = fb.Mechanism("block", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1))
    m.add(fb.PointForce("F", "b", force=(scope["pull"], 0)))
    assert m.simulate(1.0)["b"].x[-1] == pytest.approx(0.5)
    scope["k"] = 3.0
    assert m.simulate(1.0)["b"].x[-1] == pytest.approx(1.5)


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_starts_that_are_handed_out_again_share_nothing(coordinates):
    """What a motion does to its start, and who reads its result later, is nothing to the next motion."""
    model = mechanisms.four_bar().snapshot()
    first, second, third = (find_initial_state(model, 0.0, None, None, coordinates, switches=True) for _ in range(3))
    for a, b in ((first, second), (second, third)):
        assert a.base is not b.base
        assert a.wound is not b.wound
        for x, y in ((a.base, b.base), (a.assembly, b.assembly)):
            assert not any(np.shares_memory(getattr(x, k), getattr(y, k)) for k in ("q", "v"))
            assert x.compiled.scratch is not y.compiled.scratch
            assert x.compiled.values is y.compiled.values
        assert not np.shares_memory(a.y, b.y)
        assert a.y.tobytes() == b.y.tobytes()
        assert (a.assembly is a.base) == (b.assembly is b.base)


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
@pytest.mark.parametrize("where", ["space", "plane"])
def test_starts_of_other_forces_are_those_of_fresh_mechanisms(where, coordinates):
    """Every number of every element once differs from the values filled in first: of forces most starts are shared."""
    m, names = with_parameters(with_forces(where))
    m, other = m.snapshot(), 1.0 + 1e-3
    find_initial_state(m, 0.0, None, None, coordinates, switches=True)
    shared = set()
    for field, name in names.items():
        try:
            here = find_initial_state(m, 0.0, {name: other}, None, coordinates, switches=True)
        except FlyballError:
            continue
        there = find_initial_state(m.copy().snapshot(), 0.0, {name: other}, None, coordinates, switches=True)
        for a, b in ((here.base, there.base), (here.assembly, there.assembly)):
            assert a.y.tobytes() == b.y.tobytes(), field
            assert bits(a.compiled.values) == bits(b.compiled.values), field
        assert (here.y.tobytes(), here.coordinates) == (there.y.tobytes(), there.coordinates), field
        if here.base.compiled.values.unforced is not here.base.compiled.values:
            shared.add(field.partition(".")[0])
    assert shared >= {"SpringDamper", "CoordinateSpring", "TorsionalSpringDamper", "JointFriction"}
