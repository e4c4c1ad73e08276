"""The witness: sees some 50 times a second what a controller does and what its registers hold; only reads."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

from tests.two_programs.registers import (
    ADDRESSES,
    CONTROL,
    OPERATION_ENABLED,
    STATES,
    STATUS,
    WRITTEN,
    ReadOnlyClient,
    decode,
)

PERIOD_S = 0.02
ZERO_FORCE_kN = 1.0
"""Noise of the simulated transducer is 0.15 kN; a release ends below 0.2 kN (docs/simulated-stand.md)."""


@dataclass(frozen=True)
class Look:
    """What one look at the controller showed."""

    time_s: float
    """Of the computer's monotonic clock, before the first request."""
    values: dict[str, float]

    @property
    def force_kN(self) -> float:  # noqa: N802 - the unit's own capitals
        return self.values["force_kN"]

    @property
    def state(self) -> int:
        return int(self.values["state"])

    @property
    def valve_on(self) -> bool:
        return bool(int(self.values["status_word"]) & OPERATION_ENABLED)

    @property
    def safe(self) -> bool:
        """No force, and the valve off."""
        return not self.valve_on and abs(self.force_kN) <= ZERO_FORCE_kN

    def __str__(self) -> str:
        valve = "on" if self.valve_on else "off"
        return (
            f"{STATES[self.state]}, {self.force_kN:.1f} kN at {self.values['position_mm']:.1f} mm, "
            f"valve {valve}, fault {self.values['fault_code']:.0f}, writer {self.values['writer']:.0f}"
        )


class Witness:
    """Looks at a controller from a thread of its own until it is closed."""

    def __init__(self, port: int) -> None:
        self._client = ReadOnlyClient(port)
        self._looks: list[Look] = []
        self._ending = threading.Event()
        self.failure: str | None = None
        self._look()
        self._thread = threading.Thread(target=self._watch, name="witness", daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._ending.set()
        self._thread.join(30.0)
        self._client.close()

    @property
    def now(self) -> Look:
        """The newest look."""
        return self._looks[-1]

    def looks(self, from_s: float = 0.0, to_s: float = float("inf")) -> list[Look]:
        """Return what was seen within a time."""
        return [look for look in self._looks[:] if from_s <= look.time_s <= to_s]

    def wait_for(
        self, what: Callable[[Look], bool], timeout_s: float, alive: Callable[[], bool] = lambda: True
    ) -> Look | None:
        """Return the first look from now on that shows it; None after the time, or when nobody lives.

        Args:
            what: Says whether a look shows it.
            timeout_s: Patience [s].
            alive: Is asked all the time; after a no there is one look more.
        """
        place, end_s = len(self._looks) - 1, time.monotonic() + timeout_s
        while True:
            over = time.monotonic() > end_s or not alive() or self.failure is not None
            while place < len(self._looks):
                if what(self._looks[place]):
                    return self._looks[place]
                place += 1
            if over:
                return None
            time.sleep(PERIOD_S / 2)

    def safe_since(self, after_s: float) -> float | None:
        """Return when force and valve were gone for good after an instant; None where they are not.

        For good: until somebody switched on anew, at least for the two looks that follow.
        """
        looks = self.looks(after_s)
        for place, look in enumerate(looks):
            if look.safe and all(later.safe for later in looks[place : place + 3]):
                return look.time_s
        return None

    def cut_off(self, from_s: float, to_s: float = float("inf")) -> Iterator[Look]:
        """Give each look that is the first with the valve off, and still shows force: nobody released it."""
        looks = self.looks(from_s, to_s)
        for before, after in pairwise(looks):
            if before.valve_on and not after.valve_on and abs(after.force_kN) > 2.0 * ZERO_FORCE_kN:
                yield after

    def changed(self) -> Iterator[tuple[str, float, float]]:
        """Give each change of a register that only programs write: its name, and the looks between [s]."""
        looks = self.looks()
        for before, after in pairwise(looks):
            for name in WRITTEN:
                if before.values[name] != after.values[name]:
                    yield name, before.time_s, after.time_s

    def _watch(self) -> None:
        try:
            while not self._ending.wait(PERIOD_S):
                self._look()
        except (OSError, KeyError) as error:
            self.failure = str(error)

    def _look(self) -> None:
        time_s = time.monotonic()
        words: dict[int, int] = {}
        for first, count in (STATUS, CONTROL):
            words |= self._client.read(first, count)
        names = (name for name, (address, _) in ADDRESSES.items() if address in words)
        self._looks.append(Look(time_s, {name: decode(name, words) for name in names}))
