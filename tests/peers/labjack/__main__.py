"""Serve the emulator: ``python -m tests.peers.labjack [--product 8] [--port 5020] [--stream-port 5702]``.

Its inputs are a buffer under a harmonic stroke, as a laboratory would wire it: AIN0 the force (0 to 10 V for
0 to 630 kN), AIN1 and AIN2 two draw wires (0 to 10 V for 0 to 500 mm), AIN3 the piston, each of time.
Ends at the end of its standard input; lines there are faults: ``hold 0.5``, ``lose 3``, ``cut``.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np
from numpy.typing import NDArray

from tests.peers.labjack.emulator import LabJackEmulator

MEAN_mm, AMPLITUDE_mm, FREQUENCY_Hz = 60.0, 20.0, 1.0
STIFFNESS_kN_per_mm, LOSS_FACTOR = 4.0, 0.2


def _stroke_mm(t_s: NDArray[np.float64]) -> NDArray[np.float64]:
    return MEAN_mm + AMPLITUDE_mm * np.sin(2.0 * np.pi * FREQUENCY_Hz * t_s)


def _force_volts(t_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """A linear spring with a loss factor: a closed form of every figure."""
    angle = 2.0 * np.pi * FREQUENCY_Hz * t_s
    lagging = AMPLITUDE_mm * (np.sin(angle) + LOSS_FACTOR * np.cos(angle))
    return STIFFNESS_kN_per_mm * (MEAN_mm + lagging) / 63.0


def main() -> None:
    """Serve until told to end."""
    parser = argparse.ArgumentParser(prog="python -m tests.peers.labjack")
    parser.add_argument("--product", type=int, choices=(7, 8), default=7)
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--stream-port", type=int, default=0)
    parser.add_argument("--drift-ppm", type=float, default=0.0)
    asked = parser.parse_args()
    inputs = {0: _force_volts, **{number: lambda t_s: _stroke_mm(t_s) / 50.0 for number in (1, 2, 3)}}
    with LabJackEmulator(
        inputs,
        product=asked.product,
        drift=asked.drift_ppm * 1e-6,
        port=asked.port,
        stream_port=asked.stream_port,
    ) as emulator:
        print("ready", emulator.port, emulator.stream_port, flush=True)
        for line in sys.stdin:
            word, _, number = line.strip().partition(" ")
            if word == "hold":
                emulator.hold_packets(float(number))
            elif word == "lose":
                emulator.lose_packets(int(number))
            elif word == "cut":
                emulator.cut()


if __name__ == "__main__":
    main()
