"""Every snippet of README and docs runs as it stands, in order, and prints and writes what the page says."""

from __future__ import annotations

import re
import warnings

import pytest

from flyball.model.element import Element
from tests.pages import DOCS, PAGES, ROOT, run_page, snippets

RUN = [p for p in PAGES if any(s.language in ("python", "sh", "toml") for s in snippets(p))]
NEEDS = {  # pages whose snippets need a package that flyball does not
    "linear.md": ("sympy", "control"),
    "symbolic.md": ("sympy",),
    "explicit.md": ("sympy",),
    "README.md": ("sympy",),
}
WRITTEN = re.compile(r'"([\w./-]+\.(?:png|svg|html|nc|csv|glb))"')


def test_the_snippets_are_found():
    assert len(RUN) >= 20
    assert sum(len(snippets(p)) for p in RUN) >= 80


@pytest.mark.parametrize("path", RUN, ids=lambda p: str(p.relative_to(ROOT)))
def test_page(path, tmp_path, monkeypatch):
    for package in NEEDS.get(path.name, ()):
        pytest.importorskip(package)
    monkeypatch.setenv("MPLBACKEND", "agg")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, modules in list(Element.modules.items()):  # classes of other tests' snippets with the same names
            own = {x for x in modules if x.startswith("flyball.")}
            if not own and modules & {"__main__", "<run_path>"}:
                Element.modules.pop(name)
                Element.registry.pop(name, None)
        assert run_page(path, tmp_path) >= 1
    python = re.sub(r"#.*", "", "".join(s.text for s in snippets(path) if s.language == "python"))
    if path.parent in (DOCS / "tutorials", DOCS / "systems"):  # site-src/page_pictures.py copies them
        shown = re.findall(r"!\[[^\]]+\]\(images/([\w.]+)\)", path.read_text(encoding="utf-8"))
        assert set(shown) <= {p.name for p in tmp_path.iterdir()}
        assert shown or path.name == "index.md"
    assert [name for name in WRITTEN.findall(python) if not (tmp_path / name).exists()] == []
