"""Exported code run: C by way of gcc, and states at which it is compared with the engine."""

from __future__ import annotations

import ctypes
import runpy
import shutil
import subprocess

import numpy as np
import pytest

import flyball as fb
from tests.mechanisms import EXAMPLES

STRICT = ["-Wall", "-Wextra", "-std=c99", "-pedantic", "-Werror", "-O1"]


def example(name):
    path = EXAMPLES / name
    return fb.load(path) if path.suffix == ".toml" else runpy.run_path(str(path))["mechanism"]()


def rubbing():
    """A slider-crank whose slide and pin rub on what they carry, driven by a torque that a table tells."""
    m = fb.Mechanism("rubbing crank", planar=True, gravity=(0, -9.81), parameters={"mu": 0.12, "stiff": 200.0})
    m.add(fb.Table("torque", x=(-4.0, -1.0, 0.0, 0.5, 2.0, 5.0), y=(0.5, 0.3, 1.2, -0.4, 0.8, 0.1), beyond="line"))
    m.add(
        fb.Body("crank", mass=0.4, inertia=1e-3, position=(0.05, 0.02)),
        fb.Body("rod", mass=0.3, inertia=2e-3, position=(0.2, 0.0)),
        fb.Body("slider", mass=0.7, inertia=1e-3, position=(0.31, 0.0)),
        fb.Revolute("A", "ground", "crank", at=(0, 0)),
        fb.Revolute("B", "crank", "rod", at=(0.1, 0.05)),
        fb.Revolute("C", "rod", "slider", at=(0.31, 0)),
        fb.Translational("guide", "ground", "slider", at=(0.31, 0), axis=(1, 0)),
        fb.Motor("motor", "A", torque="torque(angle) + 0.1*sin(3*t)"),
        fb.JointFriction("slide", joint="guide", static="mu", kinetic=0.08, stick_speed="2 cm/s", bending_length=0.05),
        fb.JointFriction("pin", joint="C", static=0.1, radius=0.01, stick_speed="5 mm/s"),
        fb.SpringDamper("spring", "ground", "slider", at=((0.6, 0.1), (0.31, 0)), stiffness="stiff", damping=3.0),
    )
    return m


def states(p, count=4, seed=3):
    """Times and states (t, q, v) of a prepared mechanism: of a motion where rows are redundant or
    drivers prescribe coordinates, else near its start."""
    c = p._start.compiled
    rng = np.random.default_rng(seed)
    redundant = len(p.rows) and np.linalg.matrix_rank(p.jacobian(0.0, p.q), tol=1e-9) < len(p.rows)
    if redundant or c.structure.prescribed:
        r = p.simulate(0.01)
        return [(float(r.t[k]), r.q[k], r.v[k]) for k in np.linspace(0, len(r.t) - 1, count).astype(int)]
    v = [p.v + 0.5 * rng.normal(size=len(p.v)) for _ in range(count)]
    return [(0.01 * k, p.step(p.q, 0.02 * rng.normal(size=len(p.v))), v[k]) for k in range(count)]


class Library:
    """A library made of exported C: functions of NumPy arrays."""

    def __init__(self, code, folder):
        if shutil.which("gcc") is None:
            pytest.skip("there is no gcc here")
        code.written(folder)
        command = ["gcc", *STRICT, "-shared", "-fPIC", f"{code.name}.c", "-o", "code.so", "-lm"]
        subprocess.run(command, cwd=folder, check=True)
        self.code, self.library = code, ctypes.CDLL(str(folder / "code.so"))

    def __call__(self, name, **given):
        """Results by name; ``given`` are all arguments that some function takes."""
        r = next(r for r in self.code.routines if r.name == name)
        arrays = [np.array(given[a.name], float) for a in r.arguments]
        out = {k: np.full(a.shape, np.nan) for k, a in r.arrays.items()}
        pointers = [ctypes.c_double(float(a)) if a.ndim == 0 else a.ctypes.data_as(ctypes.c_void_p) for a in arrays]
        pointers += [x.ctypes.data_as(ctypes.c_void_p) for x in out.values()]
        getattr(self.library, f"{self.code.name}_{name}")(*pointers)
        return out


def given_at(eq, code, state):
    """Arguments of the exported functions at a state of the engine."""
    t = eq.named_equations.traced
    values = eq.checked(eq.state(*state), {p.symbol.data.name: p.symbol for p in eq.named_equations.places})
    named = {"q": t.q, "v": t.v, "places": [p.symbol for p in eq.named_equations.places]}
    return code.start | {"t": state[0]} | {k: [values[x.data.name] for x in s] for k, s in named.items()}


def close(a, b, tolerance=1e-12):
    """Equal to a part of the largest."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    assert a.shape == b.shape
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance * max(np.abs(b).max(initial=0.0), 1e-300))
