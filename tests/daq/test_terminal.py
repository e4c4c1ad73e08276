"""What the operator sees, live and in a log."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from rich.console import Console

from bufferstand.daq.operator.progress import CampaignProgress, Part, SilentSink, Throttle
from bufferstand.daq.operator.terminal import duration, panel, progress_on, temperatures
from tests.daq.cases import Lines

NOW = CampaignProgress(
    step=3, steps=12, name="50 ± 10 mm, 1.27 Hz", phase="motion", cycle=2, cycles=5, force_kN=123.46,
    stroke_mm=55.125, temperatures_C={"temperature_2": 30.94, "temperature_1": 31.2},
    temperature_limit_C=40.0, elapsed_s=125.0, remaining_s=3723.0, lost=7, written=1000, durable=900,
    warnings=("a gap",),
)  # fmt: skip


def shown(progress: CampaignProgress, width: int = 120) -> str:
    stream = io.StringIO()
    Console(file=stream, width=width).print(panel(progress))
    return stream.getvalue()


def test_the_panel_says_all_of_it() -> None:
    text = shown(NOW)
    for part in (
        "step 3 of 12", "50 ± 10 mm, 1.27 Hz", "motion", "123.5 kN", "55.12 mm", "cycle 2 of 5",
        "31.2 · 30.9 °C (stop 40 °C)", "2:05 gone, about 1:02:03 left", "1000 samples", "900 on disk, 7 lost",
        "! a gap",
    ):  # fmt: skip
        assert part in text


def test_what_is_not_known_is_a_dash_and_no_zero() -> None:
    text = shown(replace(NOW, force_kN=None, stroke_mm=None, temperatures_C={}, cycles=0, lost=0))
    assert "kN" not in text
    assert "cycle" not in text
    assert "no reading" in text
    assert "lost" not in text


@pytest.mark.parametrize(
    ("part", "cycle", "text"),
    [
        ("lead-in", 0, "leading in to 5 cycles"),
        ("", 4, "cycle 4 of 5"),
        ("run-out", 5, "cycle 5 of 5, running out"),
    ],
)
def test_the_way_in_and_out_of_a_sine_is_no_cycle(part: Part, cycle: int, text: str) -> None:
    assert text in shown(replace(NOW, part=part, cycle=cycle))


def test_names_are_text_and_never_markup() -> None:
    assert "[bold]x[/bold]" in shown(replace(NOW, name="[bold]x[/bold]", warnings=("[red]w[/red]",)))


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.0, "0:00"), (-5.0, "0:00"), (59.6, "1:00"), (3600.0, "1:00:00"), (86399.0, "23:59:59")],
)
def test_durations(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_temperatures_without_a_limit() -> None:
    assert temperatures(replace(NOW, temperature_limit_C=None)) == "31.2 · 30.9 °C"


def test_a_log_has_one_line_a_message_and_no_control_characters() -> None:
    stream = io.StringIO()
    with progress_on(stream) as sink:
        sink.message("step 1 of 2")
        sink.update(NOW)
        sink.message("campaign complete")
    assert stream.getvalue() == "step 1 of 2\ncampaign complete\n"


class Tty(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_terminal_gets_the_panel_and_the_messages() -> None:
    stream = Tty()
    with progress_on(stream) as sink:
        sink.update(NOW)
        sink.message("note: [x] a gap")
    assert "note: [x] a gap" in stream.getvalue()
    assert "step 3 of 12" in stream.getvalue()


def test_the_throttle_lets_ten_a_second_through_and_makes_no_others() -> None:
    now = [0.0]
    sink, made = Lines(), []
    throttle = Throttle(sink, lambda: now[0])
    for hundredth in range(100):
        now[0] = hundredth / 100
        throttle.offer(lambda: made.append(NOW) or NOW)
    assert len(made) == len(sink.snapshots) == 10


def test_silent_shows_nothing() -> None:
    SilentSink().update(NOW)
    SilentSink().message("x")
