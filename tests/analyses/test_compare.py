"""Formulations of the same motion: how drift grows by each, that they agree where they must, what is told of failures.

Drift has closed forms. Without stabilization g'' = 0 in every row: a velocity that violates its row by e stays so, and
g = e t. With Baumgarte's g'' + 2 a g' + b^2 g = 0: for a = b, g = e t exp(-a t).
"""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import flyball as fb
from flyball.assembly.assemble import assemble
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.cli import app
from flyball.engine import stabilization
from flyball.engine.entry_point import MOTION
from flyball.simulation import initial_state
from flyball.studies import formulation_comparison as comparing
from flyball.tables.structure_definition import velocity_names
from flyball.tables.table_definitions import COUPLED, SCHUR
from tests.mechanisms import EXAMPLES, G, bricard, circles, door, example, four_bar, planar_rod

ROUNDING = 1e-12


def rockers():
    """A four-bar no link of which can turn fully: whichever angle is independent comes to where it turns back."""
    m = fb.Mechanism("rockers", planar=True, gravity=(0, -G))
    a, d = np.zeros(2), np.array([0.5, 0.0])
    b = 0.35 * np.array([np.cos(1.2), np.sin(1.2)])
    c = circles(b, 0.3, d, 0.4)
    m.add(planar_rod("left", a, b), planar_rod("middle", b, c), planar_rod("right", d, c))
    m.add(fb.Revolute("A", "ground", "left", at=a), fb.Revolute("B", "left", "middle", at=b))
    m.add(fb.Revolute("C", "middle", "right", at=c), fb.Revolute("D", "ground", "right", at=d))
    m.add(fb.Initial("A.angle", rate=3.0))
    return m


def spinning_crank():
    """The slider-crank without motor and spring, its crank thrown: full turns."""
    m = example("slider_crank.toml")
    m.drivers.clear()
    m.forces.clear()
    m.add(fb.Initial("A.angle", rate=30.0))
    return m


@pytest.fixture(scope="module")
def top():
    """The heavy top: smooth and long, so that errors add up as theory says."""
    return example("heavy_top.toml").compare(4.0, outputs=401, rtol=1e-8, atol=1e-10, repeats=0)


# ------------------------------------------------------------------------------------------------------- closed forms


@pytest.mark.parametrize(
    ("kind", "g", "rate"),
    [
        ("none", lambda t: t, lambda t: 1.0 + 0.0 * t),
        ("baumgarte", lambda t: t * np.exp(-10.0 * t), lambda t: (1.0 - 10.0 * t) * np.exp(-10.0 * t)),
        ("positions", lambda t: 0.0 * t, lambda t: 1.0 + 0.0 * t),
    ],
)
def test_a_violated_velocity_goes_on_as_the_equations_of_drift_say(kind, g, rate):
    """Go on from a result whose velocities violate one row by 1e-6; alpha = beta = 10/s."""
    m, e = four_bar(), 1e-6
    r = m.simulate(0.1, outputs=2, coordinates="absolute")
    s = r.values.structure
    c = compile_mechanism(m)
    t, y = r.final
    c.at(t, y[: s.nq].copy(), y[s.nq : s.nq + s.nv].copy())
    Gd = c.jacobian()
    y[s.nq : s.nq + s.nv] += e * np.linalg.lstsq(Gd, np.eye(len(Gd))[3], rcond=None)[0]
    more = {"rtol": 1e-12, "atol": 1e-14, "coordinates": "absolute"}
    r = m.simulate(0.6, start=r, outputs=26, stabilization=kind, **more)
    found = np.zeros((2, len(r.t), len(Gd)))
    for k, at in enumerate(r.t):
        c.at(at, r.q[k].copy(), r.v[k].copy())
        found[:, k] = c.work.rows.value, c.jacobian() @ r.v[k] - c.work.rows.nu
    others = np.arange(len(Gd)) != 3
    small = 1e-3 * e  # of second order in e, and of the steps
    assert found[0][:, 3] == pytest.approx(e * g(r.t - t), abs=small)
    if kind != "positions":  # where positions are put right all the way, the rows share what the velocities violate
        assert found[1][:, 3] == pytest.approx(e * rate(r.t - t), abs=small)
        assert np.abs(found[:, :, others]).max() < small
    else:
        assert np.abs(found[1]).max() > 0.1 * e


