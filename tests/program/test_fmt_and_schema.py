"""The commands for the text of model files: `flyball fmt` and `flyball schema`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

import flyball as fb
from flyball.cli import app
from flyball.cli.view import SCHEMA_FILE


def said(*words: str):
    return CliRunner().invoke(app, list(words))


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    assert said("new", "four-bar").exit_code == 0
    return tmp_path


def test_fmt_rewrites_a_file_and_keeps_the_model(here):
    text = Path("four-bar.toml").read_text(encoding="utf-8")
    Path("mine.toml").write_text(text.replace("type = ", "type="), encoding="utf-8")
    before = fb.load("mine.toml")
    answer = said("fmt", "mine.toml", "four-bar.toml")
    assert (answer.exit_code, answer.stdout) == (0, "mine.toml is rewritten\n")
    assert Path("mine.toml").read_text(encoding="utf-8") == text
    assert fb.load("mine.toml") == before


def test_check_names_the_file_and_writes_nothing(here):
    untidy = 'planar=true\nname="m"\n'
    Path("mine.toml").write_text(untidy, encoding="utf-8")
    answer = said("fmt", "--check", "four-bar.toml", "mine.toml")
    assert (answer.exit_code, answer.stdout) == (1, "mine.toml has another layout\n")
    assert Path("mine.toml").read_text(encoding="utf-8") == untidy
    assert said("fmt", "--check", "four-bar.toml").exit_code == 0


def test_fmt_refuses_what_is_no_model_file(here):
    Path("broken.toml").write_text('name = "m"\n[[bodies]\n', encoding="utf-8")
    answer = said("fmt", "broken.toml")
    assert answer.exit_code == 2
    assert "broken.toml, line 2: " in answer.stderr
    assert Path("broken.toml").read_text(encoding="utf-8") == 'name = "m"\n[[bodies]\n'
    assert "there is no file 'four_bar.toml' (did you mean 'four-bar.toml'?)" in said("fmt", "four_bar.toml").stderr
    assert "must be .toml" in said("fmt", "model.py").stderr


def test_a_new_file_names_the_schema_beside_it(here):
    answer = said("schema", "-o", SCHEMA_FILE)
    assert answer.exit_code == 0
    assert f"#:schema ./{SCHEMA_FILE}" in answer.stdout
    assert json.loads(Path(SCHEMA_FILE).read_text(encoding="utf-8")) == json.loads(said("schema").stdout)
    assert said("new", "cam").exit_code == 0
    assert Path("cam.toml").read_text(encoding="utf-8").startswith(f"#:schema ./{SCHEMA_FILE}\n# ")
    assert said("fmt", "--check", "cam.toml").exit_code == 0
    assert not Path("four-bar.toml").read_text(encoding="utf-8").startswith("#:")
    assert "must be .json" in said("schema", "-o", "schema.toml").stderr
