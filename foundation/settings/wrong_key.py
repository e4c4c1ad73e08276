"""Reports the error of a check on a whole table at the key that is wrong."""

from __future__ import annotations

from collections.abc import Container

Place = tuple[str | int, ...]


class WrongKeyError(ValueError):
    """Raised by a validator of a table: the message names the key's line, not that of the table's head.

    Parameters
    ----------
    text : str
        What is wrong; what to do, parted by “; ”.
    *keys : str or tuple of str and int
        The keys that are at fault together, the one to be changed first. Where a key holds tables, the way
        to the key in one of them: ``("channel", 0, "unit")``.
    """

    def __init__(self, text: str, *keys: str | Place) -> None:
        super().__init__(text)
        self._places = [(key,) if isinstance(key, str) else key for key in keys]

    def place(self, written: Container[str | int]) -> Place:
        """Return the way to the first of the keys that is written in the table; empty where none is."""
        return next((place for place in self._places if place[0] in written), ())
