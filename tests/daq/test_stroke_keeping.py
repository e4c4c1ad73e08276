"""What was learned within a step outlives the program: files, and a campaign whose step never ended."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from bufferstand.daq.campaign.stroke_settings import knowledge_in
from bufferstand.daq.strokes.knowledge import StrokeKnowledge
from bufferstand.daq.strokes.knowledge_file import NOW_NAME, StrokeKeeper, learned_in
from bufferstand.daq.strokes.stroke_rows import STROKES_NAME, add_strokes
from bufferstand.protocols.prediction.machine_stroke import Sine
from tests.daq.stroke_bench import run
from tests.daq.stroke_study import sine
from tests.daq.test_stroke_learning import LinearStand


def test_it_is_written_at_most_once_a_second_and_only_where_something_was_learned(tmp_path: Path) -> None:
    now_s, known, stand = 0.0, StrokeKnowledge(1.0 / 150.0), LinearStand()
    keeper = StrokeKeeper(tmp_path, known, lambda: now_s)
    keeper.keep()
    assert learned_in(tmp_path) is None
    kept = []
    for now_s in (10.0, 10.5, 11.1):  # noqa: B007 - it is the clock
        known.take(stand.cycle(Sine(50.0, 20.0), 1.0), None)
        keeper.keep()
        learned = learned_in(tmp_path)
        assert learned is not None
        kept.append(learned["cycles"])
    assert kept == [1, 1, 3]
    add_strokes(tmp_path, 1, "step", [], known.as_dict())
    keeper.end()
    assert not (tmp_path / NOW_NAME).exists()
    assert learned_in(tmp_path) == json.loads(json.dumps(known.as_dict()))


def test_the_newer_of_both_files_counts_and_one_that_is_cut_off_does_not(tmp_path: Path) -> None:
    known, stand = StrokeKnowledge(1.0 / 150.0), LinearStand()
    known.take(stand.cycle(Sine(50.0, 20.0), 1.0), None)
    keeper = StrokeKeeper(tmp_path, known)
    add_strokes(tmp_path, 1, "step", [], known.as_dict())
    known.take(stand.cycle(Sine(50.0, 20.0), 1.0), None)
    keeper.keep()
    learned = learned_in(tmp_path)
    assert learned is not None
    assert learned["cycles"] == 2
    (tmp_path / NOW_NAME).write_text('{"cycles": 9, "sums"')
    learned = learned_in(tmp_path)
    assert learned is not None
    assert learned["cycles"] == 1


@pytest.mark.parametrize("text", ["{}", "[]", "null", '{"cycles": "many"}', '{"cycles": 9, "sums": 1}'])
def test_what_is_no_knowledge_teaches_nothing(tmp_path: Path, text: str) -> None:
    (tmp_path / NOW_NAME).write_text(text)
    (tmp_path / "strokes.jsonl").write_text(f'{text}\n{{"learned": {text}}}\n')
    assert learned_in(tmp_path) is None


def test_what_was_learned_in_a_step_that_never_ended_is_there_for_the_next_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bufferstand.daq.strokes.knowledge_file.EVERY_S", 0.0)  # virtual time passes faster
    monkeypatch.setattr(
        "bufferstand.daq.campaign.session.Session._keep_strokes", lambda *_: None
    )  # as after a kill
    outcome, _, _, plan = run(tmp_path, sine(40.0, 10.0, 1.0, 4))
    assert outcome.status == "complete", outcome.reason
    assert not (tmp_path / "out" / STROKES_NAME).exists()
    known = knowledge_in(tmp_path / "out", plan)
    assert known.cycles >= 2
    assert known.give_mm_per_kN == pytest.approx(1.0 / 105.0, rel=0.05)
