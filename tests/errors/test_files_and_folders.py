"""Files that cannot be written where they are to go, and files of another kind: the message says what to do."""

from __future__ import annotations

import math
import resource

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


def writers(m):
    """Ending -> what writes a file with it, of all that can be written."""
    run, study = m.simulate(0.1, outputs=101), m.study({"J": [0.1, 0.2]}, ["end(a.y)"], t_end=0.1)
    return [
        (".nc", run.save),
        (".csv", run.to_csv),
        (".html", run.to_html),
        (".html", run.to_report),
        (".png", lambda path: run.plot("a.y", path=path)),
        (".svg", lambda path: run.plot("a.y", path=path)),
        (".pdf", lambda path: run.plot_path("a", path=path)),
        (".nc", study.save),
        (".csv", study.to_csv),
        (".png", lambda path: study.plot(path=path)),
        (".toml", m.save),
        (".html", m.symbolic().to_html),
        (".tex", m.symbolic().to_latex),
        (".html", m.equilibrium(stable=True).to_html),
        (".html", m.modes(about=m.equilibrium(stable=True)).to_html),
    ]


def test_a_full_disk_is_said_and_leaves_what_was_there(tmp_path):
    """No room for more than 64 bytes in a file: HDF5 ended the process by a segmentation fault, pages were left half."""
    for ending, write in writers(pendulum()):
        path = tmp_path / f"x{ending}"
        write(path)  # all modules are imported by then: Python would leave half of their compiled files
        path.write_text("what was there before")
        limits = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (64, limits[1]))
        try:
            with pytest.raises(fb.ModelError, match=f"cannot write '.*x{ending}': File too large"):
                write(path)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        assert path.read_text() == "what was there before"
        assert list(tmp_path.iterdir()) == [path]
        path.unlink()


def test_an_ending_that_is_not_known_is_refused(tmp_path):
    """With those that are, and the method that writes such files, if there is one."""
    for ending, write in writers(pendulum()):
        for wrong in (".xyz", ".csv" if ending == ".toml" else ".toml", ""):
            with pytest.raises(fb.ModelError, match=rf"cannot write '.*x{wrong}'.*; it must be .*\{ending}"):
                write(tmp_path / f"x{wrong}")
    with pytest.raises(fb.ModelError, match=r"'\.csv' is not known here; .*; to_csv writes \.csv"):
        pendulum().simulate(0.1, outputs=3).to_html(tmp_path / "x.csv")
    with pytest.raises(fb.ModelError, match=r"the path of a file is a text or a path, not 3"):
        pendulum().simulate(0.1, outputs=3).save(3)
    assert list(tmp_path.iterdir()) == []


def test_save_goes_by_the_ending(tmp_path):
    m = pendulum()
    run, study = m.simulate(0.1, outputs=3), m.study({"J": [0.1, 0.2]}, ["end(a.y)"], t_end=0.1)
    run.save(tmp_path / "x.csv")
    assert (tmp_path / "x.csv").read_text().startswith("time [s],a.x [m],")
    run.save(tmp_path / "x.html")
    assert "<html" in (tmp_path / "x.html").read_text()[:200].lower()
    study.save(tmp_path / "s.csv")
    assert (tmp_path / "s.csv").read_text().startswith("run,J,end(a.y)")


def test_a_result_of_one_time_is_like_any_other(tmp_path):
    """Kinematics at the start only: nothing has moved, and no balance of energies was measured."""
    m = fb.Mechanism("p", planar=True)
    m.add(fb.Body("a", mass=1, inertia=1, com=(0.5, 0)), fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.Driver("d", "A.angle", "2*t"))
    run = m.kinematics([0.0])
    assert run.health.success
    assert run.energy.kinetic == pytest.approx([0.5 * (1 + 0.25) * 4])
    assert math.isnan(run.energy.drift)
    run.save(tmp_path / "x.nc")
    assert fb.load_result(tmp_path / "x.nc").health == run.health
    for ending, write in ((".csv", run.to_csv), (".html", run.to_report), (".png", lambda p: run.plot(path=p))):
        write(tmp_path / f"x{ending}")
    m.inverse_dynamics([0.0]).to_csv(tmp_path / "i.csv")


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
