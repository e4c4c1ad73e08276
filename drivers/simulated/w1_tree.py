"""The simulated temperature sensors on a “wire”: a folder tree as the Linux kernel's w1_therm makes it."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from drivers.ds18b20 import POWER_ON_COUNT, crc8
from drivers.simulated.device import Thermometer
from drivers.simulated.faults import FaultSchedule
from foundation.errors import BadInput

_POWER_ON_BYTE_6 = 0x0C


def scratchpad(counts: int, *, power_on: bool = False) -> bytes:
    """Return the nine bytes of a DS18B20's scratchpad at 12 bit.

    Parameters
    ----------
    counts : int
        Temperature in 1/16 °C.
    power_on : bool
        Whether no conversion has been made yet: byte 6 of a genuine part tells it from a true 85 °C.
    """
    low, high = counts & 0xFF, counts >> 8 & 0xFF
    byte_6 = _POWER_ON_BYTE_6 if power_on else 0x10 - (low & 0x0F)
    data = bytes((low, high, 0x4B, 0x46, 0x7F, 0xFF, byte_6, 0x10))
    return data + bytes((crc8(data),))


def slave_text(data: bytes) -> str:
    """Return what the kernel shows as ``w1_slave`` for a scratchpad."""
    shown = " ".join(f"{byte:02x}" for byte in data)
    valid = "YES" if crc8(data[:8]) == data[8] else "NO"
    return f"{shown} : crc={data[8]:02x} {valid}\n{shown} t={millidegrees(data)}\n"


def millidegrees(data: bytes) -> int:
    """Return the temperature of a scratchpad in 1/1000 °C as the kernel computes it, towards zero."""
    counts = int.from_bytes(data[:2], "little", signed=True)
    return int(counts * 1000 / 16)


class W1Tree:
    """One folder a sensor, rewritten atomically once a conversion.

    Parameters
    ----------
    root : Path
        The folder that stands for ``/sys/bus/w1/devices``.
    thermometers : tuple of Thermometer
    faults : FaultSchedule

    Raises
    ------
    BadInput
        If the folder cannot be made.
    """

    def __init__(self, root: Path, thermometers: tuple[Thermometer, ...], faults: FaultSchedule) -> None:
        self.root = root
        self._thermometers = thermometers
        self._faults = faults
        self._shown: dict[str, tuple[int, str | None]] = {}
        self._texts: dict[Path, str] = {}
        if root.is_relative_to("/sys"):
            raise BadInput(
                "this is the kernel's folder of real sensors",
                file=root,
                place="temperature.root",
                remedy="give the simulated stand a folder of its own",
            )
        try:
            for thermometer in thermometers:
                (root / thermometer.settings.rom).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadInput(f"cannot be made: {error.strerror}", file=root, place="temperature.root") from None
        self.update(0.0)

    def update(self, now_s: float) -> None:
        """Write what has changed by stand time ``now_s`` [s]."""
        for thermometer in self._thermometers:
            settings = thermometer.settings
            fault = self._faults.at(settings.name, now_s)
            state = (thermometer.conversions, fault)
            if self._shown.get(settings.rom) == state:
                continue
            self._shown[settings.rom] = state
            if fault == "silent":
                slave, value = "", ""  # what current kernels give for a bus or CRC error
            else:
                power_on = fault == "power-on"
                counts = POWER_ON_COUNT if power_on else thermometer.readings[-1][1]
                data = scratchpad(counts, power_on=power_on)
                slave, value = slave_text(data), f"{millidegrees(data)}\n"
            folder = self.root / settings.rom
            self._show(folder / "w1_slave", slave)
            self._show(folder / "temperature", value)

    def _show(self, path: Path, text: str) -> None:
        if self._texts.get(path) != text:  # renaming is slow on many file systems
            _replace(path, text)
            self._texts[path] = text

    def close(self) -> None:
        """Take the tree away, and the folders that are empty then."""
        for thermometer in self._thermometers:
            folder = self.root / thermometer.settings.rom
            for name in ("w1_slave", "temperature"):
                (folder / name).unlink(missing_ok=True)
            with suppress(OSError):
                folder.rmdir()
        with suppress(OSError):
            self.root.rmdir()


def _replace(path: Path, text: str) -> None:
    """Write a file so that a reader sees the old text or the new one, never a part."""
    fresh = path.with_name(f".{path.name}.new")
    fresh.write_text(text, encoding="ascii")
    os.replace(fresh, path)  # noqa: PTH105 - the atomic call by its own name
