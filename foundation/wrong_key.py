"""What a check on a whole table finds wrong with one of its keys."""

from __future__ import annotations


class WrongKeyError(ValueError):
    """Raised by a validator of a table: the message names the key's line, not that of the table's head.

    Parameters
    ----------
    key : str or int
        The key at fault, as it is written in the table: the one that is to be changed.
    *deeper : str or int
        Where the key holds tables: the entry and its key, as ``"channel", 0, "unit"``.
    text : str
        What is wrong; what to do, parted by “; ”.
    """

    def __init__(self, key: str | int, *deeper: str | int, text: str) -> None:
        super().__init__(text)
        self.path = (key, *deeper)
