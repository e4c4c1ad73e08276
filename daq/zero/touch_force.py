"""How far the force of a touch can go over the force at which it turns: ``F = F_turn + k v T``.

A piston that is told to turn goes on for a moment at the speed it has, and the machine's frame makes force of
that way. What is announced before a stand moves is this bound, not the force of the turn.
"""

from __future__ import annotations

from bufferstand.protocols.campaign_file import TOUCH_FORCE_MAX_KN, ZeroTable

STIFFNESS_KN_PER_MM = 150.0
"""Of a frame whose stand file states none [kN/mm]."""
CONTROLLER_TURNS_S = 0.01
"""The controller turns it: an actuator of 15 Hz lags by some 18 ms and meets its turned command within 4 of
them; twice as much and a sample's delay are allowed for."""
PROGRAM_STOPS_S = 0.08
"""This program stops it: a pass, a block, two round trips of 10 ms, and the actuator's lag."""
SLOW_SHARE = 0.1
"""With this share of the speed the piston creeps where this program stops it, not the controller."""


def turned_peak_kN(table: ZeroTable, stiffness_kN_per_mm: float) -> float:  # noqa: N802 - the unit keeps its capital
    """Return the greatest force over that at rest of a touch that the controller turns [kN].

    Parameters
    ----------
    table : ZeroTable
        Touch force (the most there is where it follows from the noise) and speed.
    stiffness_kN_per_mm : float
        Of the machine; 0 where it is not known.
    """
    return _peak_kN(table, stiffness_kN_per_mm, CONTROLLER_TURNS_S)


def met_peak_kN(table: ZeroTable, stiffness_kN_per_mm: float) -> float:  # noqa: N802 - as above
    """Return that of a specimen which is met before the piston's own zero: this program stops there."""
    return _peak_kN(table, stiffness_kN_per_mm, PROGRAM_STOPS_S)


def _peak_kN(table: ZeroTable, stiffness_kN_per_mm: float, late_s: float) -> float:  # noqa: N802 - as above
    turn_kN = TOUCH_FORCE_MAX_KN if table.touch_force_kN is None else table.touch_force_kN
    stiffness = stiffness_kN_per_mm or STIFFNESS_KN_PER_MM
    return turn_kN + stiffness * table.speed_mm_per_s * late_s
