"""Which engine a motion goes through: what is wanted, refused, told, and when code pays for being made.

The maker of code is a stand-in that makes nothing, so that only what is decided is looked at.
"""

from __future__ import annotations

import ctypes
import math
from dataclasses import dataclass

import numpy as np
import pytest
from typer.testing import CliRunner

import flyball as fb
from flyball.cli import app
from flyball.codegen import Refused
from flyball.simulation import solver_switching
from flyball.simulation.solver_switching import CostAccount
from flyball.tables.table_definitions import FINISH
from tests.mechanisms import door, example, four_bar


class Code:
    """Code that does nothing: the engine's own loops go on."""

    def system(self, S):
        return S._replace(flat=np.zeros_like(S.flat))


@dataclass
class Maker:
    """What `codegen` offers; ``price`` [ns] of code that is not there yet."""

    price_of_making: float = 1e9
    where: str = ""
    refused: str = ""
    made: int = 0
    Refused = Refused

    def plan(self, x):
        return None

    def refusal(self, plan):
        return self.refused

    def ready(self):
        return self.where == "memory"

    def in_memory(self, plan, x):
        return Code() if self.where == "memory" else None

    def known(self, plan, x):
        return self.where

    def price(self, plan, known):
        return {"memory": 0.0, "disk": 1e5, "": self.price_of_making}[known]

    def code(self, plan, x):
        if self.refused:
            raise Refused(self.refused)
        self.made += 1
        self.where = "memory"
        return Code(), "made now"


@pytest.fixture
def maker(monkeypatch) -> Maker:
    found = Maker()
    monkeypatch.setattr(solver_switching, "codegen", found)
    monkeypatch.setattr(solver_switching, "SPENT", CostAccount())
    return found


@pytest.mark.parametrize("wish", [1, None, "yes", "True"])
def test_what_is_no_choice_is_refused(wish):
    for ask in (four_bar().simulate, driven().kinematics):
        with pytest.raises(fb.ModelError, match=r"^specialize is True, False or 'auto', not "):
            ask(**{"t_end": 0.1, "specialize": wish})


@pytest.mark.parametrize("wish", [True, False])
def test_steps_by_impulses_have_no_choice(wish):
    m = example("conveyor.toml")
    with pytest.raises(
        fb.ModelError, match=rf"^specialize={wish} does nothing with impulse time stepping; leave it out"
    ):
        m.simulate(0.1, specialize=wish, method="impulse")
    with pytest.raises(fb.ModelError, match="impulse time stepping does not support specialize="):
        m.simulate(0.1, specialize=wish)


def test_partitioning_has_no_made_code(maker):
    m = four_bar()
    with pytest.raises(fb.ModelError, match=r"^specialize=True: coordinate partitioning changes .*; leave it out$"):
        m.simulate(0.1, coordinates="absolute", stabilization="partitioning", specialize=True)
    r = m.simulate(0.1, coordinates="absolute", stabilization="partitioning")
    assert r.health.engine.startswith("general engine: coordinate partitioning")


def test_not_wanted_is_not_looked_for(monkeypatch):
    monkeypatch.setattr(solver_switching, "codegen", None)
    assert four_bar().simulate(0.1, specialize=False).health.engine == "general engine: as requested"


def test_wanted_is_made_before_the_motion_begins(maker):
    r = four_bar().simulate(0.01, outputs=2, specialize=True)
    assert maker.made == 1
    assert r.health.engine == "made for this mechanism: made now"
    assert ("engine", r.health.engine) in r.health.lines()
    assert r.health.as_dict()["engine"] == r.health.engine


def test_what_cannot_be_made_is_refused_with_the_reason(maker):
    maker.refused = "it has 999 rows, and code is made for 120"
    with pytest.raises(fb.ModelError, match=r"^specialize=True: it has 999 rows, and .*; leave it out$"):
        four_bar().simulate(0.1, specialize=True)
    assert four_bar().simulate(10.0).health.engine == f"general engine: {maker.refused}"


def test_short_motions_are_left_alone(maker):
    r = four_bar().simulate(0.5)
    assert maker.made == 0
    assert r.health.engine == "general engine: the motion is too short for code made for it"


def test_a_long_motion_goes_on_with_code_that_pays(maker):
    """What is left after 8 steps is more than making costs; whatever the clock says."""
    maker.price_of_making = 1e6
    first, again = (four_bar().simulate(20.0, outputs=3) for _ in range(2))
    assert maker.made == 1
    for r, how in ((first, "made now"), (again, "kept in this process")):
        assert r.health.engine == f"made for this mechanism: {how}"
        assert np.array_equal(r.t, [0, 10, 20])
    assert np.array_equal(first.q, again.q)
    assert first.health.steps == again.health.steps


def test_what_changes_to_made_code_is_what_began_so(maker):
    """To the last bit: with code from the beginning, and with the loops that stand in for it here."""
    maker.price_of_making = 1e6
    a, b, c = (four_bar().simulate(5.0, specialize=x) for x in ("auto", True, False))
    assert maker.made == 2
    for r in (b, c):
        assert np.array_equal(a.q, r.q)
        assert np.array_equal(a.multipliers, r.multipliers)
        assert (a.health.steps, a.health.evaluations) == (r.health.steps, r.health.evaluations)


def test_code_on_disk_is_taken_where_there_is_something_to_gain(maker):
    """Motions that are too short to make code for."""
    assert not four_bar().simulate(3.0).health.engine.startswith("made")
    maker.where = "disk"
    assert not four_bar().simulate(0.03).health.engine.startswith("made")
    assert four_bar().simulate(3.0).health.engine.startswith("made")


