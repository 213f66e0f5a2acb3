"""Linear models and modes shown: Bode plots, root loci, eigenvalues, tables, the commands."""

from __future__ import annotations

import json
import math
import warnings
from pathlib import Path

import numpy as np
import pytest

import flyball as fb
from flyball.cli.application import show_notices
from flyball.compiler import object_files
from flyball.engine.entry_point import engine
from flyball.view.linear_plots import _unit_ratio, bode_frequencies, phase
from tests.analyses.classical import bicycle, stand
from tests.program.test_cli import Said

K, M, C = 100.0, 2.0, 3.0


def cart(damping: float | str = C, stiffness: float | str = K, name: str = "cart") -> fb.Mechanism:
    """m x'' + c x' + k x = u."""
    m = fb.Mechanism(name, planar=True, parameters={"c": C})
    m.add(fb.Body("A", mass=M, inertia=1, position=(1, 0)))
    m.add(fb.Translational("P", "ground", "A", at=(1, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("s", "ground", "A", at=((0, 0), (1, 0)), stiffness=stiffness, damping=damping))
    m.add(fb.PointForce("u", "A", force=("0", 0)))
    return m


def two(damping: float = 0.0) -> fb.Mechanism:
    """Two equal carts in a row."""
    m = cart(damping, name="two")
    m.add(fb.Body("B", mass=M, inertia=1, position=(2, 0)))
    m.add(fb.Translational("Q", "ground", "B", at=(2, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("r", "A", "B", at=((1, 0), (2, 0)), stiffness=K, damping=damping))
    return m


def inverted() -> fb.Mechanism:
    """A uniform rod, 1 m and 1 kg, that stands on a hinge with a motor."""
    m = fb.Mechanism("rod", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("rod", mass=1, inertia=1 / 12, position=(0, 0.5)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.Motor("motor", "A", torque="0"))
    return m


def curves(figure, panel: int) -> list[tuple[np.ndarray, np.ndarray]]:
    return [line.get_data() for line in figure.axes[panel].lines]


def test_bode_draws_the_closed_form() -> None:
    figure = cart().linearize(["u.x"], ["A.x"]).bode()
    ((w, size),), ((_, angle),) = curves(figure, 0), curves(figure, 1)
    G = 1.0 / (K - M * w**2 + 1j * C * w)
    assert size == pytest.approx(20 * np.log10(np.abs(G)), abs=1e-8)
    assert angle == pytest.approx(np.degrees(np.angle(G)), abs=1e-8)
    natural = math.sqrt(K / M)
    assert w[0] == pytest.approx(natural / 10)
    assert w[-1] == pytest.approx(10 * natural)
    peak = math.sqrt(K / M - C**2 / (2 * M**2))
    assert w[np.argmax(size)] == pytest.approx(peak, rel=5e-3)


def test_bode_overlays_outputs_and_takes_frequencies() -> None:
    linear = cart().linearize(["u.x", "c"], ["A.x", "A.vx", "P.displacement"])
    figure = linear.bode("u.x", omega=[1.0, 2.0, 4.0])
    assert [t.get_text() for t in figure.axes[0].get_legend().get_texts()] == [
        "A.x [m/N]",
        "A.vx [m/s/N]",
        "P.displacement [m/N]",
    ]
    (w, _), (_, rate), _ = curves(figure, 1)
    assert w.tolist() == [1.0, 2.0, 4.0]
    assert rate - curves(figure, 1)[0][1] == pytest.approx(90.0)
    with pytest.raises(fb.ModelError, match=r"say which; known: u\.x, c"):
        linear.bode()
    with pytest.raises(fb.ModelError, match=r"there is no output 'A.y' \(did you mean 'A.x'\?\)"):
        linear.bode("u.x", "A.y")


def test_phases_do_not_jump_at_undamped_resonances() -> None:
    """Collocated: poles and zeros alternate, the phase goes between 0 and -180; at the far end it falls to -360."""
    linear = two().linearize(["u.x"], ["A.x", "B.x"])
    w = bode_frequencies(linear, [("u.x", "A.x"), ("u.x", "B.x")])
    near, far = (np.degrees(phase(linear, "u.x", y, w, linear.response(w, "u.x", y))) for y in ("A.x", "B.x"))
    s = math.sqrt(K / M)
    low, zero, high = s * (math.sqrt(5) - 1) / 2, s, s * (math.sqrt(5) + 1) / 2
    assert near == pytest.approx(np.select([w < low, w < zero, w < high], [0.0, -180.0, 0.0], -180.0), abs=1e-3)
    assert far == pytest.approx(np.select([w < low, w < high], [0.0, -180.0], -360.0), abs=1e-3)
    assert linear.response([low * (1 + 1e-9)], "u.x", "A.x")[0].real < -1e5


def test_a_free_mass_begins_at_minus_180_degrees() -> None:
    free = cart(damping=0.0, stiffness=0.0).linearize(["u.x"], ["A.x"])
    figure = free.bode()
    ((w, size),), ((_, angle),) = curves(figure, 0), curves(figure, 1)
    assert size == pytest.approx(-20 * np.log10(M * w**2))
    assert angle == pytest.approx(-180.0)
    assert np.isinf(free.response([0.0])[0])


def test_a_response_that_is_none_says_so() -> None:
    linear = cart().linearize(["u.x"], ["A.y"])
    assert "does not depend on the input" in linear.bode().axes[0].get_title(loc="left")


@pytest.mark.parametrize(
    ("above", "below", "said"),
    [("m", "N", "m/N"), ("rad", "N*m", "rad/(N m)"), ("m/s", "1", "m/s"), ("1", "N", "1/N"), ("N", "m/s", "N/(m/s)")],
)
def test_units_of_ratios(above: str, below: str, said: str) -> None:
    assert _unit_ratio(above, below) == said


def test_root_locus_marks_ends_and_crossings() -> None:
    """u = -k x and a spring: stable for every k > -K; with u = -k x' damping vanishes at k = -C."""
    linear = cart().linearize(["u.x"], ["A.x", "A.vx"])
    figure = linear.plot_root_locus(np.linspace(0, -2 * C, 41), "u.x", "A.vx")
    said = [t.get_text() for t in figure.axes[0].texts]
    assert said[0] == f"k ≈ {-C:.4g}"
    assert "stable" in said
    legend = [t.get_text() for t in figure.axes[0].get_legend().get_texts()]
    assert legend == ["k = 0", f"k = {-2 * C:.4g}"]
    quiet = linear.plot_root_locus(np.linspace(0, 50, 21), "u.x", "A.x")
    assert [t.get_text() for t in quiet.axes[0].texts] == ["stable"]


def test_a_crossing_on_the_real_axis_is_between_two_gains() -> None:
    """The standing rod needs a spring of m g l / 2 = 4.905 N m."""
    m = inverted()
    m.add(fb.CoordinateSpring("friction", "A.angle", damping=0.1))
    linear = m.linearize(["motor"], ["A.angle"])
    figure = linear.plot_root_locus([0.0, 2.0, 4.0, 6.0, 8.0])
    assert figure.axes[0].texts[0].get_text() == "k from 4 to 6"


def test_eigenvalues_are_drawn_where_they_are() -> None:
    modes = inverted().modes()
    figure = modes.plot()
    marks = {line.get_label(): line.get_data() for line in figure.axes[0].lines if "(" in str(line.get_label())}
    growth = math.sqrt(14.715)
    assert marks["unstable (1)"][0] == pytest.approx([growth])
    assert marks["decay (1)"][0] == pytest.approx([-growth])
    damped = cart().modes().plot()
    (x, y) = next(line.get_data() for line in damped.axes[0].lines if line.get_label() == "oscillation (1)")
    assert (x[0], y[0]) == pytest.approx((-C / (2 * M), math.sqrt(K / M - (C / (2 * M)) ** 2)))


def test_eigenvalues_far_to_the_left_are_told_of_instead_of_drawn() -> None:
    m = two(0.5)
    m.add(fb.Body("C", mass=0.01, inertia=1, position=(0, 1)))
    m.add(fb.Translational("S", "ground", "C", at=(0, 1), axis=(1, 0)))
    m.add(fb.CoordinateSpring("heavy oil", "S.displacement", damping=20.0, stiffness=1.0))
    figure = m.modes().plot()  # s = -c/m = -2000 1/s, and slowly -k/c
    assert "not shown: 1 decaying faster, at -2000 to -2000 1/s" in figure.axes[0].get_title(loc="left")
    assert figure.axes[0].get_xlim()[0] > -10


def test_pictures_go_to_files(tmp_path: Path) -> None:
    linear, modes = cart().linearize(["u.x"], ["A.x"]), cart().modes()
    for k, draw in enumerate(
        (
            lambda p: linear.bode(path=p),
            lambda p: linear.plot_root_locus([0, 1, 2], path=p),
            lambda p: modes.plot(p),
        )
    ):
        assert draw(tmp_path / f"{k}.png") is None
        assert (tmp_path / f"{k}.png").stat().st_size > 10_000
    with pytest.raises(fb.ModelError, match="it must be"):
        linear.bode(path=tmp_path / "a.bmp")


def test_a_linear_model_as_text() -> None:
    lines = cart().linearize(["u.x"], ["A.x"]).lines()
    assert ("input", "u.x [N]") in lines
    assert ("output", "A.x [m], 1 at the state itself") in lines
    real, imaginary = -C / (2 * M), math.sqrt(K / M - (C / (2 * M)) ** 2)
    assert ("eigenvalues", f"{real:.6g} +- {imaginary:.6g} i 1/s") in lines
    assert dict(lines)["gain"].startswith("0.5:")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    inverted().save("rod.toml")
    cart("c").save("cart.toml")
    return tmp_path


def test_equilibrium_command(here: Path) -> None:
    said = Said("equilibrium", "rod.toml")
    assert said.code == 0
    assert said.out.split()[1] == "unstable,"
    data = json.loads(Said("equilibrium", "rod.toml", "--stable", "--json", "-o", "rod.html").out)
    assert data["stability"] == "stable"
    assert data["values"]["rod.y"]["value"] == pytest.approx(-0.5)
    assert data["files"] == ["rod.html"]
    assert "rod" in Path("rod.html").read_text(encoding="utf-8")
    m = fb.load("rod.toml")
    m.add(fb.Initial("A.angle", value="-90 deg"))
    m.save("level.toml")
    held = json.loads(Said("equilibrium", "level.toml", "--preload", "motor", "--json").out)
    assert abs(held["preload"]["motor"]) == pytest.approx(0.5 * 9.81)


def test_linearize_command(here: Path) -> None:
    said = Said("linearize", "cart.toml", "--input", "u.x", "--output", "A.x", "--bode", "b.png", "--set", "c=0")
    assert said.code == 0, said.err
    assert f"0 +- {math.sqrt(K / M):.6g} i 1/s" in said.out
    assert Path("b.png").stat().st_size > 10_000
    data = json.loads(Said("linearize", "cart.toml", "--input", "c", "--output", "A.vx", "--json").out)
    assert data["inputs"] == [{"name": "c", "unit": ""}] or data["inputs"][0]["name"] == "c"
    assert data["stiffness"] == [[pytest.approx(K)]]


def test_modes_command(here: Path) -> None:
    said = Said("modes", "cart.toml", "-o", "m.html", "--plot", "e.png")
    assert said.code == 0
    assert "oscillation" in said.out
    assert "m.html" in said.out
    assert Path("m.html").stat().st_size > 100_000
    data = json.loads(Said("modes", "rod.toml", "--equilibrium", "--count", 1, "--json").out)
    assert [mode["kind"] for mode in data["modes"]] == ["unstable"]
    assert data["modes"][0]["eigenvalue"][0] == pytest.approx(math.sqrt(14.715))


@pytest.mark.parametrize(
    ("words", "code", "part"),
    [
        (["linearize", "cart.toml", "--bode", "b.png"], 2, "give one --input, and one --output or more"),
        (["linearize", "cart.toml", "--input", "v"], 2, "has no input 'v'"),
        (["linearize", "cart.toml", "--output", "B.x"], 2, "'B'"),
        (["modes", "cart.toml", "--count", "0"], 2, "count must be at least 1"),
        (["modes", "cart.toml", "--t", "1 m"], 2, "--t: '1 m': expected a time"),
        (["modes", "cart.toml", "-o", "no/m.html"], 2, "there is no folder 'no'"),
        (["equilibrium", "rod.toml", "--preload", "moto"], 2, "(did you mean 'motor'?)"),
    ],
)
def test_wrong_words_end_with_a_message(here: Path, words: list[str], code: int, part: str) -> None:
    said = Said(*words)
    assert said.code == code
    assert part in said.err


def test_what_falls_for_ever_has_no_equilibrium(here: Path) -> None:
    m = fb.Mechanism("falls", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("stone", mass=1, inertia=1))
    m.save("falls.toml")
    said = Said("equilibrium", "falls.toml")
    assert said.code == 3
    assert "stone.y" in said.err


def test_what_is_compiled_is_said_before(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    """On a command line as a plain line; nothing is said of what takes no time."""
    monkeypatch.setattr(object_files, "_scale", [1.0])
    monkeypatch.setitem(object_files.COSTS, "engine", ("the equations of motion", 18.0))
    with (
        pytest.warns(fb.PerformanceNotice, match=r"once: the equations of motion, about 20 s"),
        object_files.announce_compilation(engine),
    ):
        pass
    with warnings.catch_warnings():
        show_notices(True)
        monkeypatch.setattr(object_files, "_scale", [3.0])
        with object_files.announce_compilation(engine):
            pass
        assert capsys.readouterr().err.strip().endswith("the equations of motion, about 55 s")
        show_notices(False)
        with object_files.announce_compilation(engine):
            pass
    assert capsys.readouterr().err == ""


def test_a_linear_model_has_a_plot(tmp_path) -> None:
    """Eigenvalues, and of one input and output the zeros."""
    linear = stand(0.0).linearize()
    (ax,) = linear.plot().axes
    assert sorted(ax.lines[0].get_xdata()) == pytest.approx(sorted(linear.eigenvalues.real))
    assert "2-fold" in [t.get_text() for t in ax.texts]
    linear.plot(tmp_path / "poles.png")
    assert (tmp_path / "poles.png").stat().st_size > 5000
    assert linear.as_dict()["seen_from"] == ""
    text = str(bicycle().linearize())
    assert "seen from: the ground" in text
    assert "e-1" not in text  # no rounding
