"""Roads: spectra of ISO 8608, files of OpenCRG, splines, and a quarter car on a random road."""

import numpy as np
import pytest

import flyball as fb
from flyball.forces.tyres.road_height import pack_curved, pack_straight, road_height


@pytest.mark.parametrize(("letter", "value"), [("A", 16e-6), ("C", 256e-6), ("H", 262144e-6)])
def test_the_spectrum_of_a_random_road_is_the_standards(letter, value):
    """Periodogram of the heights: G_d(n0) (n / n0)^-w at every frequency of the range, nothing elsewhere."""
    road = fb.RandomRoad(roughness=letter, length=500.0, spacing=0.1, waviness=2.2, seed=7)
    z = road.grid().heights[:-1, 0]
    n = np.fft.rfftfreq(len(z), 0.1)
    density = 2.0 * np.abs(np.fft.rfft(z)) ** 2 * 0.1 / len(z)
    inside = (n >= 0.011) & (n <= 2.83)
    assert density[inside] == pytest.approx(value * (n[inside] / 0.1) ** -2.2, rel=1e-9)
    assert density[~inside].max() < 1e-12 * density.max()
    assert z.std() ** 2 == pytest.approx(density.sum() / 500.0, rel=1e-9)


def test_seeds_make_roads_and_tracks_are_coherent():
    z = [fb.RandomRoad(roughness="B", length=200.0, seed=k).grid().heights[:, 0] for k in (1, 1, 2)]
    assert (z[0] == z[1]).all() and abs(z[0] - z[2]).max() > 1e-3
    road = fb.RandomRoad(roughness="B", length=4000.0, spacing=0.1, seed=3, track=1.6)
    grid = road.grid()
    y = grid.across[0] + grid.across[1] * np.arange(grid.heights.shape[1])
    left, right = (np.fft.rfft(grid.heights[:-1, np.argmin(abs(y - at))]) for at in (0.8, -0.8))
    n = np.fft.rfftfreq(len(grid.heights) - 1, 0.1)
    for low, high in ((0.02, 0.04), (0.2, 0.3), (1.0, 1.5)):
        band = (n > low) & (n < high)
        power = abs(left[band]) ** 2
        cross = np.real(left[band] * right[band].conj()).sum() / power.sum()
        assert cross == pytest.approx((road.coherence(n[band]) * power).sum() / power.sum(), abs=0.06)


CRG = """$CT
A straight road of 3 by 5 points, the last height missing.
$
$ROAD_CRG
REFERENCE_LINE_INCREMENT = 1.0
LONG_SECTION_V_INCREMENT = 0.50
$
$KD_Definition
#:LRFI
{channels}D:long section 1,m
D:long section 2,m
D:long section 3,m
$
$$$$
"""


def crg(tmp_path, rows, channels="", **replaced):
    text = CRG.format(channels=channels)
    for old, new in replaced.items():
        text = text.replace(old, new)
    path = tmp_path / "road.crg"
    path.write_text(
        text + "".join("".join(f"{x:>10.7f}" if x is not None else " *missing*" for x in r) + "\n" for r in rows)
    )
    return fb.OpenCRG(path=path)


def test_a_straight_opencrg_file(tmp_path):
    """The first long section is the right one, v = -0.5 m."""
    grid = crg(tmp_path, [[0.1 * k, 0.1 * k, 0.1 * k - 0.02] for k in range(7)]).grid()
    assert grid.heights.shape == (7, 3) and grid.across == (-0.5, 0.5) and grid.line is None
    data = pack_straight(grid.heights, grid.along, grid.across, False)
    assert road_height(data, 0, 3.0, -0.5)[:2] == pytest.approx((0.3, 0.1), abs=1e-9)
    assert road_height(data, 0, 3.0, 0.5)[0] == pytest.approx(0.28, abs=1e-9)
    assert np.isnan(road_height(data, 0, 6.5, 0.0)[0]) and np.isnan(road_height(data, 0, 3.0, 0.6)[0])


def test_missing_heights_are_no_road(tmp_path):
    rows = [[0.0, 0.0, 0.0] for _ in range(12)]
    rows[10][2] = None
    grid = crg(tmp_path, rows).grid()
    data = pack_straight(grid.heights, grid.along, grid.across, False)
    assert road_height(data, 0, 5.0, 0.4)[0] == 0.0 and np.isnan(road_height(data, 0, 10.0, 0.4)[0])


