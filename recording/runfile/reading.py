"""Reading the run file's HDF5 tree: each dataset is checked against what the metadata say of it."""

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

RESTORE = "restore the file from a copy"
_ROWS_AT_ONCE = 131_072
_ALL = slice(None)
_BROKEN = (OSError, RuntimeError, ValueError, KeyError, TypeError)
"""What h5py raises on a broken structure."""


@contextmanager
def open_tree(path: Path) -> Iterator[Any]:
    """Open a run file for reading; sealed files do not change, so no lock is taken.

    Raises
    ------
    BadInput
        If there is no such file or it is no readable HDF5.
    """
    tree = _opened(path)
    try:
        with _damage_named(path):
            yield tree
    finally:
        tree.close()


def _opened(path: Path) -> Any:
    if not path.is_file():
        raise BadInput("no such file", file=path, remedy="check the path")
    try:
        return h5py.File(path, "r", locking=False)
    except OSError as error:
        if not h5py.is_hdf5(path):
            remedy = "name a run file (*.h5); “bufferstand import” makes one of a foreign record"
            raise BadInput(
                "no HDF5 file", file=path, remedy=f"{remedy}; of a damaged one, {RESTORE}"
            ) from None
        raise BadInput(f"no HDF5 file, or damaged ({_short(error)})", file=path, remedy=RESTORE) from None


@contextmanager
def _damage_named(path: Path) -> Iterator[None]:
    try:
        yield
    except _BROKEN as error:
        raise _damaged(path, error) from None


def _damaged(path: Path, error: Exception) -> BadInput:
    return BadInput(f"damaged: {_short(error)}", file=path, remedy=RESTORE)


class DatasetReader:
    """Reads datasets of one run file, which is opened for each one, or once for all while it is held.

    Parameters
    ----------
    path : Path
    sealed : bool
        Whether all bytes of the file were found to be those that were sealed. What its datasets say of
        themselves was compared with the metadata document then, and is not compared again.
    """

    def __init__(self, path: Path, *, sealed: bool = False) -> None:
        self.path = path
        self._sealed = sealed
        self._tree: Any = None

    @contextmanager
    def held(self) -> Iterator[None]:
        """Keep the file open: opening it anew for every dataset costs as much as reading a small one.

        Raises
        ------
        BadInput
            As :func:`open_tree`.
        """
        if self._tree is not None:
            yield
            return
        self._tree = _opened(self.path)
        try:
            yield
        finally:
            self._tree.close()
            self._tree = None

    def document(self) -> dict[str, Any]:
        """Return the metadata document, not yet checked.

        Raises
        ------
        BadInput
            As :func:`open_tree` and :func:`read_document`.
        """
        with self.held(), _damage_named(self.path):
            return read_document(self._tree, self.path)

    def column(self, place: str, facts: Mapping[str, Any], rows: slice = _ALL) -> NDArray[Any]:
        """Return a dataset that is as the metadata document says, or some rows of it.

        Raises
        ------
        BadInput
            As :func:`read_column`.
        """
        if self._tree is None:
            with self.held():
                return self.column(place, facts, rows)
        try:
            if self._sealed and rows == _ALL:
                return _sealed_column(self._tree, place, facts)
            return read_column(self._tree, self.path, place, facts, rows)
        except _BROKEN as error:
            raise _damaged(self.path, error) from None


def read_document(tree: Any, path: Path) -> dict[str, Any]:
    """Return the metadata document of an open file, not yet checked.

    Raises
    ------
    BadInput
        If there is none or it is no JSON document.
    """
    if not h5py.h5a.exists(tree.id, b"metadata"):
        raise BadInput(
            "not a run file of bufferstand (no metadata attribute)",
            file=path,
            remedy="foreign records are read by “bufferstand import”",
        )
    try:
        document = orjson.loads(tree.attrs["metadata"])
    except (ValueError, TypeError):
        raise BadInput("the metadata are no JSON", file=path, place="metadata", remedy=RESTORE) from None
    if not isinstance(document, dict):
        raise BadInput("the metadata are no JSON document", file=path, place="metadata", remedy=RESTORE)
    return document


def read_column(
    tree: Any, path: Path, place: str, facts: Mapping[str, Any], rows: slice = _ALL
) -> NDArray[Any]:
    """Return a dataset that is as the metadata document says, or some rows of it.

    Raises
    ------
    BadInput
        If it is missing, cannot be read, or has another type, length or unit.
    """
    dataset = _dataset(tree, path, place, facts)
    try:
        values: NDArray[Any] = np.asarray(dataset[rows])
    except OSError as error:
        raise _unreadable(error, path, place) from None
    return values


def _sealed_column(tree: Any, place: str, facts: Mapping[str, Any]) -> NDArray[Any]:
    """Return a dataset of a file that was checked, without what h5py does for files of any kind."""
    dataset = h5py.h5d.open(tree.id, place.encode())
    dtype = facts["dtype"]
    # Of a text, HDF5 wants to know the encoding too.
    values: NDArray[Any] = np.empty(dataset.shape, dataset.dtype if "S" in dtype else dtype)
    dataset.read(h5py.h5s.ALL, h5py.h5s.ALL, values)
    return values


def column_blocks(tree: Any, path: Path, place: str, facts: Mapping[str, Any]) -> Iterator[NDArray[Any]]:
    """Return a dataset that is as the metadata document says, chunk by chunk.

    Raises
    ------
    BadInput
        As :func:`read_column`.
    """
    dataset = _dataset(tree, path, place, facts)
    rows = len(dataset)
    step = dataset.chunks[0] if dataset.chunks else _ROWS_AT_ONCE
    for first in range(0, rows, step):
        try:
            block: NDArray[Any] = np.asarray(dataset[first : first + step])
        except OSError as error:
            raise _unreadable(error, path, place) from None
        yield block


def _dataset(tree: Any, path: Path, place: str, facts: Mapping[str, Any]) -> Any:
    """Return a dataset of an open tree whose type, length and unit are those of the metadata document."""
    dataset = tree.get(place)
    if not isinstance(dataset, h5py.Dataset):
        raise BadInput("the dataset is missing", file=path, place=place, remedy=RESTORE)
    units = dataset.attrs.get("units")
    if units != facts.get("units"):
        found = "has no unit" if units is None else f"is in “{units}”"
        raise BadInput(
            f"the dataset {found}, its metadata say “{facts.get('units')}”",
            file=path,
            place=place,
            remedy=RESTORE,
        )
    if dataset.dtype.str != facts.get("dtype") or len(dataset) != facts.get("rows"):
        raise BadInput(
            f"{len(dataset)} rows of {dataset.dtype.str}, its metadata say {facts.get('rows')} of "
            f"{facts.get('dtype')}",
            file=path,
            place=place,
            remedy=RESTORE,
        )
    return dataset


def _unreadable(error: OSError, path: Path, place: str) -> BadInput:
    return BadInput(f"cannot be read: {_short(error)}", file=path, place=place, remedy=RESTORE)


def _short(error: Exception) -> str:
    return str(error).splitlines()[0] if str(error) else type(error).__name__
