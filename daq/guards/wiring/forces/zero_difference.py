"""Compares the two force channels at rest: a load that only one of them shows need be none.

At rest a wrong scale is not told from a wrong zero, nor which of both is wrong: both are named, the one that
shows a load first, so that nobody unloads a specimen that bears none, or takes a loaded one for unloaded.
"""

from __future__ import annotations

from bufferstand.daq.guards.wiring.doubt import SignalDoubt, channel_setting, stream_of
from bufferstand.foundation.numbers import likeness

APART_KN, UNCOUNTED_KN, APART_SHARE = 2.0, 3.5, 0.08
"""At rest both agree within this (their zeros; more where none was found), and this share."""
LEAST_KN = 0.3
"""Of less than this no ratio is made: noise and zero are as much [kN]."""


def may_differ_kN(first_kN: float, second_kN: float, *, counted: bool) -> float:  # noqa: N802 - a unit
    """Return by how much both ways to one force may differ at rest [kN].

    Parameters
    ----------
    first_kN, second_kN : float
        What they read.
    counted : bool
        Whether a zero of both was taken off.
    """
    return (APART_KN if counted else UNCOUNTED_KN) + APART_SHARE * max(abs(first_kN), abs(second_kN))


def apart_at_rest(force_kN: float, second_kN: float | None, *, counted: bool) -> str:
    """Return that both ways to the force do not agree at rest, and where to look; empty where they do.

    Parameters
    ----------
    force_kN : float
        What ``force`` reads.
    second_kN : float or None
        What ``force_2`` reads; None where there is none.
    counted : bool
        Whether a zero of both was taken off.
    """
    doubt = doubt_at_rest(force_kN, second_kN, counted=counted)
    return "" if doubt is None else f"{doubt.text}: look at their wiring and at {doubt.setting}"


def doubt_at_rest(
    force_kN: float, second_kN: float | None, *, counted: bool, more: str = ""
) -> SignalDoubt | None:
    """Return the doubt of two ways to one force that do not agree at rest, None where they do.

    Parameters
    ----------
    force_kN, second_kN, counted
        As of :func:`apart_at_rest`.
    more : str
        Said behind what ``force`` reads: where, or beyond which limit.
    """
    if second_kN is None:
        return None
    most_kN = may_differ_kN(force_kN, second_kN, counted=counted)
    if not abs(force_kN - second_kN) > most_kN:  # true for NaN, too, of which others tell
        return None
    names = ("force", "force_2") if abs(force_kN) > abs(second_kN) else ("force_2", "force")
    text = f"force reads {force_kN:+.2f} kN{more} and force_2 {second_kN:+.2f} kN of one transducer"
    high, low = sorted((force_kN, second_kN), key=abs, reverse=True)
    if abs(low) > LEAST_KN:
        look = likeness(high / low)
        text += f", the one {abs(high / low):.1f} times the other" + (f" ({look})" if look else "")
    text += ": scale, zero or wire of one of them is wrong, and there need be no load"
    setting = " or ".join(channel_setting(name, "calibration") for name in names)
    apart_kN = force_kN - second_kN
    return SignalDoubt(
        "disagrees", ", ".join(names), stream_of(names[0]), setting, text, apart_kN, most_kN, "kN"
    )