def grown(x, t, since, to):
    """How much larger the largest value up to ``to`` is than the one up to ``since``."""
    return x[t <= to].max() / x[t <= since].max()


def test_drift_grows_as_theory_says(top):
    """Without stabilization quadratically, with velocities kept linearly, with Baumgarte not at all."""
    t = top["none"].t
    assert grown(top["none"].g, t, 1.0, 4.0) == pytest.approx(16.0, rel=0.4)
    assert grown(top["none"].gv, t, 1.0, 4.0) == pytest.approx(4.0, rel=0.4)
    assert grown(top["velocities"].g, t, 1.0, 4.0) == pytest.approx(4.0, rel=0.4)
    assert grown(top["baumgarte"].g, t, 1.0, 4.0) < 1.5
    assert top["baumgarte"].position_drift < 0.05 * top["none"].position_drift


def test_what_is_projected_is_closed_and_the_rest_is_not(top):
    closed = {f.name: (f.position_drift < ROUNDING, f.velocity_drift < ROUNDING) for f in top}
    both = ("projection-steps", "projection", "partitioning", "coupled matrix", "joint coordinates")
    assert closed == dict.fromkeys(both, (True, True)) | {
        "none": (False, False),
        "baumgarte": (False, False),
        "positions": (True, False),
        "velocities": (False, True),
    }
    assert top["positions"].velocity_drift > 1e-9
    assert top["velocities"].position_drift > 1e-9


def test_drift_is_seen_as_it_is():
    """Output times do not put the motion right: more of them change no drift, where they shorten no step."""
    same = {"rtol": 1e-6, "atol": 1e-8, "repeats": 0, "formulations": ["none", "baumgarte"]}
    few, many = (four_bar().compare(2.0, outputs=n, **same) for n in (5, 401))
    for name in ("none", "baumgarte"):
        assert few[name].steps == many[name].steps
        assert few[name].g == pytest.approx(many[name].g[::100], abs=1e-15)
        assert few[name].g[-1] > ROUNDING


# ------------------------------------------------------------------------------------------------------ partitioning


@pytest.mark.parametrize(
    ("make", "t_end", "kept"),
    [
        (four_bar, 3.0, "A.angle"),
        (spinning_crank, 2.0, "A.angle"),
        (rockers, 1.5, "A.angle"),
        (bricard, 4.0, "R1.angle"),
    ],
)
@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_partitioning_gives_the_same_motion(make, t_end, kept, coordinates):
    tight = {"rtol": 1e-11, "atol": 1e-13, "outputs": 51, "coordinates": coordinates}
    true = make().simulate(t_end, **tight)
    r = make().simulate(t_end, stabilization="partitioning", **tight)
    assert r[kept] == pytest.approx(true[kept], abs=3e-7)
    assert np.ptp(true[kept]) > 1.0
    assert r.health.violation < ROUNDING
    assert r.health.velocity_violation < 1e-11
    assert r.energy.drift < 1e-7


def test_coordinates_change_places():
    """Where no angle serves all the way; full turns of a crank need no change."""
    names = ["projection", "partitioning"]
    swinging = rockers().compare(2.0, rtol=1e-10, atol=1e-12, repeats=0, formulations=names)
    assert swinging["partitioning"].exchanges > 2
    assert swinging["partitioning"].difference < 1e-6
    assert f"changed places {swinging['partitioning'].exchanges} times" in str(swinging)
    assert swinging["projection"].exchanges == 0


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_a_poor_choice_is_mended(monkeypatch, coordinates):
    """The slide of a slider-crank as the independent coordinate is none at the dead centres."""
    starts, original = [], initial_state.choose_independent

    def poor(model, start):
        original(model, start)
        c = start.assembly.compiled
        wanted = "D.displacement" if coordinates == "joint" else "slider.x"
        at = [n.name for n in velocity_names(c.structure)].index(wanted)
        size = np.abs(c.work.velocities.partition)
        c.work.velocities.partition[:] = size
        c.work.velocities.partition[at] = -size[at]
        starts.append(start)

    monkeypatch.setattr(initial_state, "choose_independent", poor)
    true = spinning_crank().simulate(1.0, rtol=1e-11, atol=1e-12, outputs=21)
    r = spinning_crank().simulate(
        1.0, rtol=1e-11, atol=1e-12, outputs=21, stabilization="partitioning", coordinates=coordinates
    )
    assert r["A.angle"] == pytest.approx(true["A.angle"], abs=1e-7)
    assert np.ptp(true["A.angle"]) > 4 * np.pi
    assert starts[0].assembly.compiled.work.counts.exchanges >= 1
    assert len(initial_state.independent_names(starts[0])) == 1


