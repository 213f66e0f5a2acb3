"""Results go into files and datasets with names and units, and come back bit for bit."""

from __future__ import annotations

import csv
import pickle
from pathlib import Path

import h5netcdf
import numpy as np
import pytest
import xarray as xr

import flyball as fb
from flyball.results.result import Result
from tests.results.made_up import slider_crank


@pytest.fixture(scope="module")
def result() -> Result:
    return slider_crank()


def same(a: Result, b: Result) -> None:
    mine, other = a.channels(), b.channels()
    assert list(mine) == list(other)
    for name, (unit, values) in mine.items():
        assert other[name][0] == unit
        assert values.tobytes() == other[name][1].tobytes(), name


def test_a_saved_result_comes_back(result: Result, tmp_path: Path) -> None:
    result.save(tmp_path / "r.nc")
    back = fb.load_result(tmp_path / "r.nc")
    assert isinstance(back.model, fb.Mechanism)
    assert back.model == result.model
    same(result, back)
    assert back.health.undetermined == result.health.undetermined
    assert back.health.options == result.health.options
    assert str(back.health) == str(result.health)
    assert back.final[0] == 1.0
    assert (back.final[1] == result.final[1]).all()
    assert not list(tmp_path.glob("*.part"))


def test_parameters_are_those_of_the_run(result: Result, tmp_path: Path) -> None:
    result.save(tmp_path / "r.nc")
    back = fb.load_result(tmp_path / "r.nc")
    assert back.values.numbers["spring"].stiffness == 100.0
    assert back.model.parameters == {"speed": "60 rpm", "k": 200.0}


def test_a_free_body_has_no_rows(tmp_path: Path) -> None:
    from flyball.tables.structure import structure
    from flyball.tables.values import values

    m = fb.Mechanism("ball")
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 1)))
    x = values(structure(m))
    q = np.tile([0.0, 0, 0, 1, 0, 0, 0], (2, 1))
    r = Result(m, x, np.arange(2.0), q, *(np.zeros((2, k)) for k in (6, 0, 6, 0)), slider_crank(2).health)
    r.save(tmp_path / "r.nc")
    same(r, fb.load_result(tmp_path / "r.nc"))


def test_a_result_can_be_pickled(result: Result) -> None:
    assert result["spring"].length is not None
    same(result, pickle.loads(pickle.dumps(result)))


def test_other_programs_read_the_labelled_part(result: Result, tmp_path: Path) -> None:
    result.save(tmp_path / "r.nc")
    with xr.open_dataset(tmp_path / "r.nc", engine="h5netcdf") as ds:
        ds.load()
    assert (ds["crank.position"].sel(component="y") == result["crank.y"]).all()
    assert ds["crank.position"].attrs["units"] == "m"
    assert ds["time"].attrs["units"] == "s"
    assert ds["motor.effort"].attrs["units"] == "N*m"
    assert "torque" in ds["D.torque"].attrs["comment"]
    assert ds.attrs["title"] == "slider/crank"
    assert "dash\N{DIVISION SLASH}pot.force" in ds


def test_the_dataset(result: Result) -> None:
    ds = result.to_xarray()
    assert ds["rod.velocity"].dims == ("time", "component")
    assert ds["D.displacement_rate"].attrs["units"] == "m/s"
    assert (ds["spring.force"] == result["spring"].force).all()
    assert (ds["energy.total"] == result.energy.total).all()
    assert ds["eye.acceleration"].sel(component="x").shape == result.t.shape
    for variable in ds.data_vars.values():
        assert variable.dims[0] == "time"
        assert variable.attrs["units"]


def test_the_table(result: Result, tmp_path: Path) -> None:
    frame = result.to_dataframe()
    assert frame.attrs["units"]["slider.x"] == "m"
    assert (frame["slider.x"].to_numpy() == result["slider.x"]).all()
    result.to_csv(tmp_path / "r.csv")
    with open(tmp_path / "r.csv", newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert header[0] == "time [s]"
    assert header[1:] == [f"{k} [{unit}]" for k, (unit, _) in result.channels().items()]
    table = np.array(rows, float)
    assert (table[:, header.index("slider.x [m]")] == result["slider.x"]).all()
    assert (table[:, 0] == result.t).all()


def test_what_is_no_result_is_refused(result: Result, tmp_path: Path) -> None:
    (tmp_path / "run.nc").write_text("no NetCDF")
    with pytest.raises(fb.ModelError, match=r"there is no file '.*rum\.nc' \(did you mean 'run\.nc'\?\)"):
        fb.load_result(tmp_path / "rum.nc")
    with pytest.raises(fb.ModelError, match="cannot be read as a NetCDF result"):
        fb.load_result(tmp_path / "run.nc")
    xr.Dataset({"a": ("x", [1.0])}).to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
    with pytest.raises(fb.ModelError, match="is no result of flyball"):
        fb.load_result(tmp_path / "other.nc")
    with h5netcdf.File(tmp_path / "half.nc", "w") as file:
        file.create_group("flyball").attrs["format"] = 1
    with pytest.raises(fb.ModelError, match=r"no complete result of flyball: .* is missing"):
        fb.load_result(tmp_path / "half.nc")
    with h5netcdf.File(tmp_path / "late.nc", "w") as file:
        file.create_group("flyball").attrs.update({"format": 99, "version": "7.0"})
    with pytest.raises(fb.ModelError, match="a later version"):
        fb.load_result(tmp_path / "late.nc")
    with pytest.raises(fb.ModelError, match="cannot write"):
        result.save(tmp_path / "no" / "folder.nc")
