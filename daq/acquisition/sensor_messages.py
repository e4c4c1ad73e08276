"""Complaints of sensors: each kind reported once a run, and counted."""

from __future__ import annotations

from bufferstand.drivers import SensorFault


class SensorMessages:
    """Counts the complaints of a run; what differs in its figures alone is the same one."""

    def __init__(self) -> None:
        self._told: dict[tuple[str, str], tuple[int, str]] = {}

    def is_new(self, fault: SensorFault) -> bool:
        """Take a complaint; return whether it is the first of its kind in this run."""
        kind = fault.stream, "".join(sign for sign in fault.what if not sign.isdigit())
        times, _ = self._told.get(kind, (0, ""))
        self._told[kind] = times + 1, fault.what
        return not times

    def end(self) -> list[tuple[str, str]]:
        """Return (and forget) what came more than once: the stream, and in words how often."""
        told, self._told = self._told, {}
        return [
            (stream, f"{stream}: {times} times in this run: {what}")
            for (stream, _), (times, what) in told.items()
            if times > 1
        ]
