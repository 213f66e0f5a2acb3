"""The example truck: static loads, ride modes, its lane change, a wheel in the air, response to a random road."""

from __future__ import annotations

import runpy

import numpy as np
import pytest
from scipy.signal import welch

import flyball as fb
from tests.mechanisms import EXAMPLES

TRUCK = runpy.run_path(str(EXAMPLES / "truck.py"))
G, KT = 9.81, 8e5
WHEELS = [f"tyre {a} {s}" for a in TRUCK["AXLES"] for s in TRUCK["SIDES"]]


def place(rest, name):
    """Position of a body at rest [m]."""
    return np.ravel(rest[name].position)


@pytest.fixture(scope="module")
def rest():
    return TRUCK["truck"](speed=0.0).equilibrium()


def test_joints_and_bodies():
    m = TRUCK["mechanism"]()
    kinds = [type(j).__name__ for j in m.joints]
    assert len(m.bodies) == 17 and kinds.count("Universal") == 6 and kinds.count("Revolute") == 4


def test_static_loads_are_those_of_the_levers(rest):
    """Weights by the wheelbase; the seat's offset to the left is shared by the springs, whose sum it does not change."""
    bodies = TRUCK["truck"](speed=0.0).bodies
    mass = np.array([b.mass for b in bodies])
    x = np.array([place(rest, b.name)[0] for b in bodies])
    front, rear = (np.mean([place(rest, f"{a} {s}")[0] for s in TRUCK["SIDES"]]) for a in TRUCK["AXLES"])
    load = {t: float(np.ravel(rest[t].load)[0]) for t in WHEELS}
    assert sum(load.values()) == pytest.approx(G * mass.sum(), rel=1e-8)
    on_front = G * (mass * (x - rear)).sum() / (front - rear)
    assert load["tyre front left"] + load["tyre front right"] == pytest.approx(on_front, rel=2e-3)
    offset = G * sum(b.mass * place(rest, b.name)[1] for b in bodies)
    moment = sum((1 if "left" in t else -1) * f for t, f in load.items())  # times 1 m
    assert moment == pytest.approx(offset, rel=0.05)


MASSES = {  # mass, moment of inertia about y, place along the truck; the engine with its shafts, axles with wheels
    "frame": (2500, 6000, 0.0), "cab": (900, 600, 2.6), "engine": (790, 152.7, 2.2), "bed": (3000, 5000, -1.2),
    "seat": (90, 5, 2.4), "front": (675, 1e6, 2.4), "rear": (595, 1e6, -2.0),
}  # fmt: skip
SPRINGS = [  # between, place, stiffness and damping of both sides; the last ones are springs with braces, and tyres
    *(("frame", "cab", x, 4e5, 1.2e4) for x in (3.2, 2.0)), *(("frame", "engine", x, 1e6, 6e3) for x in (2.6, 1.8)),
    *(("frame", "bed", x, 4e6, 2e4) for x in (-2.8, -1.2, 0.4)), *(("cab", "seat", x, 8e3, 4e2) for x in (2.2, 2.6)),
    ("frame", "front", 2.4, 5.4e5, 3.4e4), ("frame", "rear", -2.0, 8.4e5, 3.4e4),
    ("", "front", 2.4, 2 * KT, 4e3), ("", "rear", -2.0, 2 * KT, 4e3),
]  # fmt: skip


def small_model():
    """Eigenvalues of heave and pitch of the bodies on vertical springs, with positive frequency, ascending."""
    names, n = list(MASSES), 2 * len(MASSES)
    M = np.array([x for m, J, _ in MASSES.values() for x in (m, J)])
    K, C = np.zeros((n, n)), np.zeros((n, n))
    for one, other, x, k, c in SPRINGS:
        row = np.zeros(n)
        for sign, name in ((1.0, one), (-1.0, other)):
            if name:
                i = 2 * names.index(name)
                row[i : i + 2] += sign * np.array([1.0, MASSES[name][2] - x])
        K += k * np.outer(row, row)
        C += c * np.outer(row, row)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-K / M[:, None], -C / M[:, None]]])
    values = np.linalg.eigvals(A)
    return sorted(values[values.imag > 1.0], key=abs)


