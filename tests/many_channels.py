"""The sample stand with other channels of its controller: fewer or more draw wires, further quantities."""

from __future__ import annotations

from pathlib import Path

from bufferstand.drivers.register_maps.profile import SHIPPED
from tests.clean_stand import SAMPLE_STAND, clean_stand_text

_SAMPLE = '"stroke_1:u16", "stroke_2:u16", "position:i16", "command:i16"'
_WIRE = """
[[controller.channel]]
name = "stroke_{number}"
quantity = "stroke"
unit = "mm"
place = "draw wire {number}"
calibration = {{ id = "WDS-500-000{number}", coefficients = [-50.0, 0.00762939453125] }}
uncertainty = {{ linearity = 0.25, zero = 0.05, u_delay_s = 2e-5 }}
"""
FURTHER = """
[[controller.channel]]
name = "pressure_1"
quantity = "pressure"
unit = "bar"
place = "cylinder"
delay_s = 0.001
calibration = { id = "P-1", coefficients = [0.0, 0.01], certificate = "simulated" }

[[controller.channel]]
name = "acceleration_1"
quantity = "acceleration"
unit = "m/s²"
place = "piston"
calibration = { id = "A-1", coefficients = [0.0, 0.01], certificate = "simulated" }
"""


def stand_with(folder: Path, *, wires: int, further: bool = False, text: str | None = None) -> Path:
    """Write the clean sample stand with so many draw wires, and its register profile beside it.

    Parameters
    ----------
    folder : Path
    wires : int
        1 to 4.
    further : bool
        Whether it samples ``pressure_1`` and ``acceleration_1``, too.
    text : str, optional
        Stand file to begin with, instead of the clean one.
    """
    sampled = [f"stroke_{number}:u16" for number in range(1, wires + 1)] + ["position:i16", "command:i16"]
    sampled += ["pressure_1:u16", "acceleration_1:i16"] if further else []
    profile = (SHIPPED / "ring.toml").read_text(encoding="utf-8")
    assert _SAMPLE in profile
    written = ", ".join(f'"{one}"' for one in sampled)
    (folder / "ring.toml").write_text(profile.replace(_SAMPLE, written), encoding="utf-8")
    stand = (clean_stand_text() if text is None else text).replace(
        'profile = "ring"', 'profile = "ring.toml"'
    )
    stand = stand.replace('model = "models/', f'model = "{SAMPLE_STAND.parent}/models/')
    head, *channels = stand.partition("\n[amplifier]")[0].split("\n[[controller.channel]]")
    channels = [one for one in channels if 'name = "stroke_2"' not in one or wires > 1]
    added = [_WIRE.format(number=number) for number in range(3, wires + 1)] + [FURTHER] * further
    controller = "\n[[controller.channel]]".join([head, *channels]) + "".join(added)
    path = folder / "stand.toml"
    path.write_text(controller + "".join(stand.partition("\n[amplifier]")[1:]), encoding="utf-8")
    return path