def test_code_that_the_process_has_is_taken_from_the_beginning(maker):
    """However short the motion: the code is taken."""
    maker.where = "memory"
    for r in (four_bar().simulate(0.01), driven().kinematics(3, t_end=0.01)):
        assert r.health.engine.startswith("made")


def test_a_short_motion_has_the_digits_of_the_code_that_there_is():
    """Left to choose, once a motion has had it made: to the last bit, and whatever values parameters have."""
    m = example("slider_crank.toml")
    for crank in (0.2, 0.21):
        made = m.simulate(0.05, outputs=3, specialize=True, parameters={"crank": crank})
        again = m.simulate(0.05, outputs=3, parameters={"crank": crank})
        assert again.health.engine == "made for this mechanism: kept in this process"
        assert np.array_equal(again.q, made.q)


def test_many_short_motions_pay_for_code_together(maker):
    """Of one kind, with other numbers or without; a part of what they took."""
    maker.price_of_making = 4e7
    m, runs = four_bar(), 0
    while not maker.made and runs < 200:
        m = m if runs % 2 else four_bar(gravity=(0, -9.81 - 0.01 * runs))
        m.simulate(10.0, outputs=2)
        runs += 1
    assert 5 <= runs < 200
    again = four_bar().simulate(0.5, specialize=False)
    assert again.health.engine == "general engine: as requested"


@pytest.mark.filterwarnings("ignore::flyball.PerformanceNotice")
def test_a_function_that_remembers_its_calls_is_called_as_often(maker):
    """The motion goes on with the code that is made on the way: nothing is computed twice."""
    maker.price_of_making = 1e6
    calls = []

    def torque(t):
        calls.append(t)
        return math.sin(t)

    for specialize in (False, "auto"):
        m = four_bar()
        m.add(fb.Actuator("motor", coordinate="A.angle", force=torque))
        r = m.simulate(5.0, outputs=2, specialize=specialize)
        calls.append(None)
    assert r.health.engine == "made for this mechanism: made now"
    first = calls.index(None)
    assert calls[:first] == calls[first + 1 : -1]


def test_cams_are_taken_as_others_are(maker):
    maker.where = "memory"
    assert example("cam.py").simulate(30.0, outputs=2).health.engine.startswith("made")


def test_an_interrupt_while_code_is_made_keeps_what_was_computed(maker, monkeypatch):
    def interrupted(plan, x):
        raise KeyboardInterrupt

    maker.price_of_making = 1e6
    monkeypatch.setattr(maker, "code", interrupted)
    with pytest.raises(fb.Interrupted) as ended:
        four_bar().simulate(20.0, outputs=20001)
    r = ended.value.result
    assert not r.health.success
    assert "interrupted by the user" in r.health.message
    assert 0.0 < r.t[-1] < 20.0


@ctypes.CFUNCTYPE(ctypes.c_double, *[ctypes.c_void_p] * 2, ctypes.c_double, *[ctypes.c_void_p] * 4)
def stuck(S, W, t, a, b, c, d):
    """What finishes a derivative, and always finds it not finite."""
    return 1.0


class Stuck(Code):
    """Code that cannot go on."""

    def system(self, S):
        flat = np.zeros_like(S.flat)
        flat[FINISH] = ctypes.cast(stuck, ctypes.c_void_p).value
        return S._replace(flat=flat)


def test_where_made_code_gets_stuck_the_loops_go_on(maker, monkeypatch):
    monkeypatch.setattr(maker, "code", lambda plan, x: (Stuck(), "made now"))
    r, s = (four_bar().simulate(0.5, specialize=x) for x in (True, False))
    assert r.health.engine.startswith("made for this mechanism: made now; general engine from t = 0 s")
    np.testing.assert_allclose(r.q, s.q, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(r.vdot, s.vdot, rtol=1e-9, atol=1e-9)
    kinematics = [driven().kinematics(21, t_end=1.0, specialize=x) for x in (True, False)]
    np.testing.assert_allclose(*(k["A"].force for k in kinematics), atol=1e-9)
    np.testing.assert_allclose(*(k["motor"].work for k in kinematics), atol=1e-12)


def test_what_made_code_and_loops_both_cannot_do_is_told_as_ever(maker, monkeypatch):
    """Reasons are told from what the engine's loops leave."""
    monkeypatch.setattr(maker, "code", lambda plan, x: (Stuck(), "made now"))
    said = []
    for wish in (True, False):
        m = four_bar()
        m.add(fb.Actuator("bad", coordinate="A.angle", force="1/(0.2 - t)**0.5"))
        with pytest.raises(fb.SimulationError) as caught:
            m.simulate(1.0, specialize=wish)
        said.append(str(caught.value))
        assert caught.value.t == pytest.approx(0.2, abs=1e-6)
    assert said[0] == said[1]


def driven() -> fb.Mechanism:
    m = four_bar()
    m.add(fb.Driver("motor", "A.angle", "6*t"))
    return m


def test_kinematics_has_the_choice_too(maker):
    r = driven().kinematics(11, t_end=0.5, specialize=True)
    assert r.health.engine == "made for this mechanism: made now"
    assert driven().simulate(0.5, specialize=True).health.engine == r.health.engine


def test_the_command_has_both_flags(maker, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    door().save("m.toml")
    for flags, engine in (
        ([], "general"),
        (["--specialize"], "made"),
        (["--no-specialize"], "general engine: as requested"),
    ):
        words = ["run", "m.toml", "--t-end", "0.1", "--no-plots", "--no-animation", "--quiet", *flags]
        said = CliRunner().invoke(app, words)
        assert said.exit_code == 0, said.output
        assert fb.load_result("m-result/result.nc").health.engine.startswith(engine)
