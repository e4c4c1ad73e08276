"""Which run is the conformity test: the option, the campaign, else the first that meets the conditions."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.cli.commands.recordings import evaluate, import_, report
from bufferstand.evaluation.across_runs.conformity.candidates import candidate_of, standing_of
from bufferstand.evaluation.across_runs.conformity.purposes import Candidate, decide_purposes
from bufferstand.evaluation.archive.cache import Cache
from bufferstand.evaluation.archive.evaluate import ArchiveEvaluation, evaluate_archive
from bufferstand.evaluation.archive.local_workers import LocalWorkers
from bufferstand.evaluation.archive.settings_and_software import EvaluationSettings, software
from bufferstand.evaluation.archive.tables import document, runs_frame
from bufferstand.evaluation.document.build import assemble, run_entry
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.report.sections.reevaluation import changes_of
from bufferstand.evaluation.report.source.reading import Given, read_source
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.finding import cache_file as cachefile
from bufferstand.recording.foreign.importing import import_file
from tests.evaluation.signals import STARTED, StaticTest, later

BASE = Candidate(
    id="a", path="c/a.h5", kind="static", specimen="B1", campaign="c", started="2026-01-12T08:00:00+00:00",
    step_kind="static", stated=None, standing="met", verdict="pass",
)  # fmt: skip


def run(name: str, **facts: Any) -> Candidate:
    return replace(BASE, **({"id": name, "path": f"c/{name}.h5"} | facts))


def conformity_of(candidates: Sequence[Candidate], chosen: Sequence[str] = ()) -> list[str]:
    decided = decide_purposes(candidates, chosen)
    return [c.id for c, p in zip(candidates, decided.purposes, strict=True) if p.purpose == "conformity"]


def test_the_first_that_meets_the_conditions() -> None:
    warm = run("warm", standing="broken", verdict="invalid", started="2026-01-12T07:00:00+00:00")
    assert conformity_of(
        [warm, run("proper"), run("harmonic", kind="harmonic", standing=None, verdict=None)]
    ) == ["proper"]
    (statement,) = decide_purposes([warm, run("proper")]).statements
    assert (statement.runs, statement.characterisation) == (("proper",), ("warm",))
    assert (statement.by, statement.verdict, statement.warnings) == ("default", "pass", ())
    assert statement.why == "the first static run that meets the conditions"


def test_first_is_first_in_time_not_in_the_list() -> None:
    late, early = run("late", started="2026-01-13T08:00:00+00:00"), run("early")
    decided = decide_purposes([late, early])
    assert [p.purpose for p in decided.purposes] == ["characterisation", "conformity"]
    (warning,) = decided.statements[0].warnings
    assert warning.startswith(
        "2 static runs meet the conditions of the test: early, late; the first is taken"
    )
    assert "--conformity RUN" in warning
    failed = decide_purposes([replace(late, verdict="fail"), early])
    assert "their verdicts differ: pass, fail" in failed.statements[0].warnings[0]


def test_where_none_is_shown_to_meet_them() -> None:
    short, broken = (
        run("short", standing="open", verdict="inconclusive"),
        run("x", standing="broken", verdict="invalid"),
    )
    assert conformity_of([broken, short]) == ["short"]
    assert conformity_of([broken, replace(broken, id="y", path="c/y.h5")]) == ["x"]
    assert (
        "no static run keeps the conditions"
        in decide_purposes([broken, replace(broken, id="y", path="c/y.h5")]).statements[0].warnings[0]
    )


def test_the_campaign_s_word_and_the_option_s() -> None:
    first, meant = run("first"), run("meant", stated="conformity", standing="open", verdict="inconclusive")
    assert conformity_of([first, meant]) == ["meant"]
    assert decide_purposes([first, meant]).statements[0].by == "campaign"
    assert conformity_of([first, meant], ["first"]) == ["first"]
    assert conformity_of([first, meant], ["c/first.h5"]) == ["first"]
    assert conformity_of([run("no", stated="characterisation"), first]) == ["first"]
    against = decide_purposes([run("no", stated="characterisation"), first], ["no"])
    assert against.statements[0].runs == ("no",)
    assert "no is characterisation by its campaign" in against.statements[0].warnings[0]
    both = decide_purposes([replace(first, stated="conformity"), meant])
    assert both.statements[0].runs == ("first", "meant")
    assert both.statements[0].verdict == "inconclusive"
    assert (
        "2 runs are said to be the conformity test, and all of them count" in both.statements[0].warnings[0]
    )
    assert conformity_of([run("no", stated="characterisation")]) == []


def test_what_is_no_test_and_what_stands_apart() -> None:
    assert conformity_of([run("hold", step_kind="hold"), run("a")]) == ["a"]
    assert conformity_of([run("hold", step_kind="hold")]) == []
    assert conformity_of([run("a"), run("b", specimen="B2")]) == ["a", "b"]
    assert conformity_of([run("a"), run("b", campaign="d")]) == ["a", "b"]
    assert conformity_of([run("a"), run("b", path="elsewhere/b.h5")]) == ["a", "b"]
    assert conformity_of([run("a", specimen=None), run("b", specimen=None)]) == ["a", "b"]
    assert conformity_of([run("a"), run("p", kind="proof"), run("q", kind="proof")]) == ["a", "p", "q"]


@pytest.mark.parametrize(
    ("chosen", "message"),
    [
        ("z", "no run “z” is evaluated here; name one that is judged: a, b, b"),
        ("b", "2 runs have the id “b”; name the file: c/b.h5, d/b.h5"),
        ("h", "nothing is required of run “h”"),
    ],
)
def test_a_name_that_cannot_be_meant_is_refused(chosen: str, message: str) -> None:
    runs = [run("a"), run("b"), run("b", path="d/b.h5"), run("h", kind="harmonic", standing=None)]
    with pytest.raises(BadInput, match=f"--conformity: {message}"):
        decide_purposes(runs, [chosen])


@given(
    st.lists(
        st.builds(
            run,
            st.text("abc", min_size=1, max_size=3),
            specimen=st.sampled_from(["B1", "B2", None]),
            standing=st.sampled_from(["met", "open", "broken", None]),
            stated=st.sampled_from([None, None, "conformity", "characterisation"]),
            step_kind=st.sampled_from(["static", "hold", None]),
            kind=st.sampled_from(["static", "proof"]),
        ),
        max_size=8,
        unique_by=lambda one: one.id,
    )
)
def test_every_judged_run_has_one_purpose_and_a_reason(runs: list[Candidate]) -> None:
    decided = decide_purposes(runs)
    for one, purpose in zip(runs, decided.purposes, strict=True):
        assert (purpose.purpose is None) == (one.standing is None)
        assert purpose.why
        if one.stated == "characterisation":
            assert purpose.purpose != "conformity"
    said = [name for s in decided.statements for name in (*s.runs, *s.characterisation)]
    assert sorted(said) == sorted(one.id for one in runs if one.standing is not None)
    for statement in decided.statements:
        if statement.kind == "static" and statement.by == "default":
            assert len(statement.runs) <= 1


def test_standing_of_rows() -> None:
    assert standing_of([]) is None
    assert standing_of([(True, "pass"), (False, "fail")]) == "met"
    assert standing_of([(True, "pass"), (True, "inconclusive")]) == "open"
    assert standing_of([(True, "fail"), (True, "inconclusive")]) == "broken"


PROPER = StaticTest(rate_Hz=50.0)
WARM = replace(PROPER, cycles=1, temperature_C=45.0, started=later(200.0))


def test_the_document_says_it_of_each_run() -> None:
    runs = [
        replace(t.evaluate(draws=0), facts=replace(t.facts(), id=name))
        for t, name in ((PROPER, "p"), (WARM, "w"))
    ]
    assert candidate_of(runs[1]).standing == "broken"
    document = assemble([(run_entry(one), one) for one in runs])
    assert [entry["purpose"] for entry in document["runs"]] == ["conformity", "characterisation"]
    assert document["runs"][1]["purpose_why"].startswith(
        "the conformity test is p: the first static run that meets"
    )
    assert document["conformity"][0]["verdict"] == "pass"


def record(folder: Path, name: str, test: StaticTest, purpose: str = "") -> None:
    """Write a record of a test and what belongs to it, to be imported."""
    time, stroke, force = test.columns()
    rows = zip(time, stroke, force, strict=True)
    lines = [f"{t:.3f},{x:.4f},{f:.4f},{test.temperature_C}" for t, x, f in rows]
    (folder / f"{name}.csv").write_text(
        "time [s],stroke [mm],force [kN],temperature [°C]\n" + "\n".join(lines)
    )
    started = (test.started or STARTED).isoformat()
    (folder / f"{name}.toml").write_text(
        '[specimen]\nid = "B1"\nkind = "buffer"\ncategory = "A"\nmax_stroke_mm = 105.0\n'
        'elastic_system = "elastomer"\nassembled = 2026-01-05T08:00:00Z\n'
        f'[test]\nkind = "static"\nstarted = {started}\n{purpose}'
    )


def test_the_settings_say_which_run_was_named_and_the_cache_does_not_hang_on_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By id or by path the same settings and hash; figures come from the cache; the report says it, too."""
    monkeypatch.setattr(cachefile, "SETTLED_S", 0.0)
    record(tmp_path, "proper", PROPER)
    record(tmp_path, "warm", replace(WARM, preload_kN=5.0))
    runs = tmp_path / "runs"
    for name in ("proper", "warm"):
        import_file(tmp_path / f"{name}.csv", runs)
    files = sorted(runs.rglob("*.h5"))
    settings = EvaluationSettings(Options(draws=0))

    def evaluated(*named: str) -> ArchiveEvaluation:
        cache = Cache(tmp_path / "cache", settings.sha256, software().sha256)
        found = evaluate_archive(files, settings, LocalWorkers(1), cache, conformity=named)
        cache.close()
        return found

    plain = evaluated()
    warm = next(path for path in files if "warm" in path.name)
    by_id, by_path = evaluated("warm"), evaluated(str(warm))
    assert (plain.reused, by_id.reused, by_path.reused) == (0, 2, 2)
    assert plain.settings_entry["sha256"] == settings.sha256
    assert "conformity" not in plain.settings_entry
    assert by_id.settings_entry == by_path.settings_entry
    assert by_id.settings_entry["conformity"] == ["warm"]
    assert by_id.settings_entry["sha256"] != settings.sha256
    assert set(runs_frame(by_id)["settings_sha256"]) == {by_id.settings_entry["sha256"]}

    earlier = document(plain)
    given = Given(options=settings.options, conformity=("warm",), earlier=earlier)
    for source in (read_source(runs, None, given), read_source(runs, earlier, given)):
        assert source.document["settings"] == by_id.settings_entry
        changes = changes_of(source)
        assert changes is not None
        assert changes.changed == {"conformity": (None, ["warm"])}


