"""veraPDF is asked the right thing: it passes what conforms, and tells what does not."""

from __future__ import annotations

from pathlib import Path

import pytest
import typst

from .verapdf import faults_of_pdfa

pytestmark = pytest.mark.slow


def test_what_conforms_passes_and_what_does_not_is_told(tmp_path: Path) -> None:
    whole, plain, torn = (tmp_path / name for name in ("whole.pdf", "plain.pdf", "torn.pdf"))
    (tmp_path / "page.typ").write_text(
        "#set document(date: datetime(year: 2026, month: 3, day: 9))\nForce over stroke", encoding="utf-8"
    )
    whole.write_bytes(_set(tmp_path / "page.typ", "a-3b"))
    plain.write_bytes(_set(tmp_path / "page.typ", "1.7"))
    torn.write_bytes(whole.read_bytes()[:1000])

    faults = faults_of_pdfa([whole, plain, torn], "3b", tmp_path)
    assert faults[whole] == ()
    assert any("6.6.4" in fault for fault in faults[plain]), faults[plain]
    assert [fault.split(":")[0] for fault in faults[torn]] == ["not read"]

    (fault,) = faults_of_pdfa([whole], "2b", tmp_path)[whole]
    assert "3 instead of 2" in fault


def _set(page: Path, standard: str) -> bytes:
    """Return a page as PDF."""
    pdf = typst.compile(str(page), format="pdf", pdf_standards=standard)
    assert isinstance(pdf, bytes)
    return pdf
