"""Code made for a mechanism computes the operations of the table-driven engine in their order: the same bits."""

import numpy as np
import pytest

import flyball as fb
from tests.layers import LAYERS
from tests.program.copied import Copy

EXAMPLES = sorted(path.name for path in Copy.examples().glob("*.toml"))


@pytest.mark.parametrize("coordinates", LAYERS)
@pytest.mark.parametrize("name", EXAMPLES)
def test_examples(name, coordinates):
    """Positions, velocities, accelerations, multipliers, at a loose tolerance so that projections have much to do."""
    m = fb.load(Copy.examples() / name)
    how = {"coordinates": coordinates, "method": "dop853", "rtol": 1e-5, "outputs": 11}
    try:
        made = m.simulate(0.2, specialize=True, **how)
    except fb.ModelError as error:
        large = "operations, and is made up to" in str(error)
        assert large or "does not support stops, stick friction or events" in str(error) or m.contacts
        pytest.skip("events, changing rows and large equations are for the tables")
    tables = m.simulate(0.2, specialize=False, **how)
    for name in ("t", "q", "v", "vdot", "multipliers"):
        assert np.array_equal(getattr(made, name), getattr(tables, name), equal_nan=True), name
    assert made.health.steps == tables.health.steps


@pytest.mark.parametrize("name", ["andrews.toml", "double_wishbone.toml", "toggle_press.toml"])
def test_code_that_is_taken_on_the_way(name, monkeypatch):
    """A motion that goes on with made code after 8 steps is the one that began with it."""
    m = fb.load(Copy.examples() / name)
    monkeypatch.setattr("flyball.codegen.price", lambda plan, where: 0.0)
    monkeypatch.setattr("flyball.codegen.known", lambda plan, x: "")
    monkeypatch.setattr("flyball.simulation.solver_switching.LOAD_COST", 0.0)
    left = m.simulate(0.5, outputs=11, method="dop853", rtol=1e-10)
    assert left.health.engine.startswith("made for this mechanism")
    made = m.simulate(0.5, outputs=11, method="dop853", rtol=1e-10, specialize=True)
    for name in ("q", "v", "vdot", "multipliers"):
        assert np.array_equal(getattr(left, name), getattr(made, name), equal_nan=True), name
