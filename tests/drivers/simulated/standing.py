"""What the tests of the simulated stand share: springs with closed forms, and a stand file."""

from __future__ import annotations

from pathlib import Path

from bufferstand.drivers.simulated.machine.device import SimulatedDevice
from bufferstand.drivers.simulated.machine.truth import TruthLog
from bufferstand.drivers.simulated.settings import simulation_settings
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile

STAND = """
[stand]
id = "simulated-630kN"
name = "Simulated servo-hydraulic stand, 630 kN"

[limits]
force_max_kN = 600.0
stroke_max_mm = 250.0
frequency_max_Hz = 2.55
speed_max_mm_per_s = 800.0

[controller]
profile = "ring"
host = "127.0.0.1"
port = 15020
device_id = 1
timeout_s = 0.5
watchdog_s = 2.0

[[controller.channel]]
name = "force"
quantity = "force"
unit = "kN"
delay_s = 0.0008
calibration = { id = "GTM-K-630-0001", coefficients = [0.0, 9.5367431640625e-05] }

[[controller.channel]]
name = "stroke_1"
quantity = "stroke"
unit = "mm"
calibration = { id = "wire-1", coefficients = [-50.0, 0.00762939453125] }

[[controller.channel]]
name = "stroke_2"
quantity = "stroke"
unit = "mm"
calibration = { id = "wire-2", coefficients = [-50.0, 0.00762939453125] }

[[controller.channel]]
name = "position"
quantity = "position"
unit = "mm"
calibration = { coefficients = [0.0, 0.01] }

[[controller.channel]]
name = "command"
quantity = "command"
unit = "mm"
calibration = { coefficients = [0.0, 0.01] }

[amplifier]
protocol = "gsv2"
port = "wires/amplifier"
rate_Hz = 250.0
range_kN = 630.0
[amplifier.channel]
name = "force_2"
quantity = "force"
unit = "kN"
delay_s = 0.002
calibration = { coefficients = [0.0, 7.885695443832332e-05] }

[temperature]
kind = "w1"
root = "wires/w1/devices"
period_s = 1.0
[[temperature.sensor]]
rom = "28-00000a3f91c2"
name = "temperature_1"
place = "spring plate 3"
[[temperature.sensor]]
rom = "28-00000a40117b"
name = "temperature_2"
place = "air beside the stand"
role = "ambient"

[simulation]
model = "spring.toml"
ambient_C = 21.0
seed = 1
"""


class LinearSpring:
    """A preloaded spring without loss: F = preload + k x in contact; warms by nothing."""

    def __init__(self, stiffness_kN_per_mm: float = 5.0, preload_kN: float = 15.0) -> None:
        self._stiffness = stiffness_kN_per_mm
        self._preload = preload_kN
        self.force_kN = 0.0
        self.temperature_C = 21.0
        self.sensor_temperature_C = 21.0
        self.heat_J = 0.0
        self.steps = 0

    def step(self, stroke_mm: float, dt_s: float) -> float:  # noqa: ARG002
        self.steps += 1
        self.force_kN = self._preload + self._stiffness * stroke_mm if stroke_mm > 0.0 else 0.0
        return self.force_kN

    def tangent_kN_per_mm(self, loading: bool) -> float:  # noqa: N802, ARG002
        return self._stiffness


class FrictionSpring:
    """A band of constant half-width about a line, crossed steeply: the model's shape, in short.

    ``F = k x + f p`` with p in [-1, 1] moving by ``dx / reach`` against saturation; the closed loop between
    two turning points further apart than a few ``reach`` has the area ``2 f (range - reach)`` nearly.
    """

    def __init__(self, stiffness: float = 5.0, friction_kN: float = 70.0, reach_mm: float = 2.0) -> None:
        self._stiffness, self._friction, self._reach = stiffness, friction_kN, reach_mm
        self._p = -1.0
        self._stroke = 0.0
        self.force_kN = 0.0
        self.temperature_C = self.sensor_temperature_C = 21.0
        self.heat_J = 0.0

    def step(self, stroke_mm: float, dt_s: float) -> float:  # noqa: ARG002
        dx = max(0.0, stroke_mm) - self._stroke
        self._stroke += dx
        self._p = min(1.0, max(-1.0, self._p + 2.0 * dx / self._reach))
        if stroke_mm <= 0.0:
            self.force_kN = 0.0
        else:
            self.force_kN = max(0.0, 80.0 + self._stiffness * stroke_mm + self._friction * self._p)
        return self.force_kN

    def tangent_kN_per_mm(self, loading: bool) -> float:  # noqa: N802
        saturated = self._p >= 1.0 if loading else self._p <= -1.0
        return self._stiffness + (0.0 if saturated else 2.0 * self._friction / self._reach)


class HandClock:
    """Wall time moved by hand."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def stand_file(folder: Path, text: str = STAND) -> StandFile:
    path = folder / "stand.toml"
    path.write_text(text, encoding="utf-8")
    return load_stand(path)


def device(
    folder: Path, spring: object = None, wall: HandClock | None = None, **settings: object
) -> SimulatedDevice:
    file = stand_file(folder)
    chosen = simulation_settings(file).model_copy(update=settings)
    return SimulatedDevice(file, chosen, spring or LinearSpring(), wall or HandClock(), TruthLog())
