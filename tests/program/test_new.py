"""`flyball new` writes model files that load, check and move; some behave as their comments say."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from typer.testing import CliRunner

import flyball as fb
from flyball.cli import app
from flyball.cli.view import _FROM_EXAMPLES, model_files
from tests.pages import ROOT

NAMES = sorted(model_files())


def new(*arguments: str):
    return CliRunner().invoke(app, ["new", *arguments])


@pytest.fixture
def written(tmp_path, monkeypatch):
    """A function that writes a model file and loads it."""
    monkeypatch.chdir(tmp_path)

    def write(name: str) -> fb.Mechanism:
        answer = new(name)
        assert answer.exit_code == 0, answer.output
        return fb.load(tmp_path / f"{name}.toml")

    return write


def test_there_is_a_dozen():
    assert len(NAMES) >= 12
    listed = new("--list").output
    assert new().output == listed
    assert [line.split()[0] for line in listed.splitlines()] == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_it_loads_checks_and_moves(name, written, tmp_path):
    m = written(name)
    text = (tmp_path / f"{name}.toml").read_text(encoding="utf-8")
    assert text.startswith("# ")
    assert "examples/" not in text
    assert m.check().lines()
    run = m.simulate(0.1)
    assert run.health.success
    assert not run.health.doubtful


def test_a_file_is_not_replaced_and_a_name_is_known(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert new("cam", "mine.toml").exit_code == 0
    again = new("cam", "mine.toml")
    assert again.exit_code == 2
    assert "exists" in again.output
    wrong = new("for-bar")
    assert wrong.exit_code == 2
    assert "four-bar" in wrong.output
    assert "ending" in new("cam", "cam.txt").output


def test_the_wheel_has_what_is_taken_from_the_examples():
    built = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["hatch"]["build"]["targets"]
    expected = {f"examples/{v}.toml": f"flyball/models/{k}.toml" for k, v in _FROM_EXAMPLES.items()}
    assert built["wheel"]["force-include"] == expected


def test_the_pole_is_balanced(written):
    run = written("cart-pole").simulate(5)
    assert abs(run["pin.angle"][0]) == pytest.approx(np.radians(8))
    assert abs(run["pin.angle"][-1]) < 1e-3


def test_the_quarter_car_rests_until_the_bump(written):
    m = written("suspension")
    run = m.simulate(3, outputs=301)
    assert np.abs(run["body.y"] - 0.8)[run.t < 0.45].max() < 1e-9
    assert 0.04 < np.abs(run["body.y"] - 0.8).max() < 0.07  # the bump is 40 mm high
    # closed form of the two masses on springs in series, without damping
    k, kt, M, m_w = 20e3, 180e3, 300.0, 40.0
    want = np.sqrt(np.linalg.eigvals(np.array([[k / M, -k / M], [-k / m_w, (k + kt) / m_w]])).real)
    free = m.modes(parameters={"damper": 0})
    np.testing.assert_allclose(np.sort(free.omega), np.sort(want), rtol=1e-6)


def test_the_gears_reduce_by_nine(written):
    run = written("gear-train").simulate(2)
    np.testing.assert_allclose(run["third.angle"], run["first.angle"] / 9, atol=1e-9)
    assert run["first.angle_rate"][-1] == pytest.approx(2 * 9 / 0.9 * 9, rel=1e-3)


def test_the_arm_reaches_its_set_points(written):
    run = written("robot-arm").simulate(3)
    for name, degrees in (("waist", 90), ("shoulder", 45), ("elbow", 60)):
        assert run[f"{name}.angle"][-1] == pytest.approx(np.radians(degrees), abs=2e-3)


def test_the_gripper_lifts_the_box(written):
    run = written("gripper").simulate(2.5, outputs=51)
    assert run["box.z"][-1] - run["box.z"][0] == pytest.approx(0.25, abs=1e-3)
