"""Functional mock-up units: valid by fmpy, the same motions as here, inputs, parameters, states of controllers."""

from __future__ import annotations

import runpy
import shutil
import zipfile

import numpy as np
import pytest

import flyball as fb
from tests.mechanisms import EXAMPLES, example

fmpy = pytest.importorskip("fmpy")
pytestmark = pytest.mark.skipif(not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="needs a C compiler")
KINDS = ("CoSimulation", "ModelExchange")


def run_unit(path, end, names, kind, steps=50, **options):
    return fmpy.simulate_fmu(
        str(path), stop_time=end, output_interval=end / steps, fmi_type=kind, record_events=False, output=names,
        relative_tolerance=1e-9, **options,
    )  # fmt: skip


@pytest.mark.parametrize(("language", "version"), [("fmu2", "2.0"), ("fmu", "3.0")])
def test_a_closed_loop_moves_as_it_does_here(language, version, tmp_path):
    """A loop in space: the state is projected onto its constraints, within steps and by the importer's event mode."""
    from fmpy.validation import validate_fmu

    m = example("spatial_four_bar.toml")
    (path,) = m.export(tmp_path, language=language, outputs=["A.angle", "B.fx", "energy.total"]).files
    assert validate_fmu(str(path)) == []
    assert fmpy.read_model_description(str(path)).fmiVersion == version
    here = m.simulate(0.5, outputs=51, rtol=1e-11)
    for kind in KINDS:
        found = run_unit(path, 0.5, ["A.angle", "B.fx", "energy.total"], kind)
        assert np.abs(found["A.angle"] - here["A.angle"]).max() < 1e-5
        assert np.abs(found["energy.total"] - here["energy.total"]).max() < 1e-5 * np.ptp(here.energy.kinetic)
        force = here["B"].force[:, 0]
        assert np.abs(found["B.fx"] - force).max() < 1e-4 * np.abs(force).max()


def test_a_body_that_turns_in_space(tmp_path):
    """Quaternions stay of unit length; the angular momentum and the energy are kept."""
    m = fb.Mechanism("stone")
    m.add(fb.Body("s", mass=2, inertia=(1, 2, 3), angular_velocity=(0.1, 5, 0.2)))
    (path,) = m.export(tmp_path, language="fmu", outputs=["energy.kinetic", "s.x"]).files
    names = [v.name for v in fmpy.read_model_description(str(path)).modelVariables]
    turns = [n for n in names if n.startswith("s.e") and not n.startswith("der")]
    assert len(turns) == 4
    found = run_unit(path, 4, [*turns, "energy.kinetic"], "CoSimulation")
    here = m.simulate(4, outputs=51, rtol=1e-11)
    e = np.array([found[n] for n in turns]).T
    np.testing.assert_allclose(np.abs((e * here["s"].quaternion).sum(axis=1)), 1.0, atol=1e-9)
    np.testing.assert_allclose(found["energy.kinetic"], here.energy.kinetic, rtol=1e-8)


def test_inputs_parameters_and_controllers(tmp_path):
    """A cart on a spring under a force, and a lag: closed forms; a parameter moves the start onto the constraints."""
    m = fb.Mechanism("cart", planar=True, parameters={"k": 4.0, "at": 0.0, "T": 0.5})
    m.add(fb.Body("cart", mass=1, inertia=1, position=("at", 0)))
    m.add(fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)), fb.Sensor("x", "rail.displacement"))
    m.add(fb.CoordinateSpring("spring", "rail.displacement", stiffness="k"), fb.Lag("slow", of="x", time="T"))
    m.add(fb.PointForce("push", "cart", force=(0.0, 0.0)))
    made = m.export(tmp_path, language="fmu2", inputs=["push.x"], outputs=["cart.vx"])
    given = np.array([(0.0, 2.0), (5.0, 2.0)], dtype=[("time", float), ("push.x", float)])
    slow = made.names["z"][0]
    t = np.linspace(0, 2, 51)
    for kind in KINDS:
        found = run_unit(made.files[0], 2, ["cart.vx", slow], kind, input=given, start_values={"k": 9.0})
        np.testing.assert_allclose(found["cart.vx"], 2 / 3 * np.sin(3 * t), atol=1e-6)  # 2 N on 1 kg and 9 N/m
        # y' = (x - y) / T with x = 2/9 (1 - cos 3t)
        w, T, size = 3.0, 0.5, 2 / 9
        y = size * (1 - (np.cos(w * t) + w * T * np.sin(w * t)) / (1 + (w * T) ** 2))
        y -= size * (1 - 1 / (1 + (w * T) ** 2)) * np.exp(-t / T)
        np.testing.assert_allclose(found[slow], y, atol=1e-6)


def test_the_same_equations_give_the_same_file(tmp_path):
    m = fb.Mechanism("p", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("rod", mass=1, inertia=0.1, position=(0.5, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    one, two = (m.export(tmp_path / n, language="fmu").files[0] for n in "ab")
    with zipfile.ZipFile(one) as a, zipfile.ZipFile(two) as b:
        assert a.namelist() == b.namelist()
        assert a.read("modelDescription.xml") == b.read("modelDescription.xml")
        assert not any(name.endswith(".py") for name in a.namelist())


def test_what_a_unit_cannot_have_is_refused(tmp_path, monkeypatch):
    m = fb.Mechanism("p", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("rod", mass=1, inertia=0.1, position=(0.5, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    with pytest.raises(fb.ModelError, match="functions= has no effect with language='fmu'"):
        m.export(tmp_path, language="fmu", functions=["M"])
    with pytest.raises(fb.ModelError, match=r"followers on curves, which FMUs do not support"):
        runpy.run_path(str(EXAMPLES / "cam.py"))["mechanism"](24).export(language="fmu")
    monkeypatch.setenv("CC", "false")
    with pytest.raises(fb.ModelError, match="the C compiler 'false' fails"):
        m.export(tmp_path, language="fmu")
    monkeypatch.setenv("CC", "")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(fb.ModelError, match="an FMU needs a C compiler: install gcc or clang"):
        m.export(tmp_path, language="fmu")
