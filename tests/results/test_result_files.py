"""Results go into files and datasets with names and units, and come back bit for bit."""

from __future__ import annotations

import contextlib
import csv
import gc
import json
import pickle
import random
import re
from pathlib import Path

import h5netcdf
import numpy as np
import pytest
import xarray as xr
from PIL import Image
from scipy.io import loadmat

import flyball as fb
from flyball.results import files
from flyball.results.files import data_checksum, read_group, text_type
from flyball.results.result import Result
from flyball.results.result_tables import write_table
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


def test_numbers_of_a_table_are_exact(tmp_path: Path) -> None:
    numbers = np.array([0.1, -0.0, 1e-7, 1e22, 5e-324, np.pi, np.nan, np.inf, -np.inf])
    write_table(tmp_path / "t.csv", ["a, b", "c"], [numbers, 3.0 * numbers])
    with open(tmp_path / "t.csv", newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert header == ["a, b", "c"]
    np.testing.assert_array_equal(np.array(rows, float), np.stack([numbers, 3.0 * numbers], axis=1))


def test_tables_of_other_programs(result: Result, tmp_path: Path) -> None:
    result.save(tmp_path / "r.mat")
    mat = loadmat(tmp_path / "r.mat", simplify_cells=True)
    assert (mat["slider"]["x"] == result["slider.x"]).all()
    assert mat["units"]["slider"]["x"] == "m"
    assert (mat["t"] == result.t).all()
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed: no Parquet file can be written")
    result.save(tmp_path / "r.parquet")
    table = parquet.read_table(tmp_path / "r.parquet")
    assert table.column_names == ["time", *result.channels()]
    assert table.schema.field("slider.x").metadata == {b"unit": b"m"}
    assert (table["slider.x"].to_numpy() == result["slider.x"]).all()


def test_names_that_matlab_does_not_have(tmp_path: Path) -> None:
    m = fb.Mechanism("two", planar=True)
    for name in ("left wheel", "left_wheel", "2nd"):
        m.add(fb.Body(name, mass=1, inertia=1))
    m.simulate(0.1, outputs=3).save(tmp_path / "r.mat")
    assert {"left_wheel", "left_wheel_2", "x2nd"} <= set(loadmat(tmp_path / "r.mat"))


def test_pictures_of_the_scene(result: Result, tmp_path: Path) -> None:
    result.save(tmp_path / "r.svg")
    assert "<svg" in (tmp_path / "r.svg").read_text(encoding="utf-8")
    result.save(tmp_path / "r.png")
    with Image.open(tmp_path / "r.png") as picture:
        assert picture.width == 1280
        assert len(np.unique(np.array(picture).reshape(-1, 3), axis=0)) > 5
    with pytest.raises(
        fb.ModelError, match=r"'\.xlsx' is not known here; it must be \.nc .* \.parquet or \.mat .* \.svg"
    ):
        result.save(tmp_path / "r.xlsx")


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


DAMAGES = ["bit", "byte", "cut", "zeros", "copied", "grown"]


@pytest.mark.parametrize("how", DAMAGES)
def test_a_damaged_file_is_refused_or_tells_the_same(how: str, result: Result, tmp_path: Path) -> None:
    """Once 7 of 629 damaged files came back with other numbers, and 85 with raw exceptions; one never came back."""
    result.save(tmp_path / "good.nc")
    whole, expected = (tmp_path / "good.nc").read_bytes(), result["slider"].x.tobytes()
    dice = random.Random(how)
    for _ in range(12):
        data, at, other = bytearray(whole), dice.randrange(len(whole)), dice.randrange(len(whole))
        size = dice.choice([8, 512, 4096])
        if how == "bit":
            data[at] ^= 1 << dice.randrange(8)
        elif how == "byte":
            data[at] ^= dice.randrange(1, 256)
        elif how == "cut":
            del data[at:]
        elif how == "zeros":
            data[at : at + size] = bytes(len(data[at : at + size]))
        elif how == "copied":
            data[at : at + size] = data[other : other + len(data[at : at + size])]
        else:
            data[at:at] = data[other : other + size]
        (tmp_path / "bad.nc").write_bytes(data)
        try:
            back = fb.load_result(tmp_path / "bad.nc")
        except fb.ModelError as error:
            assert "bad.nc" in str(error)
        else:
            assert data == whole or data[-81:] != whole[-81:]  # only its checksum was hit
            assert back["slider"].x.tobytes() == expected


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
def test_attributes_that_cannot_be_read_leave_no_file_half_open(result: Result, tmp_path: Path) -> None:
    """Damaged before its end was: "Exception ignored in File.close" beside the refusal."""
    result.save(tmp_path / "r.nc")
    data = bytearray((tmp_path / "r.nc").read_bytes())
    del data[data.rindex(b"\nflyball SHA-256") :]
    for at in range(96, 480, 8):
        bad = bytearray(data)
        bad[at] ^= 255
        (tmp_path / "bad.nc").write_bytes(bad)
        with contextlib.suppress(fb.ModelError):
            fb.load_result(tmp_path / "bad.nc")
    gc.collect()


def rewritten(path: Path, change) -> None:
    """Change the file by a program that knows NetCDF and nothing of the checksum behind its end."""
    with h5netcdf.File(path, "r+") as file:
        change(file.groups["flyball"])


@pytest.mark.parametrize("pair", [("v", "vdot"), ("t", "final"), ("model", "health"), ("parameter_values", "states")])
def test_what_was_exchanged_inside_is_found(pair: tuple[str, str], result: Result, tmp_path: Path) -> None:
    result.save(tmp_path / "r.nc")
    whole = (tmp_path / "r.nc").read_bytes()

    def swap(group) -> None:
        held = read_group(group)
        a, b = (held[name] for name in pair)
        if isinstance(a, str):
            told = json.loads(group.variables["texts"][()])
            told["texts"][pair[0]] = b
            group.variables["texts"][...] = np.array(json.dumps(told), object)
            return
        if a.shape == b.shape:
            a[...], b[...] = b.copy(), a.copy()
        else:
            a[...] = np.flip(a)
        group.variables["numbers"][...] = np.concatenate([x.ravel() for x in held.values() if not isinstance(x, str)])

    rewritten(tmp_path / "r.nc", swap)
    with pytest.raises(fb.ModelError, match=r"r\.nc is damaged: its contents do not match (its|the) checksum"):
        fb.load_result(tmp_path / "r.nc")
    end = whole.rindex(b"\nflyball SHA-256")
    (tmp_path / "r.nc").write_bytes(whole[:end])  # a program that wrote it anew without harm
    same(result, fb.load_result(tmp_path / "r.nc"))


def as_before(path: Path, kind: int, **changes: str) -> None:
    """Write the file as earlier versions did: each text and each array a variable by itself."""
    with h5netcdf.File(path) as file:
        held = read_group(file.groups["flyball"]) | changes
    with h5netcdf.File(path, "w") as file:
        group = file.create_group("flyball")
        group.attrs["format"], group.attrs["version"] = kind, "0.9"
        for name, x in held.items():
            if isinstance(x, str):
                group.create_variable(name, (), dtype=text_type(), data=np.array(x, object))
                continue
            dims = tuple(f"n_{name}_{k}" for k in range(x.ndim))
            for dim, n in zip(dims, x.shape):
                group.dimensions[dim] = n
            group.create_variable(name, dims, data=x)
        if kind == 3:
            group.attrs["checksum"] = data_checksum(held, kind)


def test_files_of_one_variable_for_each_array_are_read(result: Result, tmp_path: Path) -> None:
    result.save(tmp_path / "r.nc")
    as_before(tmp_path / "r.nc", 3)
    back = fb.load_result(tmp_path / "r.nc")
    same(result, back)
    assert back.health.warnings == result.health.warnings
    rewritten(tmp_path / "r.nc", lambda group: group.attrs.update({"checksum": "0"}))
    with pytest.raises(fb.ModelError, match="do not match its checksum"):
        fb.load_result(tmp_path / "r.nc")


def test_arrays_written_one_by_one_are_the_same(result: Result, tmp_path: Path, monkeypatch) -> None:
    """Large ones are not put together in memory."""
    result.save(tmp_path / "r.nc")
    monkeypatch.setattr(files, "MAX_CONCATENATED", 10)
    result.save(tmp_path / "large.nc")
    same(fb.load_result(tmp_path / "r.nc"), fb.load_result(tmp_path / "large.nc"))


def test_files_from_before_checksums_are_read_with_a_note(tmp_path: Path) -> None:
    """Tables went on straight then, unless ``outside`` said something else."""
    result = slider_crank()
    result.model = result.model.copy()
    result.model.add(fb.Table("a", x=(0, 1), y=(0, 1), beyond="line"))
    result.model.add(fb.Table("b", x=(0, 1, 2), y=(0, 1, 0), beyond="repeat"))
    result.save(tmp_path / "r.nc")
    with h5netcdf.File(tmp_path / "r.nc") as file:
        text = read_group(file.groups["flyball"])["model"]
    text = text.replace('beyond = "line"\n', "").replace('beyond = "repeat"', 'outside = "periodic"')
    as_before(tmp_path / "r.nc", 2, model=text)
    back = fb.load_result(tmp_path / "r.nc")
    assert [x.beyond for x in back.model.tables] == ["line", "repeat"]
    assert re.search(r"r\.nc was written before result files had checksums", back.health.warnings[-1])
    same(result, back)
