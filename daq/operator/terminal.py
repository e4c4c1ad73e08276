"""Progress in a terminal: a live panel where there is one, plain lines where there is none."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from bufferstand.daq.operator.progress import CampaignProgress, ProgressSink


def duration(seconds: float) -> str:
    """Return e.g. ``1:02:03`` or ``2:03`` for a number of seconds; below zero is zero."""
    minutes, rest = divmod(round(max(0.0, seconds)), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


def temperatures(progress: CampaignProgress) -> str:
    """Return the readings in one line, e.g. ``31.2 · 30.9 °C (stop 40 °C)``."""
    if not progress.temperatures_C:
        return "no reading"
    readings = " · ".join(f"{value:.1f}" for _, value in sorted(progress.temperatures_C.items()))
    limit = "" if progress.temperature_limit_C is None else f" (stop {progress.temperature_limit_C:g} °C)"
    return f"{readings} °C{limit}"


def panel(progress: CampaignProgress) -> Group:
    """Return the live view of a snapshot: a line of place, a bar of time, the values."""
    head = Text.assemble(
        (f"step {progress.step} of {progress.steps}  ", "bold"),
        progress.name,
        (f"  {'ended' if progress.phase == 'done' else progress.phase}", "cyan"),
    )
    total_s = progress.elapsed_s + progress.remaining_s
    time = Table.grid(padding=(0, 2))
    time.add_row(
        ProgressBar(total=max(total_s, 1e-9), completed=progress.elapsed_s, width=40),
        f"{duration(progress.elapsed_s)} gone, about {duration(progress.remaining_s)} left",
    )
    values = Table.grid(padding=(0, 2))
    force = "–" if progress.force_kN is None else f"{progress.force_kN:8.1f} kN"
    stroke = "–" if progress.stroke_mm is None else f"{progress.stroke_mm:8.2f} mm"
    values.add_row(force, stroke, progress.cycles_text, temperatures(progress))
    lost = f", {progress.lost} lost" if progress.lost else ""
    values.add_row("recorded", f"{progress.written} samples", f"{progress.durable} on disk{lost}", "")
    values.add_row(*_learned(progress))
    strokes = [Text(f"stroke: {progress.stroke}")] if progress.stroke else []
    warnings = [Text(f"! {text}", style="yellow") for text in progress.warnings[-3:]]
    return Group(head, time, values, *strokes, *warnings)


def _learned(progress: CampaignProgress) -> tuple[str, ...]:
    """Return what the specimen taught, and what the first plan says; nothing as long as nothing is known."""
    if not progress.learned_from:
        return ()
    planned_s = progress.planned_remaining_s
    by_plan = "" if planned_s is None else f"by the first plan {duration(planned_s)} left"
    return (
        "learned", f"heating × {progress.heating:.2f}", f"cooling × {progress.cooling:.2f}", by_plan
    )  # fmt: skip


class LiveTerminal:
    """Shows a panel that renews itself; messages scroll by above it."""

    def __init__(self, live: Live) -> None:
        self._live = live

    def update(self, progress: CampaignProgress) -> None:
        """Show a snapshot."""
        self._live.update(panel(progress))

    def message(self, text: str) -> None:
        """Print a line above the panel."""
        self._live.console.print(text, markup=False, highlight=False)


class PlainLines:
    """One line a message, and no snapshots: for logs and pipes."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def update(self, progress: CampaignProgress) -> None:
        """Show nothing: a log is not a display."""

    def message(self, text: str) -> None:
        """Write a line at once."""
        print(text, file=self._stream, flush=True)


@contextmanager
def progress_on(stream: TextIO) -> Iterator[ProgressSink]:
    """Show progress on a stream (standard error): live if it is a terminal, plain lines if not."""
    if not stream.isatty():
        yield PlainLines(stream)
        return
    console = Console(file=stream)
    with Live(console=console, refresh_per_second=10, transient=True) as live:
        yield LiveTerminal(live)