@pytest.mark.parametrize("make", [four_bar, bricard, door])
def test_independent_coordinates_stay_as_they_are(make):
    """To the bit; the others fulfil g = 0 and G v = nu, redundant rows included."""
    m = make()
    start = comparing.find_initial_state(m.snapshot(), 0.0, None, None, "absolute")
    initial_state.choose_independent(m, start)
    c, nq = start.assembly.compiled, start.assembly.compiled.structure.nq
    W = c.work
    own = W.velocities.partition < 0.0
    assert own.sum() == 1
    random = np.random.default_rng(1)
    q = start.assembly.q + 1e-4 * random.standard_normal(nq)
    v = start.assembly.v + random.standard_normal(c.structure.nv)
    W.options.stabilization, W.options.position_tolerance, W.options.velocity_tolerance = (
        stabilization.PARTITIONING,
        1e-13,
        1e-12,
    )
    status, _ = c.at(0.0, q, v, MOTION)
    assert status == 0
    settled = W.trial.state.copy()
    W.options.stabilization = stabilization.NONE
    c.at(0.0, settled[:nq].copy(), settled[nq : nq + len(v)].copy())
    assert np.abs(W.rows.value).max() < ROUNDING
    rows, moved = c.jacobian(), settled[nq : nq + len(v)]
    assert np.abs(rows @ moved - W.rows.nu).max() < 1e-11
    assert (moved[own] == v[own]).all()
    by_hand = np.linalg.lstsq(rows[:, ~own], W.rows.nu - rows[:, own] @ v[own], rcond=1e-9)[0]
    assert moved[~own] == pytest.approx(by_hand, abs=1e-9)
    if m.planar:
        assert (settled[:nq][own] == q[own]).all()  # coordinates and velocities are the same in the plane


# ----------------------------------------------------------------------------------------------------------- solvers


@pytest.mark.parametrize("make", [four_bar, bricard, door, lambda: example("spatial_four_bar.toml")])
def test_both_matrices_give_the_same_accelerations(make):
    m = make()
    a = assemble(m)
    found = []
    for coupled, solver in ((False, SCHUR), (True, COUPLED)):
        c = compile_mechanism(m, coupled=coupled)
        assert c.structure.tables["sizes"].solver == solver
        c.z = a.compiled.z.copy()
        assert c.at(0.0, a.q, a.v, MOTION)[0] == 0
        found.append((c.work.velocities.solved.copy(), c.jacobian().T @ c.work.rows.multiplier))
    for x, y in zip(*found, strict=True):
        assert x == pytest.approx(y, abs=1e-9 * max(np.abs(y).max(), 1.0))


def test_all_that_stay_closed_give_the_same_motion():
    c = bricard().compare(2.0, rtol=1e-10, atol=1e-12, outputs=11, repeats=1)
    for name in ("projection-steps", "projection", "partitioning", "coupled matrix", "joint coordinates"):
        assert c[name].difference < 1e-7, name
    one, other = c["projection"].result, c["coupled matrix"].result
    assert one["R1.angle"] == pytest.approx(other["R1.angle"], abs=1e-9)
    assert all(f.success and f.cpu > 0.0 and f.steps > 0 and f.factorisations > 0 for f in c)


def test_a_difference_is_the_largest_on_the_way():
    m = bricard()
    f = m.compare(2.0, rtol=1e-6, outputs=41, formulations=["projection"], repeats=0)["projection"]
    exact = m.simulate(2.0, rtol=1e-12, outputs=41)
    way = np.max([np.linalg.norm(f.result[b.name].position - exact[b.name].position, axis=1) for b in m.bodies], axis=0)
    assert 0.99 * way.max() < f.difference < 20 * way.max()


