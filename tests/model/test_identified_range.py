"""Where a model was identified: kept in its file, told in words, and watched along histories."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bufferstand.foundation import BadInput
from bufferstand.model import SpringStepper, load_model, save_model, simulate
from bufferstand.model.identified_range import IdentifiedRange
from tests.model.cases import reference_curves, spring

RANGE = IdentifiedRange(
    stroke_mm=(0.0, 80.0),
    speed_mm_per_s=(5.0, 85.0),
    frequency_Hz=(0.024, 1.3),
    continuation="own-shape",
    loading_at_end_kN=(500.0, 640.0),
)


def known(**changes):
    return replace(spring(reference_curves()), identified=replace(RANGE, **changes))


def triangle(top_mm, speed_mm_per_s, count=401):
    x = top_mm * (1.0 - np.abs(np.linspace(-1.0, 1.0, count)))
    return np.linspace(0.0, 2.0 * top_mm / speed_mm_per_s, count), x


def told(model, top_mm, speed):
    return simulate(model, *triangle(top_mm, speed), temperature_C=25.0, isothermal=True).warnings


def test_a_file_keeps_it_and_files_without_are_read_as_ever(tmp_path):
    for model in (known(), known(continuation=None, loading_at_end_kN=None, stop="given")):
        save_model(model, tmp_path / "m.toml")
        assert load_model(tmp_path / "m.toml") == model
    save_model(spring(reference_curves()), tmp_path / "old.toml")
    assert "identified" not in (tmp_path / "old.toml").read_text(encoding="utf-8")
    assert load_model(tmp_path / "old.toml").identified is None


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("stroke_mm = [0.0, 900.0]", "identified.stroke_mm"),
        ("stroke_mm = [80.0, 0.0]", "identified.stroke_mm"),
        ("stroke_mm = [0.0]", "identified.stroke_mm"),
        ('stroke_mm = [0.0, 80.0]\ncontinuation = "guess"', "identified.continuation"),
        ('stroke_mm = [0.0, 80.0]\ncontinuation = "own-shape"', "identified.continuation"),
    ],
)
def test_a_file_that_contradicts_itself_is_refused_with_its_place(tmp_path, text, place):
    save_model(spring(reference_curves()), tmp_path / "m.toml")
    with (tmp_path / "m.toml").open("a", encoding="utf-8") as file:
        file.write(f"\n[identified]\nspeed_mm_per_s = [5.0, 85.0]\nfrequency_Hz = [0.1, 1.0]\n{text}\n")
    with pytest.raises(BadInput) as caught:
        load_model(tmp_path / "m.toml")
    assert place in str(caught.value)


def test_within_the_range_nothing_is_said():
    assert told(known(), 80.0, 84.0) == ()
    assert told(spring(reference_curves()), 200.0, 3000.0) == ()


def test_strokes_on_the_continued_curve_are_told():
    (said,) = told(known(), 90.0, 20.0)
    assert "strokes up to 90.0 mm leave the 80.0 mm" in said
    assert "continued there, not measured" in said


@pytest.mark.parametrize(
    ("stop", "words"), [("assumed", "an assumed one"), ("given", "as given by the user")]
)
def test_strokes_into_the_stop_are_told_with_its_stiffness_and_source(stop, words):
    model = known(stop=stop)
    end = model.curves.end_mm
    said = told(model, end + 1.0, 20.0)
    assert [words in s and "500 kN/mm" in s for s in said] == [False, True]


def test_speeds_are_watched_while_the_spring_is_touched():
    (said,) = told(known(), 60.0, 300.0)
    assert said.startswith("speeds up to 300 mm/s leave the 85 mm/s")
    time, stroke = triangle(60.0, 300.0)
    away = simulate(known(), time, stroke - 70.0, temperature_C=25.0, isothermal=True)
    assert away.warnings == ()


def test_words_of_what_stands_beyond():
    said = known().statements
    assert "from 80.0 to 105 mm the curves are continued by their own shape, not measured" in said[1]
    assert "500 … 640 kN" in said[1]
    assert said[2] == "beyond 105 mm stands a stop of 500 kN/mm (assumed, not measured)"
    assert len(known(continuation=None, loading_at_end_kN=None).statements) == 2
    assert spring(reference_curves()).statements == ()


def test_no_figure_depends_on_it():
    time, stroke = triangle(100.0, 300.0)
    ours, theirs = (SpringStepper(m, 25.0, 25.0) for m in (known(), spring(reference_curves())))
    dt = float(time[1])
    assert [ours.step(x, dt) for x in stroke.tolist()] == [theirs.step(x, dt) for x in stroke.tolist()]
