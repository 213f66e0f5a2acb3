"""Which engine a motion goes through: what is wanted, refused, told, and when code pays for being made.

The maker of code is a stand-in that makes nothing, so that only what is decided is looked at.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

import flyball as fb
from flyball.analysis.motion import engines
from flyball.cli import app
from flyball.tables.cost import cost
from tests.mechanisms import door, example, four_bar


class Code:
    """Code that does nothing: the engine's own loops go on."""

    def system(self, S):
        return S._replace(flat=np.zeros_like(S.flat))


@dataclass
class Maker:
    """What `special` offers; ``price`` [ns] of code that is not there yet."""

    price_of_making: float = 1e9
    where: str = ""
    refused: str = ""
    made: int = 0

    def plan(self, c):
        return SimpleNamespace(key=c.structure.model.name, refused=self.refused)

    def known(self, plan):
        return self.where

    def price(self, plan, known):
        return {"memory": 0.0, "disk": 1e5, "": self.price_of_making}[known]

    def code(self, plan, c):
        self.made += 1
        self.where = "memory"
        return Code(), "made now"


@pytest.fixture
def maker(monkeypatch) -> Maker:
    found = Maker()
    monkeypatch.setattr(engines, "special", found)
    monkeypatch.setattr(engines, "SPENT", engines.Account())
    return found


@pytest.mark.parametrize("wish", [1, None, "yes", "True"])
def test_what_is_no_choice_is_refused(wish):
    for ask in (four_bar().simulate, driven().kinematics):
        with pytest.raises(fb.ModelError, match=r"^specialize is True, False or 'auto', not "):
            ask(**{"t_end": 0.1, "specialize": wish})


@pytest.mark.parametrize("wish", [True, False])
def test_steps_by_impulses_have_no_choice(wish):
    m = example("conveyor.toml")
    with pytest.raises(fb.ModelError, match=rf"^specialize={wish} does nothing with steps by impulses; leave it out"):
        m.simulate(0.1, specialize=wish)


def test_partitioning_has_no_made_code(maker):
    m = four_bar()
    with pytest.raises(fb.ModelError, match=r"^specialize=True: partitioning chooses .*; leave it out$"):
        m.simulate(0.1, coordinates="absolute", stabilization="partitioning", specialize=True)
    r = m.simulate(0.1, coordinates="absolute", stabilization="partitioning")
    assert r.health.engine.startswith("table-driven: partitioning")


def test_not_wanted_is_not_looked_for(monkeypatch):
    monkeypatch.setattr(engines, "special", None)
    assert four_bar().simulate(0.1, specialize=False).health.engine == "table-driven: asked for"


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
    assert four_bar().simulate(0.1).health.engine == f"table-driven: {maker.refused}"


def test_short_motions_are_left_alone(maker):
    r = four_bar().simulate(0.5)
    assert maker.made == 0
    assert r.health.engine == "table-driven: too little is computed to make code for it"


def test_long_motions_change_over_at_a_count_of_steps(maker):
    """What is left after 50 steps is more than making costs: the same twice, whatever the clock says."""
    maker.price_of_making = 1e6
    said = [four_bar().simulate(20.0, outputs=3).health for _ in range(2)]
    assert maker.made == 2
    assert said[0].engine == "made for this mechanism, from step 51 on: made now"
    assert [said[1].engine, said[1].steps] == [said[0].engine, said[0].steps]


def test_a_motion_is_the_same_where_it_changes_over(maker):
    """The state is all in the clock: to the bit, as the stand-in does nothing."""
    maker.price_of_making = 1e6
    a, b = (four_bar().simulate(5.0, specialize=x) for x in ("auto", False))
    assert a.health.engine.startswith("made")
    assert np.array_equal(a.q, b.q)
    assert np.array_equal(a.reactions, b.reactions) if hasattr(a, "reactions") else True


def test_code_on_disk_is_taken_sooner(maker):
    """A motion that is too short to make code for is long enough to load it."""
    maker.where = "disk"
    assert four_bar().simulate(2.0).health.engine.startswith("made for this mechanism, from step 51 on")


def test_many_short_motions_pay_for_code_together(maker):
    m = four_bar()
    first = m.simulate(0.5, outputs=2)
    each = first.health.evaluations * cost(first.values.structure)
    maker.price_of_making = 10 * each
    runs = 0
    while not maker.made and runs < 100:
        m.parameters  # noqa: B018
        m.simulate(0.5, outputs=2)
        runs += 1
    assert 5 <= runs <= 60


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
    for flags, engine in ((["--specialize"], "made"), (["--no-specialize"], "table-driven: asked for"), ([], "table")):
        words = ["run", "m.toml", "--t-end", "0.1", "--no-plots", "--no-animation", "--quiet", *flags]
        said = CliRunner().invoke(app, words)
        assert said.exit_code == 0, said.output
        assert fb.load_result("m-result/result.nc").health.engine.startswith(engine)
