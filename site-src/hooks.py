"""Hooks of MkDocs: pages made from the package and the examples, and links to examples that lead into the gallery."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "src")]
import gallery
import reference

from flyball.cli.view import SCHEMA_FILE
from flyball.mechanism import Mechanism
from flyball.model.json_schema import model_schema

SCHEMA = json.dumps(model_schema(Mechanism), indent=1)  # made before examples define elements of their own


def on_files(files: Files, config: Any) -> Files:
    """Add the generated pages and the schema of model files."""
    for path, text in (reference.pages() | gallery.pages()).items():
        files.append(File.generated(config, path, content=text))
    files.append(File.generated(config, SCHEMA_FILE, content=SCHEMA))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Lead links to examples into the gallery, whose pages show their source."""
    up = "../" * page.file.src_uri.count("/")
    markdown = re.sub(r"\[([^]]+)\]\((?:\.\./)+examples/\w+\.(?:urdf|xml)\)", r"\1", markdown)  # no page of the gallery
    return re.sub(r"\]\((?:\.\./)+examples/(\w+)\.\w+\)", rf"]({up}gallery/\1.md)", markdown)


def on_page_content(html: str, **_: Any) -> str:
    """Leave out the dash before a description that is not there."""
    return re.sub(r"\s*–\s*(?=</li>|<div class=\"doc-md-description\">\s*</div>)", "", html)
