"""A dead-man: something moves only while a key is held, that is, while the terminal keeps repeating it."""

from __future__ import annotations

from collections.abc import Callable

LET_GO_S = 0.5
"""A key that was not repeated for so long is let go of [s of the wall]."""
IDLE_S = 300.0
"""Nobody has touched a key for so long: it ends [s of the wall]."""


class DeadManSwitch:
    """Hears keys, and says whether one is held.

    Parameters
    ----------
    wall_s : callable
        Time of the wall [s].
    """

    def __init__(self, wall_s: Callable[[], float]) -> None:
        self._wall_s = wall_s
        self._pressed_s: float | None = None
        self._began_s = wall_s()
        self.quit = False
        """Whether ``q`` was pressed: it ends."""

    def press(self, key: str) -> None:
        """Take one character."""
        if key == "q":
            self.quit = True
        else:
            self._pressed_s = self._wall_s()

    def held(self) -> bool:
        """Return whether a key is held at this moment."""
        recent = self._pressed_s is not None and self._wall_s() - self._pressed_s < LET_GO_S
        return recent and not self.quit

    def idle(self) -> bool:
        """Return whether nobody has touched a key for long."""
        return self._wall_s() - (self._pressed_s or self._began_s) > IDLE_S
