"""What was recorded before a page's server came: from files and journal, each extreme, in bounded room."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.daq.monitor.past.answers import MOST_POINTS
from bufferstand.daq.monitor.past.buckets import bucketed, held
from bufferstand.daq.monitor.past.history import BUCKETS, LEVELS, MOST_CHANNELS, History
from bufferstand.daq.monitor.past.recorded import BETWEEN_S, history_of
from bufferstand.daq.monitor.past.run_spans import RunSpans
from bufferstand.foundation import BadInput
from bufferstand.recording.runfile import open_run
from tests.daq.test_runner import HARMONIC, STATIC, Case
from tests.monitor.served import TOKENS, running, served, until

WHOLE = (-math.inf, math.inf)
HOUR_S = 3600.0


def extremes(found: dict, channel: str) -> tuple[float, float]:
    low, high = ([one for one in found["values"][channel][end] if one is not None] for end in ("low", "high"))
    return min(low), max(high)


@pytest.fixture(scope="module")
def ended(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign of two runs that has ended."""
    case = Case(tmp_path_factory.mktemp("past"), HARMONIC + STATIC)
    assert case.run().status == "complete"
    return case.out


def test_the_files_of_a_campaign_give_every_extreme_at_the_time_of_the_stand(ended: Path) -> None:
    found = history_of(ended).span(*WHOLE, ["stroke", "force", "temperature_1"])
    runs = [open_run(path) for path in sorted((ended / "runs").glob("*.h5"))]
    strokes = np.concatenate([run.stroke().value for run in runs])
    forces = np.concatenate([run.series("force").value for run in runs])
    assert extremes(found, "stroke") == pytest.approx((strokes.min(), strokes.max()), abs=1e-4)
    assert extremes(found, "force") == pytest.approx((forces.min(), forces.max()), abs=1e-4)
    assert extremes(found, "temperature_1") == (21.0, 21.0)
    assert found["first_s"] == pytest.approx(runs[0].anchors[0].host_s, abs=0.05)
    assert found["last_s"] == pytest.approx(runs[1].anchors[0].host_s + 5.03, abs=0.05)
    assert {"stroke", "force", "position", "temperature_1"} <= {one["name"] for one in found["channels"]}
    temperature = found["values"]["temperature_1"]["low"]
    assert sum(one is None for one in temperature) < 25, "what is read once a second holds until the next"


def test_what_another_process_put_together_is_taken_in_and_of_what_was_heard_nothing_is_lost(
    ended: Path,
) -> None:
    past = history_of(ended)
    again = History.from_bytes(past.as_bytes())
    assert again.span(*WHOLE, ["force"]) == past.span(*WHOLE, ["force"])
    live = History()
    live.name([{"name": "stroke", "unit": "mm"}])
    live.add(8.0, {"stroke": [-3.0, 321.0]})
    live.add(20.0, {"stroke": [1.0, 2.0]})
    live.merge(again)
    found = live.span(*WHOLE, ["stroke", "force"])
    assert extremes(found, "stroke") == (-3.0, 321.0)
    assert extremes(found, "force") == extremes(past.span(*WHOLE, ["force"]), "force")
    assert (found["first_s"], found["last_s"]) == (pytest.approx(0.5, abs=0.05), 20.0)


def test_an_earlier_start_lies_before_the_newest_one(ended: Path, tmp_path: Path) -> None:
    """Both starts count from a zero of their own: their curves must not come to lie over each other."""
    record = json.loads((ended / "campaign.json").read_text())
    second = sorted((ended / "runs").glob("*.h5"))[1]
    begun = open_run(second).anchors[0]
    (tmp_path / "runs").mkdir()
    for path in (ended / "runs").glob("*.h5"):
        (tmp_path / "runs" / path.name).write_bytes(path.read_bytes())
    record["starts"].append({**record["starts"][0], "at_utc": begun.utc})
    (tmp_path / "campaign.json").write_text(json.dumps(record))
    found = history_of(tmp_path).span(*WHOLE, ["stroke"])
    assert found["last_s"] == pytest.approx(begun.host_s + 5.03, abs=0.1)
    first_run_s = 6.04
    assert found["first_s"] == pytest.approx(begun.host_s - BETWEEN_S - first_run_s, abs=1.2)
    followed = history_of(tmp_path, 2.0).span(*WHOLE, ["stroke"])
    assert followed["first_s"] == pytest.approx(2.0 - BETWEEN_S - first_run_s, abs=1.2)


@pytest.mark.slow
def test_a_server_that_comes_late_has_the_campaign_from_its_begin(tmp_path: Path) -> None:
    """From the journal of the run that is under way; the server itself has heard only the last moments."""
    with running(tmp_path) as going:
        until(lambda: going.case.clock.now_s() > 15.0)
        with served(going.case.out) as page:
            page.enter(TOKENS.view)

            def begin_s() -> float:
                answer = json.loads(page.request("GET", "/history?channels=stroke")[2])
                return math.inf if answer["first_s"] is None else float(answer["first_s"])

            until(lambda: begin_s() < 1.0)
            found = json.loads(page.request("GET", "/history?channels=stroke,force&to=12")[2])
            assert extremes(found, "stroke") == pytest.approx((0.0, 15.0), abs=0.1)
            assert len(found["t"]) > 20


