"""Singular positions as text, plain data, pictures, and on the command line."""

import json

import pytest

import flyball as fb
from flyball.cli import app
from tests.mechanisms import EXAMPLES, example


@pytest.fixture(scope="module")
def press():
    return example("toggle_press.toml").singularities("pump", (-0.2, 1.0))


def test_text(press):
    text = str(press)
    assert "driver" in text
    assert "bifurcation; motions: 2 for a' = 1" in text
    assert "free while the driver is at rest" in text
    assert len(press.table().splitlines()) == 1 + len(press)


def test_plain_data(press):
    data = json.loads(json.dumps(press.as_dict()))
    assert [p["kind"] for p in data["points"]] == [p.kind for p in press]
    assert data["unit"] == "m"
    assert len(data["curve"]["a"]) == len(press.s)


def test_picture(press, tmp_path):
    figure = press.plot()
    assert len(figure.axes) == len(press) + 2
    press.plot(tmp_path / "press.png", coordinate="knee.angle")
    assert (tmp_path / "press.png").stat().st_size > 10_000
    with pytest.raises(fb.ModelError, match=r"no coordinate 'knee.angel' \(did you mean 'knee.angle'\?\)"):
        press.plot(coordinate="knee.angel")
    with pytest.raises(fb.ModelError, match="it must be"):
        press.plot(tmp_path / "press.bmp")


def run(*words):
    from typer.testing import CliRunner

    return CliRunner().invoke(app, ["singularities", str(EXAMPLES / "toggle_press.toml"), *words])


def test_command(tmp_path):
    done = run("pump", "--range", "-200 mm", "1", "--json", "--plot", str(tmp_path / "p.svg"))
    assert done.exit_code == 0
    data = json.loads(done.stdout)
    assert [p["kind"] for p in data["points"]].count("bifurcation") == 2
    assert (tmp_path / "p.svg").exists()
    assert "turns back" in run("pump", "--range", "-0.2", "1", "--table").stdout


def test_command_goes_on_along_a_branch():
    first = json.loads(run("pump", "--range", "-0.2", "1", "--json").stdout)
    other = json.loads(run("pump", "--range", "-0.2", "1", "--json", "--branch", "1.1").stdout)
    assert first["curve"]["a"] != other["curve"]["a"]
    wrong = run("pump", "--range", "-0.2", "1", "--branch", "9.1")
    assert wrong.exit_code == 2
    assert "there is no such branch; there are 1.0, 1.1" in wrong.output


def test_command_names_what_is_wrong():
    wrong = run("pumps", "--range", "0", "1")
    assert wrong.exit_code == 2
    assert "did you mean 'pump'?" in wrong.output
    far = run("pump", "--range", "5", "6")
    assert far.exit_code == 3
    assert "it locks up at" in far.output
