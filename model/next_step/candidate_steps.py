"""The steps among which the next one is chosen: what a stand can do with a spring, coarse but complete.

Each kind of contrast that a parameter needs (docs/identification.md) is among them: slow strokes and inner
loops for the curves and their transition, one path at rates a factor of 64 apart for the viscous branches,
the same after cycles that warm the spring, and short loops after a rest while it cools.
"""

from __future__ import annotations

from collections.abc import Callable

from bufferstand.model.next_step.pieces import Candidate, Loops, Piece, Rest, SlowStroke

_REACH_SHARE = 0.95
_SMALL = ((0.5, 0.02), (0.5, 0.05), (0.25, 0.1), (0.5, 0.1), (0.75, 0.1))
_SMALL_AT = ((0.5, 3), (1.28, 12))
"""Rates of small loops [Hz] and how many: many at once save the way there and back."""
_LARGE = ((0.25, 0.25), (0.5, 0.25), (0.5, 0.5))
_FREQUENCIES_Hz = (0.02, 0.08, 0.32, 1.28)
_HEATING = ((0.74, 0.16, 1.0, 40), (0.74, 0.16, 1.0, 120), (0.5, 0.3, 0.5, 60))
_COOLING_S = (120.0, 300.0, 900.0)


def measuring(reach_mm: float) -> tuple[Piece, ...]:
    """Return the pieces that measure, for a stroke that runs may reach [mm]."""
    reach = _REACH_SHARE * reach_mm
    strokes = [SlowStroke(_rounded(reach), speed) for speed in (5.0, 20.0)]
    small = [
        _loops(at * reach, size * reach, rate, cycles) for at, size in _SMALL for rate, cycles in _SMALL_AT
    ]
    large = [
        _loops(at * reach, size * reach, rate, 1 if rate < 0.05 else 3)
        for at, size in _LARGE
        for rate in _FREQUENCIES_Hz
    ]
    return (*strokes, *small, *large)


def heating(reach_mm: float) -> tuple[Piece, ...]:
    """Return the pieces that warm the spring."""
    reach = _REACH_SHARE * reach_mm
    return tuple(_loops(at * reach, size * reach, rate, cycles) for at, size, rate, cycles in _HEATING)


def _loops(prestress_mm: float, amplitude_mm: float, frequency_Hz: float, cycles: int) -> Loops:
    return Loops(_rounded(prestress_mm), _rounded(amplitude_mm), frequency_Hz, cycles)


def _rounded(stroke_mm: float) -> float:
    """Return a stroke as a campaign file states it, to 0.1 mm."""
    return round(stroke_mm, 1)


def candidates(reach_mm: float, admitted: Callable[[Piece], bool]) -> tuple[Candidate, ...]:
    """Return every candidate of admitted pieces.

    Single pieces; a piece that warms and one that measures; a rest and one that measures.

    Parameters
    ----------
    reach_mm : float
        Largest stroke that runs may reach: that of the curves as far as they are known.
    admitted : callable
        Whether the stand may do a piece.
    """
    measure = [piece for piece in measuring(reach_mm) if admitted(piece)]
    warm = [piece for piece in heating(reach_mm) if admitted(piece)]
    brief = [piece for piece in measure if isinstance(piece, Loops) and piece.frequency_Hz >= 0.3]
    strokes = [piece for piece in measure if isinstance(piece, SlowStroke)]
    found: list[Candidate] = [(piece,) for piece in (*measure, *warm)]
    after_warming: list[Piece] = [*strokes, *brief[-2:]]
    after_resting: list[Piece] = [*strokes[-1:], *brief[-2:]]
    found += [(first, then) for first in warm for then in after_warming]
    found += [(Rest(wait), then) for wait in _COOLING_S for then in after_resting]
    return tuple(found)
