"""Bounds of numbers in files on specimens, springs and requirements: beyond them no buffer or draw gear lies.

They keep out slips of the pen and hostile files, so that figures that are calculated from them are
finite. What a particular stand, campaign or curve allows is narrower, and judged where that is known.
"""

from __future__ import annotations

from bufferstand.foundation.settings.allowed_values import Within

FORCE_KN = Within(0.0, 100_000.0, "no buffer or coupler bears 100 MN")
SIGNED_FORCE_KN = Within(-100_000.0, 100_000.0, "no buffer or coupler bears 100 MN")
LENGTH_MM = Within(0.0, 10_000.0, "no buffer or draw gear is longer than 10 m")
LENGTH_SCALE_MM = Within(1e-6, 1e6, "a nanometre is less than any spring shows, 1 km far beyond its stroke")
"""Of a length over which something changes: a very large one says that it does not."""
STIFFNESS_KN_PER_MM = Within(1e-6, 1e6, "the frame of a stand has some 1000 kN/mm, and a spring less")
SLOPE_KN_PER_MM = Within(0.0, 1e6, "the frame of a stand has some 1000 kN/mm, and a spring less")
SPEED_MM_PER_S = Within(0.0, 100_000.0, "no vehicle runs onto its buffers at 100 m/s")
FREQUENCY_HZ = Within(0.0, 10_000.0, "no stand or vehicle moves a buffer at 10 kHz")
SPEED_KM_H = Within(0.0, 360.0, "no vehicle runs onto its buffers at 100 m/s")
TEMPERATURE_C = Within(-100.0, 300.0, "no spring of elastomer, rubber or steel is tested beyond")
DURATION_S = Within(0.0, 3.2e7, "a year is longer than any test")
TIME_CONSTANT_S = Within(1e-6, 3.2e7, "a microsecond is shorter than any sample, a year longer than any test")
REST_H = Within(0.0, 876_000.0, "a hundred years are more than any spring lasts")
ENERGY_J = Within(0.0, 1e9, "a train of 1000 t at 5 km/h has 1 MJ")
SHARE = Within(0.0, 1.0, "a share of something lies from 0 to 1")
COEFFICIENT = Within(-1.0, 1.0, "a coefficient of correlation lies from -1 to 1")
NOT_NEGATIVE = Within(0.0, 1e12, "no standard uncertainty of a model's parameter is so large")
CYCLES_OR_NONE = Within(0, 10_000_000, "ten million cycles take a year at 0.3 Hz")
FACTOR = Within(0.0, 1000.0, "it is a factor near 1")
PER_K = Within(0.0, 10.0, "1 per K is gone within one degree")
CYCLES = Within(1, 10_000_000, "ten million cycles take a year at 0.3 Hz")
HEAT_CAPACITY_J_PER_K = Within(1e-6, 1e12, "a tonne of steel has half a million J/K")
HEAT_LOSS_W_PER_K = Within(0.0, 1e9, "a spring in moving air gives off some 10 W/K")
LINE = Within(0, 1_000_000_000, "no file has so many lines")
COUNTS = Within(-(2.0**64), 2.0**64, "no register holds more than 64 bits")
SCALE = Within(1e-12, 1e12, "no register counts in units so small or so large")
FIGURE = Within(-1e12, 1e12, "no figure of a test, in any of its units, is so large")
"""Of a quantity that the key beside it names."""
