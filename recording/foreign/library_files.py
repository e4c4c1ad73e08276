"""Common parts of the readers of channel groups (TDMS, MDF4) and workbooks."""

from __future__ import annotations

import logging
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput, how_to_add
from bufferstand.foundation.operating_system import bounded_memory
from bufferstand.recording.foreign.record import Floats, Header

MOST_MEMORY = 1 << 30
"""Bytes that a library may take for one file beyond what the process has; ten channels of an hour at 1 kHz:
300 million."""


@contextmanager
def of_library(path: Path, kind: str, place: str = "") -> Iterator[None]:
    """Turn whatever a library raises on a file that is not sound into one message.

    Raises
    ------
    BadInput
        Instead of any other exception.
    """
    try:
        with bounded_memory(MOST_MEMORY):
            yield
    except BadInput:
        raise
    except (Exception, RecursionError) as error:  # noqa: BLE001 - of broken files these libraries raise anything
        text = str(error).strip()
        detail = text.splitlines()[0] if text else type(error).__name__
        raise BadInput(
            f"damaged, or no {kind} ({detail[:120]})",
            file=path,
            place=place,
            remedy="copy it again from where it was recorded",
        ) from None


class _Hushed:
    """Takes what half-made objects of a library complain of as they go, whenever that is.

    Parameters
    ----------
    library : str
        Its name.
    others : callable
        The hook for what anything else complains of.
    """

    def __init__(self, library: str, others: Callable[[Any], object]) -> None:
        self.library, self._others = library, others

    def __call__(self, complaint: Any) -> None:
        module = str(getattr(complaint.object, "__module__", ""))
        if module.partition(".")[0] != self.library:
            self._others(complaint)


@contextmanager
def quiet(library: str) -> Iterator[None]:
    """Keep a library's log and warnings from the user: what it has to say is said by us, once."""
    hook = sys.unraisablehook
    if not (isinstance(hook, _Hushed) and hook.library == library):
        sys.unraisablehook = _Hushed(library, hook)  # for good: its objects go later, when nothing holds them
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
