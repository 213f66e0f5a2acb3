"""The page of sources names files that exist, and authors that those files name."""

import re

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
