"""Random mechanisms reach the end in good health, or are refused by name; the bench `fuzz.py` runs many more."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import flyball as fb
from flyball.forces import ALL as FORCE_CLASSES
from tests.robust.families import FAMILIES, Case, made
from tests.robust.forces import FORCES
from tests.robust.joints import COUPLINGS, PLANAR, SPATIAL
from tests.robust.verdict import STEPS, judge

# The random starts of these tests are no consistent ones, and being told so is not what they ask about.
pytestmark = pytest.mark.filterwarnings("ignore::flyball.errors.StartWarning")

ONCE = [
    *(("sticking", seed) for seed in (14, 103, 134, 198, 369, 451, 528, 532, 1057, 2022, 2098, 2426)),
    *(("happenings", seed) for seed in (49, 62, 183, 230, 236, 259, 296, 412, 549, 607, 712)),
    *(("sticking", seed) for seed in (2086, 2424)),  # structures: accelerations that are only rounding
    *(("shaken", seed) for seed in (84, 734, 10082)),
    ("stops", 114),
    ("latches", 2493),
    ("crowds", 300008),  # singular values for which LAPACK's gesdd does not converge
]
EACH = 17  # mechanisms of each family: two hundred in all
MOST = 6000  # steps of stiff ones here: one that rings on for more is looked at as far as it came, by the bench whole


@pytest.mark.filterwarnings("ignore::flyball.PerformanceNotice")
@pytest.mark.parametrize("family", FAMILIES)
def test_healthy_or_refused_by_name(family):
    """A failure names its seed: ``python benchmarks/fuzz.py --families FAMILY --first SEED --count 1`` shows it again."""
    kinds = []

    @settings(max_examples=EACH, derandomize=True, database=None, deadline=None, suppress_health_check=HealthCheck)
    @given(seed=st.integers(0, 10**6))
    def run(seed):
        case = made(family, seed)
        case.options["max_steps"] = min(case.options.get("max_steps", STEPS), MOST)
        verdict = judge(case)
        assert verdict.kind != "broken", f"{family} {seed}: {verdict.text}"
        kinds.append(verdict.kind)

    run()
    assert "healthy" in kinds, "a family of which nothing runs tests nothing"


@pytest.mark.parametrize(("family", "seed"), ONCE)
def test_what_was_refused_or_wrong_once(family, seed):
    """Refused for the sake of rounding, mostly: each has an answer."""
    verdict = judge(made(family, seed))
    assert verdict.kind == "healthy", verdict


def test_every_element_of_the_registry_takes_part():
    from flyball.model.element import Element
    from flyball.model.joint import Coupling, Joint

    rooms = ("flyball.joints.", "flyball.forces.")
    known = {k for k, c in Element.registry.items() if c.__module__.startswith(rooms)}
    joints = {k for k in known if issubclass(Element.registry[k], Joint)}
    assert joints == set(PLANAR) | set(SPATIAL)
    assert {k for k in known if issubclass(Element.registry[k], Coupling)} == set(COUPLINGS)
    # the inertia of a rotor has joint coordinates only, and these mechanisms are compared in both kinds
    assert {c.__name__ for c in FORCE_CLASSES} - {"RotorInertia", "Tyre", "WheelOnRail"} == set(FORCES)


def test_a_seed_says_everything():
    one, two = made("trees", 7), made("trees", 7)
    assert one.mechanism == two.mechanism
    assert made("trees", 8).mechanism.planar
    assert not one.mechanism.planar


def bad_case(**law) -> Case:
    m = fb.Mechanism("bad", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(1, 0)))
    return Case(m, 1.0)


def test_the_judge_sees_what_is_wrong(monkeypatch):
    """A result that is not finite, or off its constraints, or whose energy does not close, does not pass for healthy."""
    from tests.robust import verdict

    simulate = fb.Mechanism.simulate
    for spoil, said in {
        "v": "not finite",
        "q": "not finite",
        "violation": "violation",
        "energy": "energy off by",
    }.items():

        def spoilt(self, t_end, spoil=spoil, **options):
            self.add(fb.Actuator("A", "P.displacement", force="cos(t)"))
            r = simulate(self, t_end, outputs=11)
            if spoil == "violation":
                r.health.violation = 1e-3
            elif spoil == "energy":
                r.v[5:, 0] *= 2.0
                r.health.late["warnings"] = ()
            else:
                getattr(r, spoil)[3] = np.nan
            return r

        monkeypatch.setattr(fb.Mechanism, "simulate", spoilt)
        found = verdict.judge(bad_case())
        assert (found.kind, said in found.text) == ("broken", True), (spoil, found)

    def raises(self, t_end, **options):
        raise ZeroDivisionError("somewhere")

    monkeypatch.setattr(fb.Mechanism, "simulate", raises)
    assert verdict.judge(bad_case()).text.startswith("raised ZeroDivisionError")