def test_a_curved_opencrg_file(tmp_path):
    """A bend of radius 50 m that rises along it: height and slope where the arc says."""
    rows = [[0.02 * k if k else None, *[0.05 * k] * 3] for k in range(60)]
    surface = crg(tmp_path, rows, "D:reference line phi,rad\n")
    grid = surface.grid()
    data = pack_curved(grid.heights, grid.along, grid.across, grid.line, False)
    angle, radius = 0.02 * 30 + 0.01, 50.0 - 0.3  # 0.3 m to the left of the line
    at = grid.line[30] + 0.3 * np.array([-np.sin(angle), np.cos(angle)])
    z, zx, zy = road_height(data, 0, *at)
    assert z == pytest.approx(1.5, abs=2e-3)
    assert zx * np.cos(angle) + zy * np.sin(angle) == pytest.approx(0.05 * 50.0 / radius, rel=1e-3)
    step = 1e-30
    slopes = [
        np.imag(road_height(data, 0, at[0] + dx * 1j, at[1] + dy * 1j)[0]) / step for dx, dy in ((step, 0), (0, step))
    ]
    assert (zx, zy) == pytest.approx(tuple(slopes), rel=1e-9)


def bend(hold, t=(-2.0, 1.0), turn=0.02):
    """A bend of 50 m radius whose height is its arc length / 20: numbers, and the line (60, 2)."""
    heading = turn * np.arange(60)
    line = np.cumsum(np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=0)
    z = np.repeat(0.05 * np.arange(60.0)[:, None], 5, axis=1)
    return pack_curved(z, (0.0, 1.0), t, line, hold), line, heading


def test_edges_of_a_curved_road_are_held():
    """Far to either side the height is that of the edge; beyond the ends that of the end; without hold there is none."""
    data, line, heading = bend(True)
    for k, side in ((20, 10.0), (30, -25.0), (40, 30.0)):
        normal = np.array([-np.sin(heading[k] + 0.01), np.cos(heading[k] + 0.01)])
        at = line[k] + side * normal
        z, zx, zy = road_height(data, 0, *at)
        assert z == pytest.approx(0.05 * k, abs=5e-3)
        assert normal @ (zx, zy) == pytest.approx(0.0, abs=1e-3)
    end = line[-1] + 40.0 * np.array([np.cos(heading[-1]), np.sin(heading[-1])])
    assert road_height(data, 0, *end) == pytest.approx((0.05 * 59, 0.0, 0.0), abs=1e-6)
    assert np.isnan(road_height(bend(False)[0], 0, *end)[0])


@pytest.mark.parametrize(("first", "radius"), [(-3.0, 3.1), (-1.0, 5.1)])
def test_legs_of_a_serpentine_are_told_apart(first, radius):
    """Two straight legs and a half circle, the legs nearly touching: each point has the height of its own leg."""
    straight, step = 40.0, 0.5
    s = np.arange(0.0, 2 * straight + np.pi * radius, step)
    turn = np.clip((s - straight) / radius, 0.0, np.pi)
    back = np.clip(s - straight - np.pi * radius, 0.0, None)
    x = np.minimum(s, straight) + radius * np.sin(turn) - back
    line = np.stack([x, radius * (1.0 - np.cos(turn))], axis=1)
    z = np.repeat(0.01 * s[:, None], 7, axis=1)
    data = pack_curved(z, (0.0, step), (first, 1.0), line, False)
    for left in first + np.array([0.02, 3.0, 5.98]):
        for at in (5.0, 20.3, 35.0):
            assert road_height(data, 0, at, left)[0] == pytest.approx(0.01 * at, abs=1e-4)
            way = 2 * straight + np.pi * radius - at
            assert road_height(data, 0, at, 2 * radius - left)[0] == pytest.approx(0.01 * way, abs=1e-3)


def test_a_road_that_crosses_itself_is_refused(tmp_path):
    rows = [[0.1 * k if k else None, 0.0, 0.0, 0.0] for k in range(80)]
    with pytest.raises(fb.ModelError, match="crosses itself"):
        crg(tmp_path, rows, "D:reference line phi,rad\n").grid()