@pytest.mark.slow
def test_a_warm_single_stroke_leaves_the_statement_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the commands: document, table in the terminal, --strict, and the report's words."""
    record(tmp_path, "proper", PROPER)
    record(tmp_path, "warm", replace(WARM, preload_kN=5.0))
    runner, runs = CliRunner(), tmp_path / "runs"
    files = [str(tmp_path / f"{name}.csv") for name in ("proper", "warm")]
    done = runner.invoke(import_.command, [*files, "--out", str(runs)], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    words = [str(runs), "--draws", "0", "--jobs", "1", "--no-cache"]
    out = runner.invoke(evaluate.command, [*words, "--strict"], catch_exceptions=False, standalone_mode=False)
    assert out.return_value == 0
    assert (
        "conformity test of B1 (static): proper: pass (the first static run that meets the conditions)"
        in out.output
    )
    assert "(invalid)" in out.output
    chosen = runner.invoke(
        evaluate.command,
        [*words, "--conformity", "warm", "--json", "-"],
        catch_exceptions=False,
        standalone_mode=False,
    )
    document = json.loads(chosen.stdout)
    assert {e["run"]["id"]: e["purpose"] for e in document["runs"]} == {
        "proper": "characterisation",
        "warm": "conformity",
    }
    assert document["conformity"][0]["by"] == "option"

    monkeypatch.setattr("bufferstand.evaluation.report.writing.pdf_available", lambda: False)
    runner.invoke(report.command, [str(runs), "--out", str(tmp_path)], catch_exceptions=False)
    html = re.sub(r'<span class="kept">(.*?)</span>', r"\1", (tmp_path / "runs-report.html").read_text())
    statement = html[html.index('id="conformity"') : html.index('<section id="runs"')]
    assert "run 1, the first static run that meets the conditions." in statement
    assert "Characterisation, and no part of this statement: run 2." in statement
    assert "✓ met" in statement
    assert "Statement (draft)" in statement
    assert "conditions broken" not in statement
    assert "45" not in statement
    with pytest.raises(BadInput, match="no run “nobody” is in this report"):
        runner.invoke(
            report.command,
            [str(runs), "--out", str(tmp_path), "--conformity", "nobody"],
            catch_exceptions=False,
        )
