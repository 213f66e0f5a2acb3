"""Everything that a result says is the same in absolute and in joint coordinates, at the same states.

Reactions come from multipliers in the one and, for tree joints, from the backward sweep in the other.
"""

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.assemble import assemble
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.model.body import GROUND
from flyball.tables import constraint_rows
from tests.contract.zoo import CASES as ZOO
from tests.contract.zoo import declared
from tests.examples.test_examples import FILES, mechanism
from tests.identities.test_coordinates import CASES
from tests.identities.test_joint_layer import HINGES, PARTS, coupled, hung, with_joint
from tests.identities.test_newton_euler import MORE
from tests.results.at_states import assembled, in_other_coordinates

COMPONENTS = ["force x", "force y", "force z", "torque x", "torque y", "torque z"]
ALONE = ("kinetic", "gravity", "elastic", "total")


def wrench(r, name):
    """Force and torque of a joint over time, (6, n)."""
    force, torque = r[name].reaction()
    return np.vstack([force.T, torque.T])


def determinate(r, name):
    """Which components of a joint's reaction redundancy leaves alone."""
    free = {"torque z" if c == "torque" else c for c in r[name].undetermined}
    return [c not in free for c in COMPONENTS]


def motions(r):
    """Every curve of position, velocity and acceleration of bodies, frames and joints, with the order of derivative."""
    for e in [*r.model.bodies, *r.model.frames]:
        if e.name != GROUND:
            view = r[e.name]
            yield f"{e.name}.position", 0, view.position
            yield f"{e.name}.orientation", 0, view.angle if r.planar else view.rotation
            yield f"{e.name}.velocity", 1, view.velocity
            yield f"{e.name}.angular velocity", 1, view.angular_velocity
            yield f"{e.name}.acceleration", 2, view.acceleration
            yield f"{e.name}.angular acceleration", 2, view.angular_acceleration
    for joint in r.model.joints:
        for what in joint.measured(r.planar):
            for order, ending in enumerate(("", "_rate", "_acceleration")):
                yield f"{joint.name}.{what}{ending}", order, getattr(r[joint.name], what + ending)


def loads(r):
    """What forces do; what drivers and couplings have to do unless redundancy leaves it open: (name, curve)."""
    for f in r.model.forces:
        for what in f.outputs:
            yield f"{f.name}.{what}", getattr(r[f.name], what)
        if not f.outputs and f.acts():
            yield f.name, np.hstack(r[f.name].wrench)
    for k in r.model.couplings:
        for what in k.coupled() if k.name not in r.health.redundant else ():
            yield f"{k.name}.{what}", r[k.name].effort(what)
    for d in r.model.drivers:
        if d.name not in r.health.redundant:
            yield d.name, r[d.name].effort


def agree(r, o, close=1e-9, reactions=True):
    """Both results say the same, relative to the largest of what is compared.

    ``reactions=False``: leave out what joints, drivers and forces do. Which reactions redundancy leaves open is known
    at the start only; later it may be others.
    """
    size = [1.0, 1.0, 1.0]
    curves = list(motions(r))
    for _, order, x in curves:
        size[order] = max(size[order], np.abs(x).max(initial=0.0))
    for (name, order, x), (_, _, y) in zip(curves, motions(o), strict=True):
        assert y == pytest.approx(x, abs=close * size[order]), name
    for what in ALONE:
        x = getattr(r.energy, what)
        assert getattr(o.energy, what) == pytest.approx(x, rel=1e-9, abs=close * r.energy.kinetic.max() + 1e-12), what
    if not reactions:
        return
    carried = {j.name: wrench(r, j.name) for j in r.model.joints}
    mass = sum(r.values.bodies[b.name].mass for b in r.model.bodies)
    largest = max(1e-3 * mass, *(np.abs(w).max() for w in carried.values()))  # at rest there is rounding only
    for name, w in carried.items():
        told = determinate(r, name)
        assert wrench(o, name)[told] == pytest.approx(w[told], abs=close * largest), f"reaction of {name}"
    for (name, x), (_, y) in zip(loads(r), loads(o), strict=True):
        assert y == pytest.approx(x, rel=close, abs=close * largest), name


def spanning_tree(model, seed=0):
    """Joints that close no loop, picked in random order: some are hung the other way round."""
    part = {b.name: b.name for b in model.bodies} | {GROUND: GROUND}
    out = []
    for k in np.random.default_rng(seed).permutation(len(model.joints)):
        joint = model.joints[k]
        a, b = (part[model.carrier(x, joint)] for x in (joint.body_i, joint.body_j))
        if a != b and joint.chain is not None:
            out.append(joint.name)
            part = {name: b if p == a else p for name, p in part.items()}
    return out


def compare(model, tree, close=1e-9):
    a = assemble(model)
    r = assembled(a)
    agree(r, in_other_coordinates(r, compile_mechanism(model, tree=tree), a.compiled), close)


@pytest.mark.parametrize("case", CASES)
def test_mechanisms(case):
    make, tree = CASES[case]
    compare(make(), tree)


@pytest.mark.parametrize(("where", "name"), ZOO, ids=lambda x: x)
def test_every_joint_as_rows(where, name):
    compare(with_joint(where, name), HINGES)


@pytest.mark.parametrize(("where", "name"), ZOO, ids=lambda x: x)
def test_every_joint_as_a_tree_joint(where, name):
    compare(with_joint(where, name), [*HINGES, "J"])


@pytest.mark.parametrize(("where", "name"), ZOO, ids=lambda x: x)
def test_every_joint_hung_the_other_way_round(where, name):
    """Named from the body beyond: its chain is gone back, its reaction is that on the nearer body."""
    m = hung(where)
    m.add(getattr(fb, name)("J", "b", "a", **declared(where, name)))
    c = compile_mechanism(m, tree=[*HINGES, "J"])
    assert c.structure.tree_joints["J"].reversed
    compare(m, [*HINGES, "J"])


@pytest.mark.parametrize("tree", [HINGES, [*HINGES, "J"]], ids=["J as rows", "J as a tree joint"])
@pytest.mark.parametrize("case", PARTS)
def test_couplings_forces_and_drivers(case, tree):
    compare(coupled(*PARTS[case]()), tree)


@pytest.mark.parametrize("case", MORE)
def test_more(case):
    m = MORE[case]()
    rubbed = {f.joint for f in m.forces if hasattr(f, "load")}  # friction needs its joint's rows
    compare(m, [name for name in spanning_tree(m) if name not in rubbed])


@pytest.mark.parametrize("name", FILES)
def test_examples(name):
    """In motion; one of their trees, whichever it is."""
    m = mechanism(name)
    if constraint_rows.declared_switches(m):
        pytest.skip("what holds in it is of its motion: see tests/events")
    a = assemble(m)
    r = m.simulate(0.05, outputs=4, coordinates="absolute")
    if r.health.redundant:  # what it leaves open is known at the start only
        r = assembled(a)
    tree = spanning_tree(m)
    if not tree:
        pytest.skip("no joint of it can be a tree joint")
    agree(r, in_other_coordinates(r, compile_mechanism(m, tree=tree), a.compiled))