def rig(surface, v=8.0, **more):
    """A quarter car whose wheel slides along x at a speed: unsprung mass on a tyre, sprung mass on a spring."""
    m = fb.Mechanism("quarter car", gravity=(0, 0, -9.81), parameters={"v": v})
    m.add(fb.Road("road", surface=surface, **more))
    # the hub turns in the carrier; both only move along x and z
    weight = 9.81 * 440.0
    radius = 0.3 - weight / 2e5
    m.add(fb.Body("slide", mass=1, inertia=(1, 1, 1), position=(0, 0, 1)))
    m.add(fb.Body("hub", mass=38, inertia=(1, 1, 1), position=(0, 0, radius)))
    m.add(fb.Body("wheel", mass=2, inertia=(0.1, 0.2, 0.1), position=(0, 0, radius)))
    m.add(fb.Body("body", mass=400, inertia=(1, 1, 1), position=(0, 0, 1.0)))
    m.add(
        fb.Prismatic("way", "ground", "slide", at=(0, 0, 1), axis=(1, 0, 0)),
        fb.Driver("speed", "way.displacement", "v*t"),
    )
    m.add(fb.Prismatic("lower", "slide", "hub", at=(0, 0, radius), axis=(0, 0, 1)))
    m.add(fb.Prismatic("upper", "slide", "body", at=(0, 0, 1), axis=(0, 0, 1)))
    m.add(
        fb.Revolute("spin", "hub", "wheel", at=(0, 0, radius), axis=(0, 1, 0)), fb.Initial("spin.angle", rate="v/0.29")
    )
    at = ((0, 0, radius), (0, 0, 1.0))
    m.add(
        fb.SpringDamper(
            "spring", "hub", "body", at=at, stiffness=2e4, damping=1500.0, length=1.0 - radius + 400 * 9.81 / 2e4
        )
    )
    model = fb.LinearTyre(
        radius=0.3, stiffness=2e5, damping=0.0, nominal_load=4e3, slip_stiffness=8e4, cornering_stiffness=6e4
    )
    m.add(fb.Tyre("tyre", "road", "wheel", model=model))
    return m


def transfer(f):
    """Displacement of the body by that of the road, of the quarter car above."""
    s = 2j * np.pi * f
    k, c, kt, m1, m2 = 2e4, 1500.0, 2e5, 40.0, 400.0
    A = np.array([[m2 * s**2 + c * s + k, -(c * s + k)], [-(c * s + k), m1 * s**2 + c * s + k + kt]])
    return np.linalg.solve(A, [0.0, kt])[0]


@pytest.mark.parametrize("f", [1.0, 3.0])
def test_a_quarter_car_follows_its_transfer_function(f):
    """A wavy road of 2 mm, driven over at 8 m/s: the amplitude of the body is that of the closed form."""
    v, length = 8.0, 80.0
    x = np.arange(-5.0, length, 0.05)
    rise = np.clip(x / 10.0, 0.0, 1.0)
    z = 2e-3 * np.sin(2 * np.pi * f / v * x) * rise**3 * (10 - 15 * rise + 6 * rise**2)
    run = rig(fb.RoadProfile(heights=z, spacing=0.05, start=-5.0)).simulate(9.0, outputs=1801)
    late = run.t > 9.0 - 4.0 / f
    t, motion = run.t[late], run["body"].z[late]
    basis = np.stack([np.sin(2 * np.pi * f * t), np.cos(2 * np.pi * f * t), np.ones_like(t)], axis=1)
    a, b, _ = np.linalg.lstsq(basis, motion, rcond=None)[0]
    assert np.hypot(a, b) == pytest.approx(2e-3 * abs(transfer(f)), rel=2e-2)


def test_a_road_that_ends_stops_the_motion_by_name():
    surface = fb.RoadProfile(heights=[0.0] * 60, spacing=0.1, start=-2.0)
    with pytest.raises(fb.SimulationError, match=r"Tyre 'tyre'.*'road' ends before x = 3.9"):
        rig(surface).simulate(3.0)
    run = rig(surface, beyond="hold").simulate(3.0)
    assert run["tyre"].load[-1] == pytest.approx(440.0 * 9.81, rel=1e-3)
