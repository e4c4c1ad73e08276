"""From recorded runs to report files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from evaluation.figures.paint import draw
from evaluation.inertia import ForceCell
from evaluation.report.build import build_content
from evaluation.report.content import Content
from evaluation.report.html import render_html
from evaluation.report.pdf import render_pdf
from evaluation.report.reading import read_source
from evaluation.requirements.inspection import Inspection
from evaluation.requirements.limit_set import LimitSet
from evaluation.results import DecisionRule, Options
from foundation.errors import BadInput


def _html(content: Content, figures: Sequence[str]) -> bytes:
    return render_html(content, figures).encode()


_RENDERERS: Mapping[str, Callable[[Content, Sequence[str]], bytes]] = {"html": _html, "pdf": render_pdf}


def pdf_available() -> bool:
    """Say whether the typesetter of the PDF report is installed (extra ``pdf``)."""
    return find_spec("typst") is not None


def write_report(
    path: Path,
    out: Path,
    *,
    formats: Sequence[str] = ("html", "pdf"),
    document: Mapping[str, Any] | None = None,
    decision_rule: DecisionRule = "simple",
    limit_set: LimitSet | None = None,
    moving_mass_kg: float | None = None,
    moving_mass_accuracy_percent: float | None = None,
    force_cell: ForceCell | None = None,
    inspections: Sequence[Inspection] = (),
) -> list[Path]:
    """Write the test report of a run or a campaign.

    Parameters
    ----------
    path : Path
        A run file, or a campaign folder with its runs in ``runs/*.h5`` or ``*.h5``. A ``report.toml`` in the
        folder adds what only the laboratory knows.
    out : Path
        Folder for the report; made if it is not there. Files of the same name are replaced.
    formats : sequence of str
        ``html``, ``pdf`` or both.
    document : mapping, optional
        The evaluation document of these runs (contracts § 4); without one they are evaluated here.
    decision_rule : "simple" or "guard-band"
        How to judge where they are evaluated here; a document states its own.
    limit_set, moving_mass_kg, moving_mass_accuracy_percent, force_cell, inspections
        As of :func:`evaluation.document.evaluate_paths`, where they are evaluated here.

    Returns
    -------
    list of Path
        The files written, in the order of ``formats``. The same runs, document and ``report.toml`` give the
        same bytes.

    Raises
    ------
    BadInput
        If there are no runs, one cannot be used, a format is unknown, typst is missing for a PDF, or the
        folder cannot be written.
    """
    if unknown := [name for name in formats if name not in _RENDERERS]:
        raise BadInput(f"there is no report format “{unknown[0]}”", remedy=f"use {' or '.join(_RENDERERS)}")
    options = Options(
        decision_rule=decision_rule,
        moving_mass_kg=moving_mass_kg,
        moving_mass_accuracy_percent=moving_mass_accuracy_percent,
        force_cell=force_cell,
        inspections=tuple(inspections),
    )
    source = read_source(path, document, options, limit_set)
    content = build_content(source)
    figures = [draw(picture.plot) for picture in content.pictures()]
    # All are rendered before the first is written: a report is whole or not there.
    rendered = {name: _RENDERERS[name](content, figures) for name in formats}
    written = []
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name, data in rendered.items():
            target = out / f"{source.name}-report.{name}"
            unfinished = target.with_name(target.name + ".tmp")
            unfinished.write_bytes(data)
            unfinished.replace(target)
            written.append(target)
    except OSError as error:
        raise BadInput(
            f"the report cannot be written: {error.strerror}", file=out, remedy="choose another folder"
        ) from None
    return written
