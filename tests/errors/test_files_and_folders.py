"""Files that cannot be written where they are to go, and files of another kind: the message says what to do."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

import flyball as fb
from flyball.cli import app


def pendulum() -> fb.Mechanism:
    m = fb.Mechanism("p", planar=True, gravity=(0, -9.81), parameters={"J": 1 / 12, "k": 0.0, "idle": 1.0})
    m.add(fb.Body("a", mass=1, inertia="J", position=(0.5, 0)), fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.TorsionalSpringDamper("s", "A", stiffness="k"))
    return m


def test_a_folder_that_is_not_there_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    m = pendulum()
    run, study = m.simulate(0.1, outputs=3), m.study({"J": [0.1, 0.2]}, ["end(a.y)"], t_end=0.1)
    asked = [
        lambda: run.save("no/x.nc"),
        lambda: run.to_csv("no/x.csv"),
        lambda: run.to_html("no/x.html"),
        lambda: run.plot("a.y", path="no/x.png"),
        lambda: study.save("no/x.nc"),
        lambda: study.to_csv("no/x.csv"),
        lambda: m.save("no/x.toml"),
    ]
    for write in asked:
        with pytest.raises(fb.ModelError, match=r"cannot write 'no/x\.\w+': there is no folder 'no'; make it first"):
            write()


def test_results_and_studies_are_told_apart(tmp_path):
    m = pendulum()
    m.simulate(0.1, outputs=3).save(tmp_path / "r.nc")
    m.study({"J": [0.1, 0.2]}, ["end(a.y)"], t_end=0.1).save(tmp_path / "s.nc")
    with pytest.raises(fb.ModelError, match=r"is a study, no result: read it with flyball\.load_study"):
        fb.load_result(tmp_path / "s.nc")
    with pytest.raises(fb.ModelError, match=r"is a result, no study: read it with flyball\.load_result"):
        fb.load_study(tmp_path / "r.nc")


def test_a_parameter_set_twice_on_the_command_line_is_refused(tmp_path):
    pendulum().save(tmp_path / "m.toml")
    said = CliRunner().invoke(app, ["mobility", str(tmp_path / "m.toml"), "--set", "J=0.1", "--set", "J=0.2"])
    assert said.exit_code == 2
    assert "--set 'J=0.2': 'J' is given twice" in said.stderr


def test_series_over_what_nothing_depends_on_are_refused():
    m = pendulum()
    for ask in (lambda: m.equilibria("idle", [1, 2]), lambda: m.root_locus("idle", [1, 2])):
        with pytest.raises(fb.ModelError, match="nothing of 'p' depends on 'idle'"):
            ask()
    with pytest.raises(
        fb.ModelError, match=r"stabilization='none' does nothing with method='variational'.*leave it out$"
    ):
        m.simulate(1, method="variational", step=0.01, stabilization="none")
