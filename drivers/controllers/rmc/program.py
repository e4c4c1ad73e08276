"""The variables by which this software and the watchdog program on the RMC talk to each other.

The program is ``watchdog_program.txt`` beside this file: what a lab loads with RMCTools.
"""

from __future__ import annotations

from pathlib import Path

TEST_VALUE = -1234.5
"""What variable ``test`` holds while the program is loaded: tells a wrong word order, too."""
NAMES = (
    "test",
    "edition",
    "beat",
    "watchdog_s",
    "left_s",
    "trips",
    "force_limit",
    "stroke_limit",
    "cause",
    "writer",
    "clear",
    "release_speed",
    "alive",
    "sequence",
    "simulated",
    "number",
    "turn_force",
    "turn_speed",
    "cycle",
    "cycle_fraction",
    "angle",
    "amplitude",
    "frequency",
    "offset",
)
"""Variables in their order; the last six are the status block of Sine Start (72), p. 779."""
AT = {name: number for number, name in enumerate(NAMES)}
VARIABLES_USED = len(NAMES)
EDITION = 1
SINE_BLOCK = AT["cycle"]
RELEASE_SPEED_mm_per_s = 20.0
"""With which the program takes the force away."""


def program_text() -> str:
    """Return the watchdog program, to be entered with RMCTools; it was not confirmed on hardware."""
    return (Path(__file__).parent / "watchdog_program.txt").read_text(encoding="utf-8")
