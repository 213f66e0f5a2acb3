"""The command: what it prints, writes and exits with."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import webbrowser
from pathlib import Path

import pytest
from typer.testing import CliRunner

import flyball as fb
from flyball.cli import COMMANDS, app
from flyball.numerics.complementarity.solver_choice import solver_names
from tests.results.made_up import mechanism, slider_crank


class Said:
    """How a command ended and what it said."""

    def __init__(self, *words: object) -> None:
        ended = CliRunner().invoke(app, [str(w) for w in words])
        if ended.exception is not None and not isinstance(ended.exception, SystemExit):
            raise ended.exception
        self.code, self.out, self.err = ended.exit_code, ended.stdout, ended.stderr


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    mechanism().save("crank.toml")
    return tmp_path


def test_commands_are_listed_in_the_declared_order() -> None:
    listed = re.findall(r"^  (\S+) {2,}", Said("--help").out.partition("Commands:")[2], re.M)
    assert tuple(listed) == COMMANDS
    assert listed[:3] == ["run", "check", "view"]


def test_run_writes_everything_and_says_so(here: Path) -> None:
    said = Said("run", "crank.toml", "--t-end", "200 ms", "--outputs", 21, "--set", "speed=30 rpm", "--set", "k=50")
    assert said.code == 0, said.err
    for words in ("freedoms", "steps", "energy balance", "violation", "animation.html"):
        assert words in said.out
    folder = here / "crank-result"
    assert said.out.splitlines()[-1].split() == ["open", "this", str(Path("crank-result/report.html"))]
    files = ["animation.html", "report.html", "result.csv", "result.nc"]
    assert sorted(p.name for p in folder.iterdir()) == files
    r = fb.load_result(folder / "result.nc")
    assert len(r.t) == 21
    assert r.t[-1] == 0.2
    assert r.model.parameters == {"speed": "30 rpm", "k": 50.0}
    assert r["A"].angle[-1] == pytest.approx(0.2 * 3.14159265358979)


@pytest.mark.parametrize("flag", ["--plots", "--no-animation"])
def test_pictures_are_drawn_on_request_or_in_place_of_a_report(here: Path, flag: str) -> None:
    said = Said("run", "crank.toml", "--t-end", "0.1", "--outputs", 5, flag)
    assert said.code == 0, said.err
    pictures = ["actuation.png", "coordinates.png", "energy.png", "paths.png", "reactions.png"]
    assert sorted(p.name for p in (here / "crank-result" / "plots").iterdir()) == pictures
    assert all(str(Path("crank-result/plots") / name) in said.out for name in pictures)


def test_run_as_json_prints_one_object(here: Path) -> None:
    said = Said(
        "run", "crank.toml", "--t-end", 0.1, "--outputs", 3, "--json", "--no-plots", "--no-animation", "--out", "o"
    )
    assert said.code == 0
    data = json.loads(said.out)
    assert data["success"]
    assert data["health"]["freedoms"] == 0
    assert data["files"] == [str(Path("o/result.nc")), str(Path("o/result.csv"))]
    assert said.err == ""


@pytest.mark.parametrize(
    ("flags", "pages"),
    [
        ([], ["report.html", "animation.html"]),
        (["--no-report"], ["animation.html"]),
        (["--no-animation"], []),
        (["--no-animation", "--report"], ["report.html"]),
    ],
)
def test_the_pages_that_are_wanted_are_written(here: Path, flags: list[str], pages: list[str]) -> None:
    said = Said("run", "crank.toml", "--t-end", 0.1, "--outputs", 3, "--no-plots", "--json", "--out", "o", *flags)
    files = [Path(f).name for f in json.loads(said.out)["files"]]
    assert files == ["result.nc", "result.csv", *pages]
    assert all((here / "o" / name).stat().st_size > 10_000 for name in pages)


def test_quiet_says_nothing(here: Path) -> None:
    said = Said("run", "crank.toml", "--t-end", 0.1, "--quiet", "--no-plots", "--no-animation")
    assert (said.code, said.out, said.err) == (0, "", "")


def test_a_run_that_cannot_go_on_keeps_what_was_computed(here: Path) -> None:
    m = fb.Mechanism("stops", planar=True)
    m.add(fb.Body("rod", mass=1, inertia=1, position=(1, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.Motor("motor", "A", torque="sqrt(0.5 - t)"))
    m.save("stops.toml")
    said = Said("run", "stops.toml", "--t-end", 1, "--no-plots")
    assert said.code == 3
    assert re.search(r"^error: 'stops': .* not finite just after t = 0\.(49|50?)", said.err)
    r = fb.load_result("stops-result/result.nc")
    assert not r.health.success
    assert 0.4 < r.t[-1] < 0.51
    data = json.loads(Said("run", "stops.toml", "--t-end", 1, "--no-plots", "--no-animation", "--json").out)
    assert data["kind"] == "SimulationError"
    assert not data["success"]
    assert len(data["files"]) == 2


CONTACT = """
gravity = [0, 0, -9.81]
[[ground]]
name = "floor"
shape = { type = "Plane" }
[[bodies]]
name = "box"
density = 500
shape = { type = "Box", edges = [0.2, 0.2, 0.1] }
position = [0, 0, 0.06]
[[contacts]]
friction = 0.3
"""


@pytest.mark.parametrize("solver", solver_names())
def test_every_contact_solver_can_be_asked_for(here: Path, solver: str) -> None:
    (here / "box.toml").write_text(f'name = "box"{CONTACT}')
    convex = ["--no-coulomb"] if solver == "barzilai-borwein" else []
    words = ["--method", "impulse", "--step", "5 ms", "--solver", solver, *convex]
    words += ["--history", "0.05,0.1"] if solver != "lcp" else []  # it does not iterate
    said = Said("run", "box.toml", "--t-end", "0.1", "--no-animation", "--no-plots", "--json", *words)
    assert said.code == 0, said.err
    assert json.loads(said.out)["health"]["options"]["method"]["solver"] == solver
    assert solver == "lcp" or (here / "box-result" / "residuals.png").stat().st_size > 1000
    assert solver in "".join(Said("run", "--help").out.split())


LIST = "unknown solver 'lemke' of Stepping; choose one of auto, gauss-seidel, newton, jacobi, barzilai-borwein, apgd,"


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["--method", "impulse", "--solver", "lemke"], LIST),
        (["--solver", "apgd"], "--solver is an option of impulse time stepping: give --method impulse with it"),
        (["--method", "impulse", "--directions", "4"], "directions of Stepping is for solver='pyramid'"),
        (["--method", "impulse", "--history", "some"], "history of Stepping is 'some'"),
    ],
)
def test_wrong_options_of_contact_end_with_2(here: Path, words: list[str], part: str) -> None:
    (here / "box.toml").write_text(f'name = "box"{CONTACT}')
    said = Said("run", "box.toml", *words)
    assert said.code == 2
    assert part in " ".join(said.err.split())


def test_an_interrupted_run_is_written(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    r = slider_crank()
    r.health.success, r.health.message = False, "interrupted by the user at t = 1 s"

    def stopped(*_, **__):
        raise fb.Interrupted(r.health.message, r)

    monkeypatch.setattr(fb.Mechanism, "simulate", stopped)
    said = Said("run", "crank.toml", "--no-plots", "--no-animation")
    assert said.code == 130
    assert "interrupted by the user" in said.out
    assert fb.load_result("crank-result/result.nc").health.message.startswith("interrupted")


def test_an_assembly_that_fails_ends_with_3(here: Path) -> None:
    m = fb.Mechanism("gap", planar=True)
    m.add(fb.Body("rod", mass=1, inertia=1, position=(1, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.Distance("wire", "ground", "rod", at=((5, 0), (1, 0)), length=1))
    m.save("gap.toml")
    said = Said("run", "gap.toml")
    assert said.code == 3
    assert "cannot be assembled" in said.err
    assert "wire" in said.err
    assert json.loads(Said("check", "gap.toml", "--json").out)["kind"] == "AssemblyError"


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["run", "crnk.toml"], "there is no file 'crnk.toml' (did you mean 'crank.toml'?)"),
        (["run", "crank.toml", "--set", "sped=1"], "'slider/crank' has no parameter 'sped' (did you mean 'speed'?)"),
        (["run", "crank.toml", "--set", "speed"], "write name=value"),
        (["run", "crank.toml", "--set", "k=-1"], "stiffness is -1 N/m; it must be zero or greater"),
        (["run", "crank.toml", "--set", "k=1 furlog"], "unknown unit 'furlog'"),
        (
            ["run", "crank.toml", "--set", "speed=2 kg"],
            "parameter 'speed' of 'slider/crank' is '60 rpm'; '2 kg': expected",
        ),
        (["run", "crank.toml", "--set", "speed=2 Hz"], "--set 'speed=2 Hz'"),
        (["run", "crank.toml", "--t-end", "-1"], "the end time -1 s must be later"),
        (["run", "crank.toml", "--t-end", "1 m"], "--t-end: '1 m': expected a time"),
        (["run", "crank.toml", "--outputs", "1"], "at least 2"),
        (["run", "crank.toml", "--rtol", "0"], "rtol must be greater than 0"),
        (["run", "crank.toml", "--method", "euler"], "choose one of dop853"),
        (["run", "crank.toml", "--speed"], "No such option"),
        (["run", "crank.toml", "--outputs", "many"], "--outputs"),
        (["walk"], "No such command"),
        (["check", "."], "cannot read"),
        (["view", "crank.toml"], "cannot be read as a NetCDF result"),
        (["view", "nothing.html"], "there is no file 'nothing.html'"),
        (["check", "no.py"], "there is no file 'no.py'"),
    ],
)
def test_wrong_input_ends_with_2(here: Path, words: list[str], part: str) -> None:
    said = Said(*words)
    assert said.code == 2
    assert part in said.err
    assert "Traceback" not in said.err
    assert said.out == ""


def test_errors_as_json(here: Path) -> None:
    said = Said("check", "crnk.toml", "--json")
    assert said.code == 2
    assert said.err == ""
    assert json.loads(said.out)["kind"] == "ModelError"


def test_check(here: Path) -> None:
    said = Said("check", "crank.toml")
    assert said.code == 0
    assert "slider/crank (planar): 3 bodies, 4 joints, 3 forces, 1 driver" in said.out
    assert "drivers take every freedom" in said.out
    data = json.loads(Said("check", "crank.toml", "--json").out)
    assert data["freedoms"] == 0
    assert data["bodies"]["crank"]["mass"] == 1.0


def test_check_finds_what_is_odd(here: Path) -> None:
    m = fb.Mechanism("odd", planar=True, parameters={"spare": 1})
    m.add(fb.Body("heavy", mass=1, inertia=1e4, position=(1, 0)), fb.Body("lonely", mass=1, inertia=1))
    m.add(fb.Body("light", mass=1, inertia=1e-6, position=(1, 1)))
    m.add(fb.Revolute("A", "ground", "heavy", at=(0, 0)), fb.Revolute("B", "heavy", "light", at=(1, 2)))
    m.add(fb.Body("shaped", mass=1, inertia=1, shape=fb.Sphere(radius=1, position=(0.5, 0, 0))))
    report = m.check()
    text = str(report)
    assert report.freedoms == 8
    assert report.gruebler == 8
    assert not report.redundant
    assert "body 'heavy': its inertia is that of a body 100 m across" in text
    assert "body 'light': its inertia is that of a body 0.001 m across" in text
    assert "body 'lonely' has neither a joint nor a force" in text
    assert report.bodies["shaped"].com == (0.0, 0.0)  # shapes that do not give the inertia are only for looks
    assert "no gravity" in text
    assert "parameter 'spare' is used nowhere" in text


def test_check_names_redundant_joints() -> None:
    m = fb.Mechanism("bricks", planar=True, gravity=(0, -9.81))
    for k in range(2):
        m.add(fb.Body(f"post{k}", mass=1, inertia=1, position=(k, 0.5)))
        m.add(fb.Translational(f"T{k}", "ground", f"post{k}", at=(k, 0), axis=(0, 1)))
    m.add(fb.Fixed("weld", "post0", "post1", at=(0.5, 0.5)))
    report = m.check()
    assert (report.freedoms, report.gruebler, report.redundancy) == (1, -1, 2)
    assert set(report.redundant) == {"T0", "T1", "weld"}
    assert "2 constraints too many, among T0, T1, weld" in str(report)
    assert report.undetermined


def test_view_writes_the_page_and_opens_it(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    slider_crank().save("r.nc")
    said = Said("view", "r.nc", "--no-open")
    assert said.code == 0
    assert said.out == "r.html\n"
    assert not opened
    assert "slider/crank" in Path("r.html").read_text(encoding="utf-8")
    assert json.loads(Said("view", "r.html", "--json").out) == {"page": "r.html"}
    assert opened == [(here / "r.html").resolve().as_uri()]


def test_results_in_other_formats_and_spectra(here: Path) -> None:
    said = Said("run", "crank.toml", "--t-end", 0.5, "--no-animation", "--spectrum", "C.angle", "--save", "a.svg")
    assert said.code == 0, said.err
    assert "spectrum of C.angle: mean" in said.out
    assert Path("crank-result/spectrum.png").is_file()
    assert Said("convert", "crank-result/result.nc", "a.mat", "a.png").out == "a.mat\na.png\n"
    assert all(Path(name).is_file() for name in ("a.svg", "a.mat", "a.png"))
    said = Said("convert", "crank-result/result.nc", "a.xlsx")
    assert said.code == 2
    assert "'.xlsx' is not known here" in said.err


def test_view_compares_results_and_measured_curves(here: Path) -> None:
    Path("other").mkdir()
    r = slider_crank()
    for name in ("a.nc", "b.nc", "other/a.nc"):
        r.save(name)
    Path("test.csv").write_text("t,slider.x\n0,0.1\n0.1,0.1\n")
    said = Said("view", "a.nc", "b.nc", "other/a.nc", "--measured", "test.csv", "--no-open")
    assert (said.code, said.out) == (0, "a-compared.html\n")
    assert Path("a-compared.html").stat().st_size > 10_000
    for words, message in (
        (["a.nc", "a.nc"], "'a.nc' is given twice"),
        (["a.nc", "a-compared.html"], "'a-compared.html' is a page; a comparison needs results (.nc)"),
        (["a.nc", "--measured", "none.csv"], "cannot read 'none.csv'"),
    ):
        said = Said("view", *words, "--no-open")
        assert said.code == 2
        assert message in said.err


BODY = "fb.Body('b', mass=1, inertia=1)"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f"import flyball as fb\nprint('hello')\nm = fb.Mechanism('py', planar=True)\nm.add({BODY})", ""),
        (
            f"import flyball as fb\ndef mechanism():\n m = fb.Mechanism('py', planar=True)\n m.add({BODY})\n return m",
            "",
        ),
        ("import flyball as fb\nx = 1\n1 / 0", "a.py, line 3: ZeroDivisionError"),
        ("x = (", "a.py, line 1: SyntaxError"),
        ("import flyball as fb\nfb.Body('b', mas=1)", "a.py, line 2: Body 'b': unknown field 'mas'"),
        ("x = 1", "a.py defines no mechanism"),
        ("raise SystemExit(3)", "a.py, line 1: SystemExit: 3"),
    ],
)
def test_models_in_python(here: Path, text: str, said: str) -> None:
    Path("a.py").write_text(text, encoding="utf-8")
    ended = Said("check", "a.py", "--json")
    data = json.loads(ended.out)
    if said:
        assert ended.code == 2
        assert said in data["error"]
    else:
        assert ended.code == 0
        assert data["name"] == "py"


def test_the_program_starts_quickly_and_by_itself() -> None:
    code = (
        "import sys; import flyball.cli; sys.argv = ['flyball', '--version']\n"
        "try: flyball.cli.main()\n"
        "except SystemExit as end: assert not end.code\n"
        "print([k for k in ('numba', 'matplotlib', 'xarray', 'numpy', 'pint') if k in sys.modules])"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=600, check=True)
    assert ended.stdout == f"flyball {fb.__version__}\n[]\n"
    module = subprocess.run(
        [sys.executable, "-m", "flyball", "check", "no.toml"], capture_output=True, text=True, timeout=600
    )
    assert module.returncode == 2
    assert module.stderr == "error: there is no file 'no.toml'\n"
