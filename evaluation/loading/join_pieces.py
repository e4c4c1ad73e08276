"""Channels of different streams brought together piece by piece, for runs too long to be held at once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from bufferstand.evaluation.loading.join import channels_of
from bufferstand.evaluation.loading.reading_rates import ChannelReadings, IntervalCounts, Rates, within
from bufferstand.evaluation.loading.resample import bring, usable, usual_step_s
from bufferstand.evaluation.numerics import FloatArray, noise_sigma
from bufferstand.evaluation.record import InterpolationLimits
from bufferstand.foundation import BadInput, to_inside
from bufferstand.foundation.channels import mean_of_strokes, tilt_of_strokes
from bufferstand.foundation.numbers import median
from bufferstand.recording.runfile import Run

_MARGIN = 64
"""Readings about a piece that its splines see: what lies further off counts by less than 0.27^64."""


def compared(wires: Sequence[FloatArray]) -> list[FloatArray]:
    """Return the difference of draw wires, and of more than two each one behind it; nothing of one."""
    if len(wires) < 2:
        return []
    return [tilt_of_strokes(wires), *(wires if len(wires) > 2 else ())]


class Feed:
    """A channel that is read as far as a piece needs it: its readings about some stretch of time.

    Parameters
    ----------
    run : Run
    channel : str
    rows : int
        Of a block that is read at once.
    """

    def __init__(self, run: Run, channel: str, rows: int) -> None:
        self._blocks = run.blocks([channel], rows)
        self._channel = channel
        self._quantity = channel.split("_", maxsplit=1)[0]
        self._kept = ChannelReadings(np.zeros(0), np.zeros(0))
        self.first_s = -np.inf
        """Its first reading, as soon as one was read."""
        self.last_s = np.inf
        """Its last reading, as soon as that was read."""

    def about(self, from_s: float, to_s: float) -> ChannelReadings:
        """Return the readings from 64 before a stretch to 64 behind it; stretches come in order of time.

        Raises
        ------
        BadInput
            If its dataset is damaged.
        """
        kept = [self._kept]
        behind = int(np.count_nonzero(self._kept.time_s > to_s))
        while behind <= _MARGIN and (block := next(self._blocks, None)) is not None:
            series = block[self._channel]
            value = to_inside(series.value, self._quantity, series.unit)
            own = ChannelReadings(*usable(series.time_s, value))
            kept.append(own)
            behind += int(np.count_nonzero(own.time_s > to_s))
        joined = ChannelReadings(*usable(*(np.concatenate(column) for column in zip(*kept, strict=True))))
        if not np.isfinite(self.first_s) and joined.time_s.size:
            self.first_s = float(joined.time_s[0])
        if behind <= _MARGIN:
            self.last_s = float(joined.time_s[-1]) if joined.time_s.size else -np.inf
        first = max(0, int(np.searchsorted(joined.time_s, from_s)) - _MARGIN)
        self._kept = ChannelReadings(joined.time_s[first:], joined.value[first:])
        return self._kept


class Pieces:
    """The columns of a long imported run, piece by piece, at the instants of its first draw wire.

    Parameters
    ----------
    run : Run
    wires : sequence of str
    rows : int
        Of a piece.
    """

    def __init__(self, run: Run, wires: Sequence[str], rows: int) -> None:
        self._run, self._wires, self._rows = run, wires, rows
        self._rates = self._compared()
        self._seen = IntervalCounts()

    def columns(self) -> Iterator[FloatArray]:
        """Return time, stroke, force, where there are, wire difference and speed; shape (columns, rows).

        Of more than two wires each one follows on their difference. The last two columns are what halves of
        the force's readings give, less what all give.
        What lies before the force's first reading and behind its last one is left out.

        Raises
        ------
        BadInput
            If a dataset is damaged.
        """
        base = Feed(self._run, self._wires[0], self._rows)
        others = {
            name: Feed(self._run, name, self._rows)
            for name in channels_of(self._run, self._wires)
            if name != self._wires[0]
        }
        for block in self._run.blocks([self._wires[0]], self._rows):
            time_s = block[self._wires[0]].time_s
            known = time_s[np.isfinite(time_s)]
            if not known.size:
                continue
            span = float(np.min(known)), float(np.max(known))
            stroke = to_inside(block[self._wires[0]].value, "stroke", block[self._wires[0]].unit)
            about = {name: feed.about(*span) for name, feed in others.items()}
            brought = {name: bring(*readings, time_s) for name, readings in about.items()}
            at = {name: own.value for name, own in brought.items()}
            difference = []
            if len(self._wires) > 2:
                all_of_them = [stroke, *(at[name] for name in self._wires[1:])]
                difference, stroke = compared(all_of_them), mean_of_strokes(all_of_them)
            elif len(self._wires) > 1:
                difference = [stroke - at[self._wires[1]]]
                stroke = stroke - 0.5 * difference[0]
            force = self._checked(at["force"], time_s, base.about(*span), about["force"])
            speed = [at["speed"]] if "speed" in at else []
            halved = np.nan_to_num(brought["force"].halved)
            piece = np.stack([time_s, stroke, force, *difference, *speed, *halved])
            reach_s = usual_step_s(known)
            out = (time_s < others["force"].first_s - reach_s) | (time_s > others["force"].last_s + reach_s)
            out &= ~np.isfinite(force)
            yield piece[:, ~out] if out.any() else piece

    def between(self, time_s: FloatArray, halved_kN: FloatArray) -> InterpolationLimits | None:
        """Return what may lie between the readings of the force; None where they are more frequent."""
        if self._rates.slow == "stroke":
            return None
        return InterpolationLimits(self._force_step_s, time_s, halved_kN, self._force_noise_kN)

    def problems(self) -> tuple[str, ...]:
        """Return what a user must know, once all pieces have been taken.

        Raises
        ------
        BadInput
            If stroke or force are nowhere read often enough to show what the other one does.
        """
        if not self._seen.coarse:
            return ()
        text, remedy = self._seen.text(self._rates), self._rates.remedy
        if self._seen.coarse == self._seen.intervals:
            raise BadInput(text, file=self._run.path, place=f"channel {self._rates.slow}", remedy=remedy)
        return (f"{text}: nothing is evaluated there; {remedy}",)

    def _compared(self) -> Rates:
        """Compare stroke and force by all of their readings: extremes and steps, block by block."""
        steps, values = [], []
        for name in (self._wires[0], "force"):
            own_steps, extremes, some = [], [], np.zeros(0)
            for block in self._run.blocks([name], self._rows):
                series = block[name]
                good = ChannelReadings(*usable(series.time_s, series.value))
                if good.value.size < 2:
                    continue
                own_steps.append(usual_step_s(good.time_s))
                extremes += [np.min(good.value), np.max(good.value)]
                some = some if some.size else good.value
            unit = self._run.stream_of(name).channels[name].unit
            quantity = name.split("_", maxsplit=1)[0]
            values.append(to_inside(np.append(some, extremes), quantity, unit))
            steps.append(median(own_steps) if own_steps else np.inf)
        self._force_step_s, self._force_noise_kN = steps[1], noise_sigma(values[1][:-2])
        return Rates.of(steps[0], steps[1], values[0], values[1])

    def _checked(
        self, force_kN: FloatArray, time_s: FloatArray, stroke: ChannelReadings, force: ChannelReadings
    ) -> FloatArray:
        """Return the force, NaN where stroke or force is read too seldom."""
        coarse = self._rates.too_coarse(stroke, force)
        if coarse is None:
            return force_kN
        slow_s = (force if self._rates.slow == "force" else stroke).time_s
        # Neighbouring pieces see intervals about their edge twice: each counts where it begins.
        begins = (slow_s[:-1] >= np.nanmin(time_s)) & (slow_s[:-1] <= np.nanmax(time_s))
        self._seen.look(slow_s[:-1][begins], coarse[begins])
        return np.where(within(slow_s, coarse, time_s), np.nan, force_kN)