def test_ride_modes_are_those_of_a_small_matrix_model(rest):
    """Frequency and damping: heave 1.7 Hz, pitch 2.0 Hz, wheel hop 8.9 and 10.9 Hz; in all nine of twelve modes.

    Only the seat, the pitch of the cab and a mode with it differ by more than 4 %: their mounts act along x as well.
    """
    found = TRUCK["truck"](speed=0.0).modes(about=rest).eigenvalues
    expected = small_model()
    apart = np.array([np.abs(found - x).min() / abs(x) for x in expected])
    heave, pitch, hops = 0, 2, [7, 8]
    assert len(expected) == 12 and (apart < 0.04).sum() >= 9
    assert apart[[heave, pitch, *hops]].max() < 0.035


def test_lane_change_follows_its_path():
    """3.5 m to the left within some 80 m at 15 m/s: the rear axle is at most 0.35 m off, and on the path again after it."""
    run = TRUCK["truck"](speed=15.0, lane=3.5).simulate(11.0, outputs=221)
    error = run["steers"].error
    assert np.abs(error).max() < 0.35
    assert abs(error[-1]) < 0.05 and run["frame"].y[-1] == pytest.approx(3.5, abs=0.05)
    assert run["frame"].vx[-1] == pytest.approx(15.0, abs=0.3)
    assert not [e for e in run.events if e.name == "box_up"]


def test_wheels_in_the_air_are_named():
    run = TRUCK["mechanism"]().simulate(3.0)
    words = [w for w in run.health.warnings if "in the air" in w]
    assert any("wheel 'rear left' is in the air from t = 1.8" in w for w in words)
    lifted = run["tyre rear left"].load == 0.0
    assert lifted.any() and run["tyre rear left"].deflection[lifted].max() < 0.0


def test_spectrum_of_the_response_to_a_road(rest):
    """Power spectral density of the bed's acceleration: that of a motion against |H|^2 times the road's by ISO 8608.

    H is that of the linear model about rest: a height z of the road is a force (k + c d/dt) z on the axle, and the rear
    axle meets what the front one met 4.4 m before. Averages over frequency bands, within their statistical error.
    """
    v, step, lasts = 20.0, 0.01, 24.0
    surface = fb.RandomRoad(roughness="A", length=600.0, seed=4, start=-10.0, run_in=15.0)
    run = TRUCK["truck"](surface, speed=v).simulate(3.0 + lasts, outputs=2701)
    f, density = welch(run["bed"].az[run.t > 3.0], 1.0 / step, nperseg=512)

    m = TRUCK["truck"](speed=0.0)
    m.add(*(fb.Actuator(f"lift {a}", f"{a} axle.z", force=0.0) for a in TRUCK["AXLES"]))
    model = m.linearize([f"lift {a}" for a in TRUCK["AXLES"]], ["bed.z"], about=m.equilibrium())
    for low, high in ((0.8, 1.5), (1.5, 3.0), (3.0, 6.0), (6.0, 12.0), (12.0, 20.0)):
        band = (f >= low) & (f < high)
        expected = []
        for w in 2.0 * np.pi * f[band]:
            gain = model.C @ np.linalg.solve(1j * w * np.eye(len(model.A)) - model.A, model.B) + model.D
            both = np.array([1.0, np.exp(-1j * w * TRUCK["WHEELBASE"] / v)])
            height = (gain @ both)[0] * (2.0 * KT + 1j * w * 2.0 * 2e3)
            expected.append(np.abs(w**2 * height) ** 2 * surface.density(w / (2.0 * np.pi * v)) / v)
        deviation = 1.0 / np.sqrt(lasts * band.sum() * f[1])  # of a mean over so many independent periods
        assert density[band].mean() == pytest.approx(np.mean(expected), rel=3.0 * deviation)
