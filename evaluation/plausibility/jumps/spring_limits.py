"""How much the force of a spring may change from one stroke to the next, as a share (in logarithms).

A spring softens, most from the first stroke to the second, and with every kelvin. It recovers in a pause. It
does not harden. A larger change is one of the amplifier's gain.
"""

from __future__ import annotations

HARDER = 0.03
"""What grows by this share, force and area alike, has another gain …"""
RESTED, LONGER, RECOVERS_S = 0.08, 1.5, 60.0
"""… a single stroke by this one, after a pause of so many seconds and more in which a spring recovers. Pauses
are unlike that differ so many times."""
SOFTER_SINGLE, TIRED = 0.05, 0.12
"""A single stroke that shrinks by this share has, by this one after a pause that is shorter than the one
before, in which the spring has not recovered …"""
FIRST_SOFTER = 0.2
"""… by this one from the first stroke of a static test to the second."""
PER_K, STEADY_K, UNKNOWN_K = 0.02, 1.0, 5.0
"""A spring softens by this share for each kelvin at most (paper, Fig. 9: 0.37 in 50 K), from one kelvin
between two strokes on; a single stroke may have been so much warmer where no thermometer tells."""
