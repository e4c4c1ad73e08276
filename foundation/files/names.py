"""Names of files as text that can be written anywhere."""

from __future__ import annotations

import os
from pathlib import Path


def readable(path: Path | str) -> str:
    r"""Return a path as text for results, tables and messages.

    A name is bytes, and those that are no UTF-8 (from old archives, foreign systems) cannot be put out as
    they are: they are written as ``Pr\xfcf.h5``, which, unlike a replacement character, keeps two of them
    apart.
    """
    return os.fsencode(path).decode("utf-8", "backslashreplace")
