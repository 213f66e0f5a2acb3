"""The layout of model files: it changes neither the model nor its comments, and a second time it changes nothing."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

import flyball as fb
from flyball.cli.view import model_files
from flyball.model.model_files import dumps, load
from flyball.model.model_layout import formatted
from tests.errors.test_every_field import CASES as EVERY_FIELD
from tests.pages import ROOT

FILES = {p.stem: p for p in (*(ROOT / "examples").glob("*.toml"), *model_files().values())}
TEXTS = {name: path.read_text(encoding="utf-8") for name, path in FILES.items()}
names = st.sampled_from(sorted(FILES))


def comments(text: str) -> list[str]:
    """Comments of a model file of these tests, in whose strings there is no number sign but in colours."""
    return sorted(re.findall(r'#(?![0-9a-f]{6}").*', text))


def tables(text: str) -> list[str]:
    """The text before the first header, and each table with the comments right above it."""
    return re.split(r"\n\n(?=(?:#.*\n)*\[)", text.rstrip("\n"))


def category(table: str) -> str:
    header = re.search(r"^\[+(\w+)", table, re.M)
    return header[1] if header else ""


@pytest.mark.parametrize("name", sorted(FILES))
def test_files_of_new_and_the_examples_have_the_layout(name):
    assert formatted(TEXTS[name]) == TEXTS[name]


@settings(max_examples=60, deadline=None)
@given(names, st.data())
def test_another_layout_of_a_file_is_brought_back(name, data):
    """Tables in another order, values without spaces, indented lines, more empty lines: one text remains."""
    first, *rest = tables(TEXTS[name])
    mixed = data.draw(st.permutations(rest))
    for kind in {category(t) for t in rest}:  # the order within a category is that of the model
        of_kind = iter([t for t in rest if category(t) == kind])
        mixed = [next(of_kind) if category(t) == kind else t for t in mixed]
    spaces = data.draw(st.sampled_from(["", " ", "   "]))
    changed = "\n\n\n".join([first, *mixed]) + "\n\n"
    changed = re.sub(
        r"^(\w+) = ([^#\n\"]*|\"[^\"#\n]*\")$", rf"{spaces}\1{spaces}={spaces}\2{spaces}", changed, flags=re.M
    )
    changed = changed.replace("{type = ", "{ type=").replace("},\n]", "} ,\n ]")
    assert tomllib.loads(changed) == tomllib.loads(TEXTS[name])
    assert formatted(changed) == TEXTS[name]


@settings(max_examples=60, deadline=None)
@given(names, st.data())
def test_comments_anywhere_are_kept(name, data):
    lines = TEXTS[name].split("\n")
    for k in range(6):
        at = data.draw(st.integers(0, len(lines) - 1))
        kind = data.draw(st.sampled_from(["line", "end", "blank"]))
        if kind == "end":
            lines[at] += " " * data.draw(st.integers(1, 4)) + f"# {k} [[x]] = \"'"
        else:
            lines[at:at] = [" " * k + f"# {k} {{"] if kind == "line" else ["", ""]
    text = "\n".join(lines)
    out = formatted(text)
    assert tomllib.loads(out) == tomllib.loads(text)
    assert comments(out) == comments(text)
    assert formatted(out) == out


plain = st.one_of(st.booleans(), st.integers(-(10**6), 10**6), st.floats(allow_nan=False), st.text(max_size=20))
values = st.recursive(
    plain,
    lambda x: st.one_of(st.lists(x, max_size=4), st.dictionaries(st.text(max_size=5), x, max_size=3)),
    max_leaves=8,
)


@settings(max_examples=150, deadline=None)
@given(st.dictionaries(st.text(max_size=8), values, max_size=6), st.booleans())
def test_any_toml_keeps_its_data(data, multiline):
    text = tomli_w.dumps(data, multiline_strings=multiline)
    out = formatted(text)
    assert tomllib.loads(out) == tomllib.loads(text)
    assert formatted(out) == out


@pytest.mark.parametrize("name", ["governor", "toggle_press", "geneva_drive", "robot-arm"])
def test_the_loaded_model_is_the_same(name, tmp_path: Path):
    changed = TEXTS[name].replace(" = ", "=").replace("{type", "{  type")
    assert changed != TEXTS[name]
    path = tmp_path / "m.toml"
    path.write_text(formatted(changed), encoding="utf-8")
    assert load(path, fb.Mechanism) == load(FILES[name], fb.Mechanism)


@pytest.mark.parametrize("case", EVERY_FIELD)
def test_saved_mechanisms_have_the_layout(case):
    made, *args = EVERY_FIELD[case]
    for m in {id(m): m for m, _ in made(*args)}.values():
        assert formatted(dumps(m)) == dumps(m)


UNTIDY = """\
#:schema ./flyball.schema.json
# A cart.

planar=true
name  = "cart" # its name
[[joints]]
at=[0,0]     # of the rail
axis = [ 1 , 0 , ]   # along the track,
                     # to the right
name="rail"
type='Translational'
body_i="ground"
body_j="cart"

# ---- Bodies ----

# The cart itself.
[[bodies]]
name = "cart"


mass = "1_000 g"
  # of a plate
inertia = 1e-2
shape = [ { type = "Box", edges = [1, 1, 1], position = ["0 m", 0, 0], looks = true }, { type = "Box", edges = [2, 1, 1] } ]
com = [
  0, # x
     0,
]
# end of bodies

[parameters]
k = 1
"""

TIDY = """\
#:schema ./flyball.schema.json
# A cart.

name = "cart"  # its name
planar = true

[parameters]
k = 1

# ---- Bodies ----

# The cart itself.
[[bodies]]
name = "cart"

mass = "1_000 g"
# of a plate
inertia = 1e-2
shape = [
    {type = "Box", edges = [1, 1, 1], position = ["0 m", 0, 0], looks = true},
    {type = "Box", edges = [2, 1, 1]},
]
com = [
    0,  # x
    0,
]
# end of bodies

[[joints]]
type = 'Translational'
name = "rail"
at = [0, 0]  # of the rail
axis = [1, 0]        # along the track,
                     # to the right
body_i = "ground"
body_j = "cart"
"""


def test_an_untidy_file():
    assert formatted(UNTIDY) == TIDY
    assert formatted(UNTIDY.replace("\n", "\r\n")) == TIDY


def test_comments_in_a_column_move_together():
    text = 'name="a long name" # one\nplanar=true        # two\n'
    assert formatted(text) == 'name = "a long name"  # one\nplanar = true         # two\n'


def test_what_is_no_toml_is_refused_by_line():
    with pytest.raises(fb.ModelError, match=r"m\.toml, line 3"):
        formatted('name = "a"\n[[bodies]]\nmass = \n', "m.toml")
