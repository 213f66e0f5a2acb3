"""The page of sources names files that exist and say so; that of other programs, names that exist."""

import re

import flyball as fb
from tests.pages import DOCS, ROOT


def test_files_name_their_sources():
    rows = [
        r.split("|")[1:4] for r in (DOCS / "sources.md").read_text(encoding="utf-8").splitlines() if r.count("|") == 4
    ]
    rows = [r for r in rows if "`" in r[2]]
    assert len(rows) >= 20
    for _, source, files in rows:
        text = "".join(
            (ROOT / "src" / "flyball" / f).read_text(encoding="utf-8") for f in re.findall(r"`([\w/.]+)`", files)
        )
        years = re.findall(r"(\w+),? (\d{4})", source)
        missing = [(author, year) for author, year in years if author not in text or year not in text]
        assert missing == [], files


def test_words_of_other_programs_lead_to_names_that_exist():
    text = (DOCS / "other_programs.md").read_text(encoding="utf-8")
    here = "".join(r.split("|")[2] for r in text.splitlines() if r.count("|") == 3)
    known = {"": dir(fb), "m.": dir(fb.Mechanism), "p.": dir(fb.Prepared)}
    named = re.findall(r"`(?:fb\.)?(m\.|p\.|)([A-Z]\w+|(?<=\.)\w+)", here)
    assert len(named) > 100
    assert [a + b for a, b in named if b not in known[a]] == []
