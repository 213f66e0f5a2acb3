"""A fixed sample of the fuzz in `benchmarks/fuzz.py`: its judges know nothing of the program's own judgement."""

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

from fuzzing import content, physics, poses, relations, scenes, touching, verdicts

import flyball as fb
from flyball.results.energy_balance import energy_moved

from . import verdict

pytestmark = pytest.mark.filterwarnings(
    "ignore::flyball.errors.StartWarning", "ignore::flyball.errors.PerformanceNotice"
)
MECHANISMS = [(family, seed) for family in content.NEW for seed in ((101,) if family == "eventful" else (100,))]
CONTACT = [(family, seed) for family in scenes.SCENES if family != "soft" for seed in (100,)]


@pytest.mark.parametrize(("family", "seed"), [*MECHANISMS, *CONTACT])
def test_nothing_is_wrong_in_silence(family, seed):
    """``python benchmarks/fuzz.py --families FAMILY --first SEED --count 1 --relations 13`` shows a failure again."""
    verdict = verdicts.judged(family, seed, 3)
    assert verdict.kind in ("agrees", "refused", "warned"), [str(f) for f in verdict.findings]


FOUND = [
    *(("lossless", 300038), ("redundant", 300071), ("singular", 300054)),  # stand still at a dead centre
    *(("loops", 300015), ("extremes", 300034), ("boxes", 300043), ("happenings", 300033)),
    *(("shaken", 300023), ("shaken", 300051), ("piled", 300009), ("piled", 300026), ("piled", 300075)),
]


@pytest.mark.parametrize(("family", "seed"), FOUND)
def test_what_was_found_is_right(family, seed):
    """Once wrong, or taken for it, as by rounding that stands for nothing."""
    verdict = verdicts.judged(family, seed, 3)
    assert verdict.kind in ("agrees", "refused", "warned"), [str(f) for f in verdict.findings]


WAYS = [  # and the other way in which it was; none: by a judge of one motion
    *(("happenings", 200034, "coordinates"), ("happenings", 500069, "axes"), ("couplings", 500030, "rk45")),
    *(("happenings", 700023, "coordinates"), ("sticking", 300046, "axes"), ("shaken", 500066, "radau"), ("shaken", 500092, "axes")),
    *(("sampled", 500011, "radau"), ("parallel_cranks", 500084, "coordinates"), ("parallel_cranks", 500084, "radau")),
    *(("windows", 500008, ""), ("windows", 500086, ""), ("stiff", 500049, ""), ("stiff", 500033, ""), ("sliding", 500023, "")),
    *(("couplings", 600066, ""), ("extremes", 600020, ""), ("trees", 600007, ""), ("tables", 600057, "swap")),
]  # fmt: skip


@pytest.mark.parametrize(("family", "seed", "way"), WAYS)
def test_what_was_found_is_right_by_the_way_that_found_it(family, seed, way):
    found = verdicts.judged(family, seed, 1, [way or "order"])
    assert found.kind == "agrees", [str(f) for f in found.findings]


def test_energy_that_is_off_at_any_tolerance_is_seen(monkeypatch):
    """What the tolerance makes of it falls with the tolerance: of a window at rtol = 1e-4, by singular positions."""
    case = content.made("windows", 500008)
    assert verdict.judge(case).kind == "healthy"
    monkeypatch.setattr(verdict, "energy_moved", lambda r: 1e-4 * energy_moved(r))  # as if it were off by that more
    assert "energy off" in verdict.judge(case).text


@pytest.mark.parametrize(("angle", "firm"), [(0.0, 1.0), (1e-3, 1e-3), (1e-9, 1e-9)])
def test_firmness_of_a_structure_that_is_all_but_free(angle, firm):
    """Two bars on one line, of which one point in the middle is off by an angle: that holds it, by the angle's sine."""
    m = fb.Mechanism("m", planar=True)
    m.add(fb.Body("a", mass=1, inertia=1), fb.Body("b", mass=1, inertia=1))
    m.add(
        fb.Revolute("A", "ground", "a", at=(-1, 0)),
        fb.Revolute("B", "a", "b", at=(0, angle)),
        fb.Revolute("C", "ground", "b", at=(1, 0)),
    )
    found = relations.firmness(m)
    assert found > 0.1 if firm == 1.0 else 0.1 * firm < found < firm