@pytest.mark.slow
def test_twelve_hours_at_a_kilohertz_take_the_room_of_the_first_minutes_and_keep_a_spike() -> None:
    """Virtual time, block by block as from files: one sample of 43 million is still seen, nothing grows."""
    history = History()
    rows, spike_s = 50_000, 5.0 * HOUR_S
    wave = np.sin(np.arange(rows) * 0.002 * math.pi)
    sizes, sent, peaks = set(), set(), []
    for block in range(int(12 * HOUR_S * 1000 / rows)):
        time_s = (block * rows + np.arange(rows)) / 1000.0
        values = np.where(time_s == spike_s, 99.0, wave)
        history.take(time_s, {"force": values, "stroke": wave})
        if block % 100 == 10:
            sizes.add(history.bytes)
            sent.add(len(history.as_bytes()))
            history.name([{"name": name, "unit": ""} for name in ("force", "stroke")])
            answer = history.span(*WHOLE, ["force", "stroke"])
            peaks.append((len(answer["t"]), len(json.dumps(answer))))
    assert sizes == {LEVELS * BUCKETS * 8 * (1 + 2 * 2)}
    assert max(sent) - min(sent) < 100
    assert max(sent) < LEVELS * BUCKETS * 8 * (1 + 2 * MOST_CHANNELS)
    assert max(points for points, _ in peaks) <= MOST_POINTS
    assert max(size for _, size in peaks) < 60_000
    assert extremes(history.span(*WHOLE, ["force"]), "force")[1] == 99.0
    near = history.span(spike_s - 60.0, spike_s + 60.0, ["force"])
    at = near["values"]["force"]["high"].index(99.0)
    assert abs(near["t"][at] - spike_s) <= near["width_s"]


def test_any_span_of_a_run_is_as_fine_as_its_file_and_its_peaks_stay(ended: Path) -> None:
    spans, file = RunSpans(ended), "runs/001-harmonic-10mm-5mm-1Hz.h5"
    stroke = open_run(ended / file).stroke()
    whole = spans.span(file, *WHOLE, ["stroke", "temperature_1", "no such"])
    assert extremes(whole, "stroke") == pytest.approx((stroke.value.min(), stroke.value.max()), abs=1e-4)
    assert len(whole["t"]) <= MOST_POINTS + 1
    assert list(whole["values"]) == ["stroke", "temperature_1"]
    assert (whole["first_s"], whole["last_s"]) == (0.0, pytest.approx(6.039, abs=1e-6))
    close = spans.span(file, 2.0, 2.2, ["stroke", "temperature_1"])
    assert 100 <= len(close["t"]) <= 201
    inside = (stroke.time_s >= 2.0) & (stroke.time_s <= 2.2)
    shown = np.array([close["values"]["stroke"]["low"], close["values"]["stroke"]["high"]], dtype=float)
    assert np.isfinite(shown).all(), "no bucket without a sample"
    assert shown.min() == pytest.approx(stroke.value[inside].min(), abs=0.02)
    assert shown.max() == pytest.approx(stroke.value[inside].max(), abs=0.02)
    assert set(close["values"]["temperature_1"]["high"]) == {21.0}
    json.dumps(spans.span(file, math.inf, math.inf, ["stroke"]), allow_nan=False)
    for wrong in ("../out/runs/001-harmonic-10mm-5mm-1Hz.h5", "/etc/passwd", ""):
        with pytest.raises(BadInput, match="no such run"):
            spans.span(wrong, *WHOLE, ["stroke"])


def test_a_value_that_comes_seldom_holds_until_the_next_but_not_over_a_long_interruption() -> None:
    time_s, values = held(np.array([0.0, 1.0, 100.0]), {"T": np.array([20.0, 21.0, 30.0])}, 0.25, 30.0)
    assert time_s.tolist() == [0.0, 0.25, 0.5, 0.75, 1.0, 100.0]
    assert values["T"].tolist() == [20.0, 20.0, 20.0, 20.0, 21.0, 30.0]


@given(
    st.lists(st.floats(0.0, 40.0), min_size=2, max_size=40),
    st.floats(0.01, 3.0),
    st.floats(-1.0, 400.0),
)
def test_what_nobody_asks_for_is_not_repeated_and_the_rest_is_as_it_was(
    steps: list[float], width_s: float, since_s: float
) -> None:
    time_s = np.cumsum(steps)
    values = {"T": np.arange(len(steps)) * 1.0}
    whole, part = (
        bucketed(*held(time_s, values, width_s, 30.0, *since), width_s) for since in ((), (since_s,))
    )
    first = math.floor(since_s / width_s)
    kept = [numbers >= first for numbers, _ in (whole, part)]
    assert whole[0][kept[0]].tolist() == part[0][kept[1]].tolist()
    for one, other in zip(whole[1]["T"], part[1]["T"], strict=True):
        assert one[kept[0]].tolist() == other[kept[1]].tolist()


def test_a_zoom_to_microseconds_repeats_a_seldom_value_no_million_times() -> None:
    time_s, _ = held(np.array([0.0, 29.0, 29.5]), {"T": np.array([20.0, 21.0, 22.0])}, 1e-6, 30.0, 29.4999)
    assert len(time_s) < 200
