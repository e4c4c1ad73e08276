"""Pages of reports as small grey pictures, and how far two pictures of a page are from each other.

    python -m tests.evaluation_report.layout --renew     # after a change of the layout that is meant

renews the references in ``tests/evaluation_report/layout/``; look at them before they are committed.
"""

from __future__ import annotations

import argparse
import io
import tempfile
from pathlib import Path

import numpy as np
import pypdfium2
from numpy.typing import NDArray
from PIL import Image

from bufferstand.evaluation.figures.paint import draw
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.comparison import build_comparison
from bufferstand.evaluation.report.content.content import Content
from bufferstand.evaluation.report.rendering.pdf import render_pdf
from bufferstand.evaluation.report.source.fields import ReportFields
from bufferstand.evaluation.report.source.reading import Given, read_source
from bufferstand.evaluation.report.source.specimens import side_by_side
from tests.evaluation_report.make_runs import PAPER_LIKE, hand_made_document, write_campaign

Grey = NDArray[np.float64]

FOLDER = Path(__file__).parent / "layout"
DOTS_PER_INCH = 36.0
LEVELS = 16
"""Grey levels of the references: enough to see a line of text, and small files."""
CELL_MM = 4.0
"""Greys are compared as means over cells of this size: letters vanish in it, a line of text does not."""
TOLERANCE = 16.0
"""Largest permitted difference of a cell's mean grey (of 255).

Other letter rendering makes up to 13, a block moved by 4 mm 19 and more."""
RUNS = (PAPER_LIKE[0], PAPER_LIKE[2], PAPER_LIKE[3])
MODEL = Path(__file__).parents[2] / "sample_runs" / "models" / "category-a-elastomer.toml"
FIELDS = ReportFields(laboratory="Test hall 2", customer="Wagon works", method="EN 15551:2022")


def contents(folder: Path) -> dict[str, Content]:
    """Return the reports whose layout is watched: a campaign with a model, and a comparison."""
    document = hand_made_document(RUNS)
    one = write_campaign(folder / "first", RUNS, rate_Hz=100.0)
    two = write_campaign(folder / "second", RUNS, rate_Hz=100.0, specimen="KX-0816")
    given = Given(fields=FIELDS, model=MODEL)
    sources = [read_source(path, document) for path in (one, two)]
    return {
        "campaign": build_content(read_source(one, document, given)),
        "comparison": build_comparison(side_by_side(sources, FIELDS)),
    }


def pages(content: Content) -> list[Grey]:
    """Return the pages of the PDF as grey values, shape (height, width), 255 is white."""
    pdf = render_pdf(content, [draw(picture.plot) for picture in content.pictures()])
    return rendered(pdf)


def rendered(pdf: bytes, finer: int = 4) -> list[Grey]:
    """Return the pages of a PDF, rendered so many times finer and averaged: hairlines keep their weight."""
    found = []
    for page in pypdfium2.PdfDocument(io.BytesIO(pdf)):
        fine = page.render(scale=finer * DOTS_PER_INCH / 72.0).to_pil().convert("L")
        grey = np.asarray(fine, dtype=np.float64)
        height, width = (size // finer for size in grey.shape)
        blocks = grey[: height * finer, : width * finer].reshape(height, finer, width, finer)
        found.append(blocks.mean(axis=(1, 3)))
    return found


def cells(page: Grey) -> Grey:
    """Return the mean greys of a page over cells, each blurred with its neighbours."""
    height, width = page.shape
    rows, columns = (round(size / CELL_MM) for size in (297.0, 210.0))
    down = np.linspace(0, height, rows + 1).round().astype(int)
    right = np.linspace(0, width, columns + 1).round().astype(int)
    sums = np.add.reduceat(np.add.reduceat(page, down[:-1], axis=0), right[:-1], axis=1)
    means = sums / (np.diff(down)[:, None] * np.diff(right)[None, :])
    padded = np.pad(means, 1, mode="edge")
    neighbours = [padded[i : i + rows, j : j + columns] for i in range(3) for j in range(3)]
    weights = [w * v for w in (1, 2, 1) for v in (1, 2, 1)]
    blurred: Grey = np.sum([w * n for w, n in zip(weights, neighbours, strict=True)], axis=0) / 16.0
    return blurred


def distance(one: Grey, two: Grey) -> float:
    """Return the largest difference of two pictures of a page, whatever their resolutions."""
    return float(np.max(np.abs(cells(one) - cells(two))))


def references(name: str) -> list[Grey]:
    """Return the reference pictures of a report, in the order of its pages."""
    files = sorted(FOLDER.glob(f"{name}-*.png"))
    return [np.asarray(Image.open(file).convert("L"), dtype=np.float64) for file in files]


def renew() -> None:
    """Write the reference pictures anew."""
    FOLDER.mkdir(exist_ok=True)
    for old in FOLDER.glob("*.png"):
        old.unlink()
    with tempfile.TemporaryDirectory() as folder:
        for name, content in contents(Path(folder)).items():
            for number, page in enumerate(pages(content), start=1):
                step = 255.0 / (LEVELS - 1)
                coarse = (np.round(page / step) * step).astype(np.uint8)
                Image.fromarray(coarse).quantize(LEVELS).save(
                    FOLDER / f"{name}-{number:02d}.png", optimize=True
                )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Pictures of the pages of reports.")
    parser.add_argument("--renew", action="store_true", required=True, help="write the references anew")
    parser.parse_args()
    renew()
