"""``report`` is judged by the same options as ``evaluate``: limit set, inspection, decision rule, mass."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from bufferstand.cli.commands.recordings import evaluate, report
from bufferstand.evaluation.requirements.limit_set import SHIPPED, load_limit_set
from bufferstand.foundation.errors import BadInput

RUN = Path(__file__).resolve().parents[2] / "sample_runs" / "runs" / "001-static-5mm_s.h5"
INSPECTION = """
[inspection]
specimen = "{specimen}"
inspector = "A. Inspector"
date = 2026-03-01
[[item]]
id = "cracks"
result = "in-order"
note = "seen with a lamp"
"""


def write_set(folder: Path) -> Path:
    """Write a limit set of a laboratory: another standard, a window whose id does not say where it stands."""
    text = SHIPPED.read_text()
    text = text.replace('id = "en15551-105mm"', 'id = "lab-7"').replace('"EN 15551"', '"LAB 7"')
    text = text.replace('id = "force-at-60mm"', 'id = "middle-force"').replace(
        'edition = ""', 'edition = "2026-07"'
    )
    text = text.replace("stroke_mm = 60.0", "stroke_mm = 61.5")
    text = re.sub(r'\nsource = "paper .*, Table 3"', '\nclause = "Annex Q"', text)
    text = text.replace("date = 2026", 'clause = "Annex P"\ndate = 2026')
    text += '\n[[inspection]]\nid = "cracks"\ntext = "no cracks in the housing"\n'
    file = folder / "lab.toml"
    file.write_text(text)
    return file


def run_report(folder: Path, monkeypatch: pytest.MonkeyPatch, *words: str | Path) -> tuple[Result, str]:
    monkeypatch.setattr("bufferstand.evaluation.report.writing.pdf_available", lambda: False)
    done = CliRunner().invoke(
        report.command, [str(RUN), "--out", str(folder), *map(str, words)], catch_exceptions=False
    )
    html = folder / f"{RUN.stem}-report.html"
    return done, html.read_text() if html.exists() else ""


def test_the_report_is_judged_by_the_given_set_and_states_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = write_set(tmp_path)
    inspection = tmp_path / "inspection.toml"
    inspection.write_text(INSPECTION.format(specimen="A-105-E-01"))
    words = (
        *("--limits", file, "--inspection", inspection),
        *("--decision-rule", "guard-band", "--moving-mass", "90"),
    )
    done, html = run_report(tmp_path, monkeypatch, *words)
    assert done.exit_code == 0, done.output
    limits = load_limit_set(file)
    for text in (limits.id, limits.standard, limits.edition, limits.clause, limits.source, limits.sha256):
        assert text in html
    assert "2026-01-15" in html
    assert "EN 15551, " not in html
    assert "not on record" not in html
    assert "A draft states nothing yet" not in html
    assert "permitted ranges of LAB 7, Annex Q" in html
    assert "At 61.5 mm: pass." in html, "the position is the set's, the id says nothing of it"
    assert "Guard band (ILAC-G8:09/2019, w = U)" in html
    assert "90 kg" in html
    for text in ("A. Inspector", "no cracks in the housing", "✓ in order", "seen with a lamp"):
        assert text in html


def test_by_a_set_without_edition_and_clauses_the_statement_is_a_draft(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done, html = run_report(tmp_path, monkeypatch)
    assert done.exit_code == 0, done.output
    text = re.sub(r"<[^>]+>", "", html)
    assert "A draft states nothing yet: what it lacks is on the first page." in text
    assert "Missing, to be given in report.toml beside the runs: " in re.sub(r"\s+", " ", text)
    assert "Missing in the limit set, to be stated in one of the laboratory’s own (--limits; " in text
    assert "edition of EN 15551 and the clauses of EN 15551 for what it requires\n" in text
    assert (
        "clause not on record (source: paper “Stiffness characteristics of railway buffers”, Table 3)" in text
    )
    assert "✓ met" in text
    assert "Statement (draft)" in text
    assert not re.search(r"EN 15551, (Table|section|equation)", text)


def test_an_inspection_of_another_specimen_is_said_to_be_unused(tmp_path: Path) -> None:
    inspection = tmp_path / "inspection.toml"
    inspection.write_text(INSPECTION.format(specimen="some-other"))
    words = [str(RUN), "--limits", str(write_set(tmp_path)), "--inspection", str(inspection)]
    done = CliRunner().invoke(evaluate.command, words, catch_exceptions=False)
    assert "specimen “some-other”; no run here is of it: it was not used" in done.stderr


def test_both_commands_have_the_same_options_of_judging() -> None:
    wanted = {"decision_rule", "limits", "inspections", "moving_mass"}
    both = [{p.name: p for p in c.params if p.name in wanted} for c in (evaluate.command, report.command)]
    assert [set(one) for one in both] == [wanted, wanted]
    for name in wanted:
        assert both[0][name].to_info_dict() == both[1][name].to_info_dict()


def test_a_mass_that_is_none_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(BadInput, match=re.escape("--moving-mass")):
        run_report(tmp_path, monkeypatch, "--moving-mass", "-1")
