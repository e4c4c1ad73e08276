"""The time of a controller that may be restarted: it continues by the stand's own time."""

from __future__ import annotations


class DeviceTime:
    """Turns the controller's stamps into a time that never steps back.

    Parameters
    ----------
    at_s : float
        Present stand time [s].
    """

    def __init__(self, at_s: float) -> None:
        self.at_s = at_s
        """Stand time at which the newest sample came [s]."""
        self._shift_s = 0.0
        self._goes_on: tuple[float, float] | None = None
        self._newest_us: int | None = None

    @property
    def now_s(self) -> float | None:
        """The newest time [s]; None before the first sample."""
        return None if self._newest_us is None else self._newest_us / 1e6 + self._shift_s

    def take(self, stamp_us: int, at_s: float) -> None:
        """Take the newest stamp [µs], and the stand time at which it came [s]."""
        if self._goes_on is not None:
            (before_s, was_s), self._goes_on = self._goes_on, None
            self._shift_s = before_s + at_s - was_s - stamp_us / 1e6
        self._newest_us, self.at_s = stamp_us, at_s

    def begin_anew(self) -> None:
        """Let the next stamp be as much later than the last one as stand time has passed between them."""
        if self._goes_on is None and (now_s := self.now_s) is not None:
            self._goes_on = now_s, self.at_s
