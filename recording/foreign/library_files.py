"""Common parts of the readers of channel groups (TDMS, MDF4) and workbooks."""

from __future__ import annotations

import gc
import logging
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput, how_to_add
from bufferstand.recording.foreign.record import Floats, Header


@contextmanager
def of_library(path: Path, kind: str, place: str = "") -> Iterator[None]:
    """Turn whatever a library raises on a file that is not sound into one message.

    Raises
    ------
    BadInput
        Instead of any other exception.
    """
    hook = sys.unraisablehook
    detail = ""
    try:
        yield
        return
    except BadInput:
        raise
    except Exception as error:  # noqa: BLE001 - of broken files these libraries raise anything
        text = str(error).strip()
        detail = text.splitlines()[0] if text else type(error).__name__
        sys.unraisablehook = _say_nothing
    # Only here, with the exception gone, half-made objects of the library go, and complain of themselves.
    gc.collect()
    sys.unraisablehook = hook
    raise BadInput(
        f"damaged, or no {kind} ({detail[:120]})",
        file=path,
        place=place,
        remedy="copy it again from where it was recorded",
    )


def _say_nothing(what: object) -> None:
    """Take a complaint of an object that is being discarded."""


@contextmanager
def quiet(library: str) -> Iterator[None]:
    """Keep a library's log and warnings from the user: what it has to say is said by us, once."""
    prefix = f"{library}."
    loggers = [logging.getLogger(name) for name in logging.root.manager.loggerDict if name.startswith(prefix)]
    loggers.append(logging.getLogger(library))
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", module=rf"{library}(\.|$)")
            yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def missing_library(library: str, path: Path, what: str) -> BadInput:
    """Return the message for a reader whose library is not installed."""
    return BadInput(
        f"{what} needs the library {library}, which is not installed",
        file=path,
        remedy=f"install it: {how_to_add('foreign')}",
    )


def as_numbers(samples: NDArray[Any], missing: frozenset[float]) -> Floats:
    """Return samples as floats, NaN where one is a number that means: no value.

    Such a number is compared as the samples' type holds it: -9999.9 in single precision is -9999.900391.
    """
    values = samples.astype(np.float64)
    if missing:
        kind = samples.dtype if samples.dtype.kind == "f" else np.float64
        with np.errstate(over="ignore"):
            stated = np.array(sorted(missing)).astype(kind).astype(np.float64)
        values[np.isin(values, stated[np.isfinite(stated)])] = np.nan
    return values


class Groups:
    """The groups of a record: those to read, which are those that are asked for, else all.

    Parameters
    ----------
    there : sequence of str
        All groups of the record.
    asked : sequence of str
        Those that the user names.
    path : Path
        For messages.

    Raises
    ------
    BadInput
        If one that is asked for is not there; the message lists those that are.
    """

    def __init__(self, there: Sequence[str], asked: Sequence[str], path: Path) -> None:
        for name in asked:
            if name not in there:
                raise BadInput(
                    f"--group {name}: no such group",
                    file=path,
                    remedy=f"the groups are {', '.join(f'“{group}”' for group in there) or 'none'}",
                )
        self.read = tuple(dict.fromkeys(asked or there))
        self._left_out = [name for name in dict.fromkeys(there) if name not in self.read]

    @property
    def place(self) -> str:
        """Get the place of their headers, for messages."""
        return f"group “{self.read[0]}”" if len(self.read) == 1 else f"{len(self.read)} groups"

    def header(self, group: str, name: str, unit: str, unit_from: str) -> Header:
        """Return the header of a channel; its group is part of it where several are read."""
        return Header(name, group if len(self.read) > 1 else "", unit, unit_from)

    def facts(self) -> dict[str, Any]:
        """Return which are read and which are left out, for the run file."""
        left_out = {"groups_left_out": self._left_out} if self._left_out else {}
        return {"groups": list(self.read), **left_out}
