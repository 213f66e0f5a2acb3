"""Sets of bodies and contacts in results: read by name, written to files and back, drawn."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import flyball as fb
from flyball.results.contacts import CONTACT_COLUMNS
from flyball.results.health import ContactHealth
from flyball.view.animation import MAX_POSES, record_motion, thinned_times
from flyball.view.recording import Figure, PointPaths
from flyball.view.result_plots import standard_pictures, write_pictures
from tests.results.made_up import thrown

PLANES = pytest.mark.parametrize("planar", [False, True])


@PLANES
def test_sets_and_members_are_read_by_name(planar: bool) -> None:
    r = thrown(planar=planar)
    axes = 2 if planar else 3
    assert r["balls"].position.shape == (5, 3, axes)
    np.testing.assert_allclose(r["balls[2].x"], 3.0 + r.t)
    np.testing.assert_allclose(r["balls[2]"].velocity[:, 0], 1.0)
    np.testing.assert_allclose(r["balls[0].omega" if planar else "balls[0].omega_z"], 4.0)
    np.testing.assert_allclose(r["balls[1]"].contact_force @ np.eye(axes)[-1], 5.0)
    assert not r["balls[0]"].contact_force.any()
    np.testing.assert_allclose(r["block"].contact_force[:, 0], 1.0)
    np.testing.assert_allclose(r["block.contact_fx"], 1.0)
    if planar:
        np.testing.assert_allclose(r["balls[0].angle"], 4.0 * r.t)
    else:
        np.testing.assert_allclose(r["balls[0]"].rotation[:, 0, 0], np.cos(4.0 * r.t))
    assert "balls[2].x" in r
    assert "balls[2].ax" not in r
    assert "balls.position" in r
    assert not any(name.startswith("balls.") for name in r.channels())
    assert set(r.channels()) >= {"block.x", "block.contact_fx", "energy.friction_loss"}
    for wrong, said in (("balls[3]", "members 0 to 2"), ("balls[1].q", "no curve 'q'"), ("bals[1]", "no part named")):
        with pytest.raises(fb.ModelError, match=said):
            r[wrong]


@PLANES
def test_energy_of_free_flight_is_kept(planar: bool) -> None:
    r = thrown(planar=planar)
    fixed = r.energy.exchanged("friction_loss")
    np.testing.assert_allclose(r.energy.total - r.energy.total[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(r.energy.balance, fixed, atol=1e-12)


@PLANES
def test_a_saved_result_with_contacts_comes_back_exactly(planar: bool, tmp_path: Path) -> None:
    r = thrown(planar=planar)
    r.save(tmp_path / "r.nc")
    back = fb.load_result(tmp_path / "r.nc")
    assert back.model == r.model
    assert str(back.health) == str(r.health)
    assert back.health.contact == r.health.contact
    a, b = r.contacts, back.contacts
    assert a is not None
    assert b is not None
    assert a.history is not None
    assert b.history is not None
    assert a.sides == b.sides
    for name in (*CONTACT_COLUMNS, "begin", "t"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes(), name
    assert a.history.as_dict() == b.history.as_dict()
    for name in ("mass", "inertia", "com", "position", "quaternion", "velocity", "angular_velocity"):
        assert getattr(r.bulk["balls"], name).tobytes() == getattr(back.bulk["balls"], name).tobytes()
    assert (back["energy.friction_loss"] == r["energy.friction_loss"]).all()
    with xr.open_dataset(tmp_path / "r.nc", engine="h5netcdf") as ds:
        ds.load()
    assert ds["balls.position"].dims == ("time", "balls_member", "component")
    assert (ds["balls.position"].values == r["balls"].position).all()
    assert set(r.to_xarray()["balls.velocity"].dims) == {"time", "balls_member", "component"}


@PLANES
def test_pictures_have_sets_ground_and_contact_forces(planar: bool) -> None:
    r = thrown(planar=planar)
    seen = record_motion(r)
    (balls,) = seen.sets
    assert balls.colors == ("teal",)
    np.testing.assert_array_equal(balls.scale, [1, 1, 0.5])
    np.testing.assert_array_equal(balls.p[:, :, : 2 if planar else 3], r["balls"].position)
    walls = [s for b in seen.bodies if b.name.startswith("floor") for s in b.shapes]
    assert len(walls) == (2 if planar else 1)  # a level floor in space is the page's own
    thick = walls[-1].size[1 if planar else 2]
    assert walls[-1].position[0] + thick / 2 == pytest.approx(-1.0)  # the wall's surface is where the plane is
    assert seen.contacts is not None
    np.testing.assert_array_equal(seen.contacts.force, r.contacts.force)  # ground is the first side
    assert "worst overlap" in seen.notes
    assert len(r.html()) < 1e6


@PLANES
def test_standard_pictures_and_reports_of_sets_and_contacts(planar: bool, tmp_path: Path) -> None:
    r = thrown(planar=planar)
    for bodies in (list(r.model.bodies), []):
        r.model.bodies[:] = bodies  # a model of sets only has no other bodies to show
        found = {p.name: p.content for p in standard_pictures(r)}
        paths = found["paths"]
        assert isinstance(paths, PointPaths)
        assert ("block" in paths.points) == bool(bodies)
        if not bodies:
            np.testing.assert_allclose(paths.points["balls[2]"][:, 0], 3.0 + r.t)
        shown = found["contacts"]
        assert isinstance(shown, Figure)
        np.testing.assert_array_equal(shown.panels[0].curves[0].values, 2.0)
        write_pictures(standard_pictures(r), tmp_path)


def test_contact_forces_are_drawn_on_what_moves() -> None:
    r = thrown()
    c = r.contacts
    assert c is not None
    r.contacts = dataclasses.replace(c, pair=c.pair[:, ::-1].copy())
    drawn = record_motion(r).contacts
    assert drawn is not None
    np.testing.assert_array_equal(drawn.force, -c.force)


def test_pictures_of_very_many_bodies_are_fewer() -> None:
    assert len(thinned_times(61, 1000)) == 61
    few = thinned_times(401, 100_000)
    assert (few[0], few[-1], len(few)) == (0, 400, MAX_POSES // 100_000)


def test_health_says_what_went_wrong_with_contacts() -> None:
    r = thrown()
    assert r.health.contact is not None
    assert r.health.contact.warnings() == ()
    cut = ContactHealth("APGD", solves=400, unconverged=3, iterations=4000, worst_at=0.25, residual=0.1)
    assert "3 of 400 contact solves were stopped before convergence, the worst at t = 0.25 s" in cut.warnings()[0]
    assert dict(cut.lines())["contact solves"] == "400, 10 iterations each, 3 not converged"
    (deep,) = ContactHealth(worst_overlap=0.01, size=0.1).warnings()
    assert "10 per cent of the smallest body" in deep
    (begun,) = ContactHealth(worst_overlap=0.01, overlap_at_start=0.01, size=0.1).warnings()
    assert "in the reference configuration" in begun
    noted = ContactHealth(notes=("no unique force: Painleve",))
    r.health.contact = noted
    assert r.health.warnings == ("no unique force: Painleve",)
    assert ContactHealth.from_dict(noted.as_dict()) == noted
