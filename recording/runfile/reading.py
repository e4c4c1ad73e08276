"""Reading the run file's HDF5 tree: the document, and each dataset as the document says that it is.

What is here reads with HDF5 itself. Where a file comes from is not known: only the process that may be ended
does so (:mod:`bufferstand.recording.runfile.reader_process`), and the one that has just written the file.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import orjson
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.recording.runfile.structure import (
    MOST_DOCUMENT_BYTES,
    RESTORE,
    StoredDataset,
    text_attribute,
)

_BYTES_AT_ONCE = 8 << 20
_BROKEN = (OSError, RuntimeError, ValueError, KeyError, TypeError, OverflowError)
"""What h5py raises on a broken structure."""


@contextmanager
def open_tree(path: Path) -> Iterator[Any]:
    """Open a run file for reading; sealed files do not change, so no lock is taken.

    Raises
    ------
    BadInput
        If there is no such file or it is no readable HDF5.
    """
    tree = opened_tree(path)
    try:
        with damage_named(path):
            yield tree
    finally:
        tree.close()


def opened_tree(path: Path) -> Any:
    """Open a run file as :func:`open_tree`; who asks closes it."""
    try:
        return h5py.File(path, "r", locking=False)
    except _BROKEN as error:
        if not h5py.is_hdf5(path):
            remedy = "name a run file (*.h5); “bufferstand import” makes one of a foreign record"
            raise BadInput(
                "no HDF5 file", file=path, remedy=f"{remedy}; of a damaged one, {RESTORE}"
            ) from None
        raise BadInput(f"no HDF5 file, or damaged ({_short(error)})", file=path, remedy=RESTORE) from None


@contextmanager
def damage_named(path: Path) -> Iterator[None]:
    """Make of what h5py raises in a ``with`` block a message about the file.

    Raises
    ------
    BadInput
    """
    try:
        yield
    except _BROKEN as error:
        raise BadInput(f"damaged: {_short(error)}", file=path, remedy=RESTORE) from None


def document_text(tree: Any, path: Path) -> bytes:
    """Return the metadata document of an open file as it is stored, not yet checked.

    Raises
    ------
    BadInput
        If there is none.
    """
    if not h5py.h5a.exists(tree.id, b"metadata"):
        raise BadInput(
            "not a run file of bufferstand (no metadata attribute)",
            file=path,
            remedy="foreign records are read by “bufferstand import”",
        )
    text = text_attribute(tree.id, b"metadata", MOST_DOCUMENT_BYTES)
    if text is None:
        raise BadInput(
            "the metadata are no text, or none of a length that a run has",
            file=path,
            place="metadata",
            remedy=RESTORE,
        )
    return text.encode("utf-8", "surrogateescape")


def parsed_document(text: bytes, path: Path) -> dict[str, Any]:
    """Return a metadata document, not yet checked.

    Raises
    ------
    BadInput
        If it is no JSON document.
    """
    try:
        document = orjson.loads(text)
    except ValueError:
        raise BadInput("the metadata are no JSON", file=path, place="metadata", remedy=RESTORE) from None
    if not isinstance(document, dict):
        raise BadInput("the metadata are no JSON document", file=path, place="metadata", remedy=RESTORE)
    return document


def refuse_other_facts(dataset: StoredDataset, facts: Mapping[str, Any], path: Path, place: str) -> None:
    """Refuse a dataset whose type, length or unit is another than the metadata document says.

    Raises
    ------
    BadInput
    """
    units = dataset.units()
    if units != facts.get("units"):
        found = "has no unit" if units is None else f"is in “{units}”"
        problem = f"the dataset {found}, its metadata say “{facts.get('units')}”"
    elif dataset.dtype.str != facts.get("dtype") or dataset.shape[0] != facts.get("rows"):
        problem = (
            f"{dataset.shape[0]} rows of {dataset.dtype.str}, its metadata say {facts.get('rows')} of "
            f"{facts.get('dtype')}"
        )
    else:
        return
    raise BadInput(problem, file=path, place=place, remedy=RESTORE)


def blocks_of(
    dataset: StoredDataset, path: Path, place: str, rows: tuple[int, int] | None = None
) -> Iterator[NDArray[Any]]:
    """Return a dataset, or its rows from one to before another, in whole chunks of some MiB.

    Raises
    ------
    BadInput
        If it cannot be read.
    """
    first, end = (0, dataset.shape[0]) if rows is None else rows
    chunk = dataset.chunk_rows or 1
    step = chunk * max(1, _BYTES_AT_ONCE // (dataset.row_bytes * chunk))
    while first < end:
        until = min(end, (first // step + 1) * step)
        values: NDArray[Any] = np.empty((until - first, *dataset.shape[1:]), dtype=dataset.dtype)
        try:
            if values.shape == dataset.shape:
                dataset.id.read(h5py.h5s.ALL, h5py.h5s.ALL, values)
            else:
                space = dataset.id.get_space()
                space.select_hyperslab((first, *(0 for _ in dataset.shape[1:])), values.shape)
                dataset.id.read(h5py.h5s.create_simple(values.shape), space, values)
        except OSError as error:
            raise BadInput(
                f"cannot be read: {_short(error)}", file=path, place=place, remedy=RESTORE
            ) from None
        yield values
        first = until


def _short(error: Exception) -> str:
    return str(error).splitlines()[0] if str(error) else type(error).__name__
