"""Whether the readings of a channel can be true: broken wires, saturated converters, overload, jumps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bufferstand.foundation.channels.channel import Channel

Kind = Literal["counts", "overload", "rate"]

_BROKEN = {
    "stroke": "a draw wire at its end, or its cable broken; look at the wire, its plug and its supply",
    "force": "the amplifier is saturated or the bridge open; look at transducer cable, range and overload",
    "temperature": "look at the sensor and its cable",
}
_JUMPED = {
    "stroke": "a draw wire that snapped, went slack or snagged, or a loose contact; look at it",
    "force": "a loose contact or a disturbed line; look at plugs and shields",
}


@dataclass(frozen=True)
class ImplausibleSamples:
    """A run of samples that cannot be true.

    Parameters
    ----------
    kind : str
        ``counts`` (at an end of the converter), ``overload`` or ``rate``.
    first : int
        Row of the first sample.
    samples : int
        How many in a row, of those that were looked at.
    what : str
        What is wrong and where to look.
    """

    kind: Kind
    first: int
    samples: int
    what: str


class PlausibilityWatch:
    """Looks at the blocks of one channel in their order; remembers the last sample for the rate.

    Parameters
    ----------
    channel : Channel
        With its limits (:class:`bufferstand.foundation.channels.channel.Plausibility`); without any, nothing
        is found.
    raw_unit : str
        Unit in which the channel is delivered: ``V`` of a device that delivers volts.
    """

    def __init__(self, channel: Channel, raw_unit: str = "counts") -> None:
        self._channel = channel
        self._raw_unit = raw_unit
        self._last: tuple[float, float] | None = None

    def look(
        self, time_us: NDArray[np.int64], counts: ArrayLike, value: ArrayLike
    ) -> list[ImplausibleSamples]:
        """Return what cannot be true in a block.

        Parameters
        ----------
        time_us : NDArray[int64]
            Time stamps [µs], shape (n,).
        counts, value : array
            Raw counts, and the same calibrated, shape (n,).
        """
        limits = self._channel.plausible
        raw, scaled = np.asarray(counts, dtype=np.float64), np.asarray(value, dtype=np.float64)
        if limits is None or not raw.size:
            return []
        found: list[ImplausibleSamples] = []
        if limits.counts is not None:
            low, high = limits.counts
            found += _runs((raw <= low) | (raw >= high), "counts", lambda row: self._at_end(raw[row]))
        if limits.overload is not None:
            found += _runs(
                np.abs(scaled) > limits.overload, "overload", lambda row: self._overloaded(scaled[row])
            )
        if limits.rate_per_s is not None:
            found += self._jumps(time_us / 1e6, scaled, limits.rate_per_s)
        return found

    def _at_end(self, raw: float) -> str:
        channel = self._channel
        assert channel.plausible is not None
        assert channel.plausible.counts is not None
        low, high = channel.plausible.counts
        form = ".0f" if self._raw_unit == "counts" else ".5g"
        side = f"≤ {low:{form}}" if raw <= low else f"≥ {high:{form}}"
        look = _BROKEN.get(channel.quantity, "look at the transducer and its cable")
        return f"{channel.name} reads {raw:{form}} {self._raw_unit} ({side}), an end of its converter: {look}"

    def _overloaded(self, value: float) -> str:
        channel = self._channel
        assert channel.plausible is not None
        return (
            f"{channel.name} is overloaded: {value:.4g} {channel.unit}, the transducer bears "
            f"{channel.plausible.overload:g}; unload, and check its zero afterwards"
        )

    def _jumps(
        self, time_s: NDArray[np.float64], value: NDArray[np.float64], rate: float
    ) -> list[ImplausibleSamples]:
        before = (time_s[0], value[0]) if self._last is None else self._last
        self._last = float(time_s[-1]), float(value[-1])
        step_s = np.diff(time_s, prepend=before[0])
        step = np.diff(value, prepend=before[1])
        channel = self._channel
        look = _JUMPED.get(channel.quantity, "look at the sensor and its contacts")

        def text(row: int) -> str:
            return (
                f"{channel.name} jumps by {step[row]:+.4g} {channel.unit} in {step_s[row] * 1e3:.3g} ms, "
                f"faster than {rate:g} {channel.unit}/s: {look}"
            )

        return _runs(np.abs(step) > rate * np.maximum(step_s, 0.0), "rate", text)


def _runs(bad: NDArray[np.bool_], kind: Kind, text: Callable[[int], str]) -> list[ImplausibleSamples]:
    """Return each run of bad samples."""
    edges = np.flatnonzero(np.diff(bad.astype(np.int8), prepend=0, append=0))
    return [
        ImplausibleSamples(kind, int(first), int(end - first), text(int(first)))
        for first, end in zip(edges[::2], edges[1::2], strict=True)
    ]
