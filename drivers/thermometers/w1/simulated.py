"""The simulated temperature sensors on a “wire”: a folder tree as the Linux kernel's w1_therm makes it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from bufferstand.drivers.instruments import SensorFaults, SimulatedSensor
from bufferstand.drivers.thermometers.ds18b20 import (
    CONVERSION_S,
    HIGHEST_COUNT,
    NO_POWER_COUNT,
    POWER_ON_COUNT,
)
from bufferstand.drivers.thermometers.simulated_scratchpad import millidegrees, scratchpad, slave_text
from bufferstand.foundation import BadInput

MASTER = "w1_bus_master1"
TRIGGER = b"trigger\n"
_FILES = ("w1_slave", "temperature")


class W1Tree:
    """One folder a sensor, rewritten atomically once a conversion.

    Parameters
    ----------
    root : Path
        The folder that stands for ``/sys/bus/w1/devices``.
    thermometers : sequence of SimulatedSensor
        They are known by their ROM.
    faults : SensorFaults

    Raises
    ------
    BadInput
        If the folder cannot be made.
    """

    def __init__(self, root: Path, thermometers: Sequence[SimulatedSensor], faults: SensorFaults) -> None:
        self.root = root
        self._thermometers = thermometers
        self._faults = faults
        self._bulk = root / MASTER / "therm_bulk_read"
        self._bulk_done_s: float | None = None
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
                (root / thermometer.settings.address).mkdir(parents=True, exist_ok=True)
            self._bulk.parent.mkdir(parents=True, exist_ok=True)
            self._bulk.write_text("0\n", encoding="ascii")
        except OSError as error:
            raise BadInput(f"cannot be made: {error.strerror}", file=root, place="temperature.root") from None
        self.update(0.0)

    def obey(self, data: bytes) -> bytes:
        """Answer nothing: a folder has no line."""
        del data
        return b""

    def update(self, now_s: float) -> bytes:
        """Write what has changed by stand time ``now_s`` [s]; convert together when that is triggered."""
        self._look_at_bulk(now_s)
        for thermometer in self._thermometers:
            settings = thermometer.settings
            fault = self._faults.at(settings.name, now_s)
            state = (thermometer.conversions, fault)
            if self._shown.get(settings.address) == state or fault == "frozen":
                continue
            self._shown[settings.address] = state
            folder = self.root / settings.address
            if fault == "stale":
                self._hang(folder)
                continue
            self._release(folder)
            slave, value = faulty_texts(fault, thermometer.count)
            if slave is None:
                for name in _FILES:
                    (folder / name).unlink(missing_ok=True)
                    self._texts.pop(folder / name, None)
                continue
            self._show(folder / "w1_slave", slave)
            self._show(folder / "temperature", value)
            mode = 0o000 if fault == "unreadable" else 0o644
            for name in _FILES:
                (folder / name).chmod(mode)
        return b""

    def _hang(self, folder: Path) -> None:
        """Let whoever reads a sensor wait without end, as on a bus that hangs: pipes instead of files."""
        for name in _FILES:
            path = folder / name
            if not path.is_fifo():
                path.unlink(missing_ok=True)
                os.mkfifo(path)
            self._texts.pop(path, None)

    @staticmethod
    def _release(folder: Path) -> None:
        """End the wait of whoever reads a sensor that hangs; it reads nothing then."""
        for path in (folder / name for name in _FILES):
            if path.is_fifo():
                with suppress(OSError):  # nobody waits there
                    os.close(os.open(path, os.O_WRONLY | os.O_NONBLOCK))

    def _look_at_bulk(self, now_s: float) -> None:
        """Obey ``trigger`` as the kernel does: −1 while all convert, then 1; anything else is ignored.

        A plain file cannot block the writer, nor tell that a sensor was read: 1 stays until the next trigger.
        """
        if self._bulk_done_s is None and self._bulk.read_bytes().startswith(TRIGGER):
            self._bulk_done_s = now_s + CONVERSION_S
            self._bulk.write_text("-1\n", encoding="ascii")
        elif self._bulk_done_s is not None and now_s >= self._bulk_done_s:
            self._bulk_done_s = None
            self._bulk.write_text("1\n", encoding="ascii")

    def _show(self, path: Path, text: str) -> None:
        if self._texts.get(path) != text:  # renaming is slow on many file systems
            _replace(path, text)
            self._texts[path] = text

    def close(self) -> None:
        """Take the tree away, and the folders that are empty then."""
        for thermometer in self._thermometers:
            folder = self.root / thermometer.settings.address
            self._release(folder)
            for name in _FILES:
                (folder / name).unlink(missing_ok=True)
            with suppress(OSError):
                folder.rmdir()
        self._bulk.unlink(missing_ok=True)
        for folder in (self._bulk.parent, self.root):
            with suppress(OSError):
                folder.rmdir()


def faulty_texts(fault: str | None, counts: int) -> tuple[str | None, str]:
    """Return what ``w1_slave`` and ``temperature`` show of a sensor with a fault; None for no files at all.

    Parameters
    ----------
    fault : str or None
        Name of the fault; None for a sensor as it should be.
    counts : int
        Its temperature in 1/16 °C.
    """
    data = scratchpad(counts)
    match fault:
        case "silent" | "shorted" | "unfinished" | "unpowered":
            return "", ""  # what current kernels give for a bus or CRC error
        case "missing":
            return None, ""
        case "garbled":
            return "no scratchpad\n", "warm\n"
        case "crc":  # an old kernel: it says NO
            return slave_text(bytes((data[0] ^ 0x04,)) + data[1:]), ""
        case "crc-mismatch":  # disturbed between kernel and reader
            wrong = bytes((data[0] ^ 0x04,)) + data[1:]
            return slave_text(wrong).replace("NO", "YES"), f"{millidegrees(wrong)}\n"
        case "all-zero":
            data = bytes(9)
        case "power-on":
            data = scratchpad(POWER_ON_COUNT, power_on=True)
        case "no-power":
            data = scratchpad(NO_POWER_COUNT)
        case "out-of-range":
            data = scratchpad(HIGHEST_COUNT + 160)
    return slave_text(data), f"{millidegrees(data)}\n"


def _replace(path: Path, text: str) -> None:
    """Write a file so that a reader sees the old text or the new one, never a part."""
    fresh = path.with_name(f".{path.name}.new")
    fresh.write_text(text, encoding="ascii")
    os.replace(fresh, path)  # noqa: PTH105 - the atomic call by its own name
