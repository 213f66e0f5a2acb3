"""The documentation site builds strictly, has every public name and example, and asks nothing of a network."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from html.parser import HTMLParser
from pathlib import Path

import pytest

import flyball as fb
from flyball.cli.view import SCHEMA_FILE
from flyball.model.element import Element
from flyball.model.json_schema import DIALECT
from tests.pages import ROOT

pytest.importorskip("material", reason="the site needs MkDocs Material: pip install 'flyball[docs]'")
pytest.importorskip("mkdocstrings", reason="the site needs mkdocstrings: pip install 'flyball[docs]'")


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(out)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return out


def test_every_public_name_is_in_the_reference(site):
    text = "".join(p.read_text(encoding="utf-8") for p in (site / "reference").glob("*.html"))
    assert [name for name in dir(fb) if f'id="flyball.{name}"' not in text] == []


def test_the_reference_tells_arguments_and_units(site):
    joints = (site / "reference" / "joints.html").read_text(encoding="utf-8")
    words = re.sub(r"<[^>]+>", "", joints)
    assert re.search(r"Revolute\(\s*name,\s*body_i,\s*body_j", words)
    assert "[rad]" in words
    assert "[m/rev]" in words or "[m]" in words


def test_every_analysis_is_in_the_reference(site):
    text = (site / "reference" / "analyses.html").read_text(encoding="utf-8")
    for name in ("simulate", "equilibrium", "study", "mobility", "export"):
        assert re.search(rf'id="flyball\.mechanism_methods\.\w+\.{name}"', text)


def test_every_example_is_in_the_gallery(site):
    overview = (site / "gallery" / "index.html").read_text(encoding="utf-8")
    for example in (p for p in (ROOT / "examples").iterdir() if p.suffix in (".toml", ".py", ".ipynb")):
        assert f'href="{example.stem}.html"' in overview
        assert f"examples/{example.name}" in (site / "gallery" / f"{example.stem}.html").read_text(encoding="utf-8")


def test_the_site_has_the_schema_of_model_files(site):
    published = json.loads((site / SCHEMA_FILE).read_text(encoding="utf-8"))
    assert published["$schema"] == DIALECT
    elements = {n for n in dir(fb) if isinstance(getattr(fb, n), type) and issubclass(getattr(fb, n), Element)}
    assert elements <= set(published["$defs"])
    assert "Air" not in published["$defs"]  # an element of an example's own


class Fetched(HTMLParser):
    """What a page fetches by itself: addresses in script, link, img, iframe and the like."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []

    def handle_starttag(self, tag, attrs):
        if tag != "a":
            self.addresses += [v for k, v in attrs if k in ("src", "href", "srcset", "data") and v]


def test_no_page_fetches_from_another_host(site):
    for path in site.rglob("*.html"):
        parser = Fetched()
        parser.feed(path.read_text(encoding="utf-8"))
        assert [a for a in parser.addresses if re.match(r"(https?:)?//", a)] == [], path.name
    for path in site.rglob("*.css"):
        assert not re.search(r"url\(\s*['\"]?(https?:)?//", path.read_text(encoding="utf-8")), path.name


CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_pages_and_search_work_from_a_file(site):
    """Opened as a file: nothing else is asked for, the search finds, no page is wider than a phone."""
    with ThreadPoolExecutor(1) as apart:  # another test of the same process may have a browser open
        apart.submit(look_at_pages, site).result()


def look_at_pages(site):
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as p:
        browser = p.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 390, "height": 800})
        asked: list[str] = []
        page.on("request", lambda r: asked.append(r.url))
        for name in ("index", "contact", "reference/joints", "gallery/index", "other_programs"):
            page.goto((site / f"{name}.html").as_uri())
            assert page.evaluate("document.documentElement.scrollWidth") <= 390, name
        page.set_viewport_size({"width": 1280, "height": 800})
        page.locator("input.md-search__input").fill("Geneva")
        page.locator(".md-search-result__item").first.wait_for(timeout=10_000)
        assert "gallery" in page.locator(".md-search-result__item a").first.get_attribute("href")
        browser.close()
    assert [url for url in asked if not url.startswith(("file:", "data:", "blob:"))] == []
