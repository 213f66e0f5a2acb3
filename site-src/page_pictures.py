"""Run the tutorials and systems and keep the pictures that they write: python site-src/page_pictures.py [NAME ...]."""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))
os.environ["MPLBACKEND"] = "agg"
from tests.pages import run_page

FOLDERS = ("tutorials", "systems")
WIDTH, COLORS = 1000, 48  # [px]; a palette of so many colours makes files small


def main(names: list[str]) -> None:
    """Run the pages of these names, all if there is none."""
    for path in sorted(p for folder in FOLDERS for p in (ROOT / "docs" / folder).glob("*.md")):
        if names and path.stem not in names:
            continue
        with tempfile.TemporaryDirectory() as folder:
            run_page(path, Path(folder))
            for picture in Path(folder).glob("*.png"):
                image = Image.open(picture).convert("RGB")
                scale = min(1.0, WIDTH / image.width)
                image = image.resize((round(image.width * scale), round(image.height * scale)))
                image.quantize(COLORS, kmeans=2).save(path.parent / "images" / picture.name, optimize=True)


if __name__ == "__main__":
    main(sys.argv[1:])