def _latching(*happened):
    """A run of which these happened, and the motion that it is compared with, of 1 s."""
    run = SimpleNamespace(events=[SimpleNamespace(name="S", kind=k, t=t) for k, t in happened], t=[0.0, 1.0])
    return run, SimpleNamespace(run=run, options={}, t_end=1.0)


def test_events_differ_by_how_they_leave_an_element():
    """Back and forth within a ten-thousandth of the time counts as how it ends; an unlatch that is missing is seen."""
    _, base = _latching(("latch", 0.5), ("unlatch", 0.8))
    for same in ([("latch", 0.5), ("unlatch", 0.5), ("impact", 0.50001), ("rest", 0.50002), ("unlatch", 0.8)],):
        assert relations._happened(base, _latching(*same)[0], 2) == ""
    for other in ([("latch", 0.5)], [("latch", 0.5), ("unlatch", 0.5)], [("latch", 0.5), ("unlatch", 0.7)]):
        assert "unlatch" in relations._happened(base, _latching(*other)[0], 2)


def _lossless(seed=101):
    case = content.made("lossless", seed)
    return case.mechanism, relations.base(case.mechanism, case.t_end, {}, 41)


@pytest.mark.parametrize(
    ("spoil", "relation"),
    [
        ("velocity", "energy"),
        ("position", "constraint"),
        ("acceleration", "force = mass x acceleration"),
        ("force", "force = mass x acceleration"),
    ],
)
def test_a_judge_sees_what_is_spoilt(spoil, relation, monkeypatch):
    """A thousandth more or less of one quantity of one body, or of one joint's force, does not pass."""
    m, base = _lossless()
    read = poses.Motion._read
    if spoil == "force":

        class View:
            def __init__(self, of):
                self.of = of

            def __getattr__(self, name):
                return np.asarray(getattr(self.of, name)) * (1.001 if name == "force" else 1.0)

        class Spoilt:
            def __getitem__(self, name):
                return View(base.run[name]) if name == m.joints[0].name else base.run[name]

            def __getattr__(self, name):
                return getattr(base.run, name)

        found = physics.findings(Spoilt(), m)
    else:
        first = m.bodies[0].name

        def spoilt(self, body, what):
            x = read(self, body, what)
            return x * 1.001 if (body, what) == (first, spoil) else x

        monkeypatch.setattr(poses.Motion, "_read", spoilt)
        found = physics.findings(base.run, m)
    assert any(relation in f.relation for f in found), [str(f) for f in found]


def test_a_relation_sees_another_motion():
    """Gravity that is a thousandth stronger in the second description is found."""
    m, base = _lossless()
    other = relations.changes.again(m, lambda e: e, gravity=tuple(1.001 * g - 0.01 for g in m.gravity))
    changed = replace(base, mechanism=other)
    outcomes = [x[1] for x in relations.compared(changed, ["order", "parameters"], 1)]
    assert outcomes == ["differs", "differs"]


def test_contact_judges_see_friction_outside_its_cone():
    case = scenes.made("rolling", 100)
    base = relations.base(case.mechanism, case.t_end, {}, 41)
    assert not touching.findings(base.run, case.mechanism, "rolling")
    x = poses.Motion(base.run, case.mechanism)
    contacts = base.run.contacts
    sideways = contacts.force - contacts.normal_force[:, None] * contacts.normal
    contacts.force[:] = contacts.force + 0.01 * sideways
    found = [*touching.cones(x), *touching.balances(x)]
    assert {"outside the cone", "force = mass x acceleration"} <= {f.relation for f in found}
