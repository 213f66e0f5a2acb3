"""Random mechanisms in absolute and in joint coordinates: the same accelerations as a dense solve, the same reactions,
efforts and motions.

Their trees are picked at random: joints hung either way round, welds, chains of massless links, floating bases, loops,
redundant rows, drivers that prescribe a coordinate in the one layer and are rows in the other.
"""

from dataclasses import replace

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.assemble import assemble
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.engine.entry_point import MOTION
from tests.contract.zoo import JOINTS
from tests.identities.test_results_in_both_layers import agree, spanning_tree
from tests.results.at_states import assembled, in_other_coordinates
from tests.robust.families import FAMILIES, made

EACH, FEW = 30, 5
CERTAIN = 1e-10  # singular values below this part of the largest are none
APART = 1e-3  # one between says that digits are lost
RUBBED = 1e-6  # what the loads that friction feels are found to


def rubbed(m):
    """Joints whose reactions friction needs: they must be rows."""
    return {f.joint for f in m.forces if hasattr(f, "load")}


def with_exchanged_ends(m):
    """The same joints from the other end: a tree grown from its root meets them reversed."""
    return m.changed({j.name: replace(j, body_i=j.body_j, body_j=j.body_i) for j in m.joints})


def cases(family, count=EACH, exchanged=True):
    """Mechanisms that can be assembled and have a tree: (seed, model, start, tree); of some, joints from the other end."""
    for seed in range(count):
        m = made(family, seed).mechanism
        if exchanged and seed % 3 == 2:
            try:
                m = with_exchanged_ends(m)
            except fb.ModelError:  # a part names an end
                continue
        tree = [name for name in spanning_tree(m, seed) if name not in rubbed(m)]
        try:
            a = assemble(m)
        except fb.FlyballError:
            continue
        if tree:
            yield seed, m, a, tree


def exact(a):
    """Accelerations in absolute coordinates by a dense solve; none where constraints are ill-conditioned or disagree."""
    c = a.compiled
    c.at(a.t, a.q, a.v, MOTION)
    G, gamma, R = c.jacobian(), c.work.rows.gamma, c.inverse_mass_root(np.ones(c.structure.nv))
    x = R @ (R.T @ c.work.velocities.applied)  # without constraints
    if len(G):
        B = G @ R
        size = np.linalg.norm(B, axis=1)
        if not size.all():  # a driven deflection of 0: the solvers refuse it
            return None
        U, d, V = np.linalg.svd(B / size[:, None], full_matrices=False)
        kept = d > CERTAIN * d[0]
        wanted = (gamma - G @ x) / size
        largest = max(np.abs(wanted).max(), np.abs(gamma / size).max(), 1e-3)
        x = x + R @ (V[kept].T @ ((U[:, kept].T @ wanted) / d[kept]))
        if d[kept].min() < APART * d[0] or np.abs((gamma - G @ x) / size).max() > 1e-9 * largest:
            return None
    return x


def absolute(r, structure):
    """A result's accelerations, at its first time, as those of absolute coordinates."""
    x = np.zeros(structure.nv)
    for name, b in structure.place.items():
        if b >= 0:
            _, R, _, _, alpha, a = (np.array(part)[..., 0] for part in r.records.body(r.values.structure.place[name]))
            at = structure.tables["tree"].v[b]
            own = (a[0], a[1], alpha[2]) if r.planar else (*a, *(R.reshape(3, 3).T @ alpha))
            x[at : at + len(own)] = own
    return x


# those have digits of their own; an ideal rope has no tension without a motion
@pytest.mark.parametrize(
    "family",
    [f for f in FAMILIES if f not in ("extremes", "stiff", "ropes", "happenings", "shaken")],
)
def test_the_same_at_the_same_state(family):
    compared = 0
    for seed, m, a, tree in cases(family, FEW if family == "crowds" else EACH):
        if any(isinstance(f, fb.Brake | fb.Clutch) for f in m.forces):  # at rest which way it slides is rounding
            continue
        if any(isinstance(f, fb.Rope) and f.length is None and f.damping for f in m.forces):
            continue  # just taut in the reference configuration: whether it damps is rounding
        x = exact(a)
        r = assembled(a) if x is not None else None
        if r is None or (rubbed(m) and r.health.redundant):  # loads that are open leave friction open
            continue
        compared += 1
        close = RUBBED if rubbed(m) else 1e-9
        o = in_other_coordinates(r, compile_mechanism(m, tree=tree), a.compiled)
        size = max(np.abs(x).max(), 1.0)
        for layer, result in (("absolute", r), ("joint", o)):
            found = absolute(result, a.compiled.structure)
            assert found == pytest.approx(x, abs=close * size), (family, seed, layer)
        try:
            agree(r, o, close)
        except AssertionError as error:
            raise AssertionError(f"{family} {seed}: {error}") from None
    assert compared > 3


@pytest.mark.parametrize("family", ["chains", "trees", "loops", "redundant", "drivers", "couplings", "friction"])
def test_the_same_motion(family):
    """For a twentieth of a second, in the coordinates that the program chooses; joints that rub are rows."""
    compared = 0
    for seed, m, a, _ in cases(family, 12, exchanged=False):
        if exact(a) is None or (rubbed(m) and assembled(a).health.redundant):
            continue
        try:
            r, o = (m.simulate(0.05, outputs=3, rtol=1e-11, atol=1e-13, coordinates=c) for c in ("absolute", "joint"))
        except fb.SimulationError:
            continue
        assert not rubbed(m) & set(o.values.structure.tree)
        compared += 1
        try:
            agree(r, o, RUBBED if rubbed(m) else 1e-8, reactions=not r.health.redundant)
        except AssertionError as error:
            raise AssertionError(f"{family} {seed}: {error}") from None
        moved = np.ptp(r.energy.kinetic) + np.ptp(r.energy.potential) + 0.1 * r.energy.kinetic.max()
        assert max(r.energy.drift, o.energy.drift) < 1e-7 * moved + 1e-9, (family, seed)
    assert compared > 3


def test_every_kind_of_tree_joint_takes_part():
    """Each joint of the registry that can be a tree joint is one somewhere, and nearly all in both senses."""
    seen = set()
    for family in ("chains", "trees", "loops", "redundant", "extremes"):
        for _, m, _, tree in cases(family):
            joints = compile_mechanism(m, tree=tree).structure.tree_joints.values()
            seen |= {(type(t.joint).__name__, m.planar, t.reversed) for t in joints}
    can = {(c.__name__, False) for c in JOINTS if c.spatial and c.chain is not None}
    can |= {(c.__name__, True) for c in JOINTS if c.planar_normal and c.chain is not None}
    assert {kind[:2] for kind in seen} == can
    assert sum(turned for *_, turned in seen) > 0.8 * len(can)
