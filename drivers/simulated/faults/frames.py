"""The effect of faults on the frames that a simulated device sends and receives."""

from __future__ import annotations

from collections.abc import Callable

from bufferstand.drivers.simulated.faults.schedule import FaultSchedule

MOST_ALTERED = 5
"""Most bytes that are altered in one frame."""


class FrameFaults:
    """Loses, delays, alters, doubles and reorders what one device sends; loses and alters what it hears.

    Parameters
    ----------
    faults : FaultSchedule
    target : str
        The device.
    now_s : callable
        Present stand time [s].
    """

    def __init__(self, faults: FaultSchedule, target: str, now_s: Callable[[], float]) -> None:
        self._faults = faults
        self._target = target
        self._now_s = now_s
        self._held: list[bytes] = []

    def arrivals(self, frame: bytes) -> list[tuple[float, bytes]]:
        """Return what arrives when a frame is sent: after how long [s of the wall], and its bytes."""
        now_s = self._now_s()
        if self._faults.strikes(self._target, "drop", now_s):
            return self._released()
        if frame and self._faults.strikes(self._target, "corrupt", now_s):
            frame = self._altered(frame)
        if self._faults.strikes(self._target, "reorder", now_s):
            released = self._released()
            self._held.append(frame)
            return released
        if delay := self._faults.strikes(self._target, "delay", now_s):
            return [*self._released(), (delay.number("delay_s"), frame)]
        times = 2 if self._faults.strikes(self._target, "duplicate", now_s) else 1
        return [(0.0, frame)] * times + self._released()

    def heard(self, frame: bytes) -> bytes | None:
        """Return what the device hears of a request; None where it is lost on its way."""
        now_s = self._now_s()
        if self._faults.strikes(self._target, "request-drop", now_s):
            return None
        altered = frame and self._faults.strikes(self._target, "request-corrupt", now_s)
        return self._altered(frame) if altered else frame

    def exception(self) -> int | None:
        """Return the code of the Modbus exception with which a request is to be answered, if so."""
        fault = self._faults.strikes(self._target, "exception", self._now_s())
        return None if fault is None else int(fault.number("code"))

    def _released(self) -> list[tuple[float, bytes]]:
        held, self._held = self._held, []
        return [(0.0, frame) for frame in held]

    def _altered(self, frame: bytes) -> bytes:
        random, altered = self._faults.random, bytearray(frame)
        for at in random.sample(range(len(altered)), random.randint(1, min(MOST_ALTERED, len(altered)))):
            altered[at] ^= random.randint(1, 255)
        return bytes(altered)