# ---------------------------------------------------------------------------------------------- failures and the table


def test_what_fails_is_a_row():
    """A rocker asked to go beyond its links: every formulation stops there, and says who asked."""
    m = four_bar()
    m.add(fb.Driver("pusher", "D.angle", "2*t"))
    c = m.compare(5.0, outputs=51, repeats=1)
    for f in c:
        assert not f.success
        assert f.t[-1] < 1.0 or f.name == "none"  # which drifts apart beyond it
        assert np.isnan(f.cpu)
        assert np.isnan(f.difference)
    assert "pusher" in c["projection"].message
    assert c.reference.startswith("none: ")
    assert "projection failed" in str(c)


def test_what_does_not_exist_for_a_mechanism_is_a_row():
    disk = example("rolling_disk.toml").compare(0.2, repeats=0, formulations=["joint coordinates", "projection"])
    assert "no joint can be a tree joint" in disk["joint coordinates"].message
    assert disk["projection"].success
    point = example("point_mass_pendulum.toml").compare(0.2, repeats=0, formulations=["coupled matrix"])
    assert "no inertia" in point["coupled matrix"].message
    m = fb.Mechanism("stone", gravity=(0, 0, -G))
    m.add(fb.Body("stone", mass=1.0, inertia=(1, 1, 1)))
    stone = m.compare(0.5, repeats=0)
    assert "no constraint rows" in stone["coupled matrix"].message
    assert stone["partitioning"].position_drift == stone["none"].position_drift == 0.0
    assert stone["partitioning"].difference < 1e-9


def test_the_table_names_everything(top, tmp_path):
    text = str(top)
    for name in comparing.EXPLICIT_FORMULATIONS:
        assert name in text
    assert top.names == tuple(comparing.EXPLICIT_FORMULATIONS)
    assert "largest kinetic energy is" in text
    plain = json.loads(json.dumps(top.as_dict()["formulations"]["partitioning"]))
    assert plain["position_drift"] < ROUNDING
    assert len(top) == len(list(top)) == 9
    with pytest.raises(fb.ModelError, match="nothing"):
        top["nothing"]
    top.plot(tmp_path / "compared.png")
    assert (tmp_path / "compared.png").stat().st_size > 20_000


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({"formulations": ["baumgart"]}, "did you mean 'baumgarte'"),
        ({"repeats": -1}, "repeats must be"),
        ({"repeats": 1.5}, "repeats must be a whole number"),
        ({"alpha": -1.0}, "alpha must be greater than 0"),
    ],
)
def test_wrong_input(more, told):
    with pytest.raises(fb.ModelError, match=told):
        four_bar().compare(1.0, **more)


def test_command(tmp_path):
    path = tmp_path / "bars.svg"
    arguments = ["compare", str(EXAMPLES / "spatial_four_bar.toml"), "--t-end", "100 ms", "--repeats", "1"]
    out = CliRunner().invoke(app, [*arguments, "--plot", str(path)])
    assert out.exit_code == 0, out.output
    assert "coupled matrix" in out.output
    assert path.exists()
    chosen = ["--only", "baumgarte", "--only", "none", "--alpha", "50", "--beta", "50", "--json"]
    out = CliRunner().invoke(app, [*arguments, *chosen])
    data = json.loads(out.output)
    assert list(data["formulations"]) == ["baumgarte", "none"]
    assert data["options"]["alpha"] == 50
    out = CliRunner().invoke(app, [*arguments, "--only", "euler"])
    assert out.exit_code == 2
    assert "there is no formulation 'euler'" in out.output


def test_a_law_that_sticks_at_its_corner_has_no_reference_and_says_so():
    """Dry friction that a user writes: from rest to rest it slips, then sticks, which only events know."""
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -G))
    m.add(planar_rod("rod", (0, 0), (1, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.Actuator("dry", "A.angle", force="-3*sign(rate)"))
    found = m.compare(3.0, outputs=3, repeats=0, max_steps=300, formulations=["projection"])
    assert "compare does not support corners of laws (Actuator 'dry')" in found.reference
    assert not found["projection"].success
