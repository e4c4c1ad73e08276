"""Reading the run file's HDF5 tree: each dataset is checked against what the metadata say of it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from foundation.errors import BadInput

RESTORE = "restore the file from a copy"


@contextmanager
def open_tree(path: Path) -> Iterator[Any]:
    """Open a run file for reading; sealed files do not change, so no lock is taken.

    Raises
    ------
    BadInput
        If there is no such file or it is no readable HDF5.
    """
    if not path.is_file():
        raise BadInput("no such file", file=path, remedy="check the path")
    try:
        tree = h5py.File(path, "r", locking=False)
    except OSError as error:
        if not h5py.is_hdf5(path):
            remedy = "name a run file (*.h5); “bufferstand import” makes one of a foreign record"
            raise BadInput(
                "no HDF5 file", file=path, remedy=f"{remedy}; of a damaged one, {RESTORE}"
            ) from None
        raise BadInput(f"no HDF5 file, or damaged ({_short(error)})", file=path, remedy=RESTORE) from None
    try:
        yield tree
    except (OSError, RuntimeError, ValueError, KeyError, TypeError) as error:  # h5py on broken structure
        raise BadInput(f"damaged: {_short(error)}", file=path, remedy=RESTORE) from None
    finally:
        tree.close()


def read_document(tree: Any, path: Path) -> dict[str, Any]:
    """Return the metadata document of an open file, not yet checked.

    Raises
    ------
    BadInput
        If there is none or it is no JSON document.
    """
    if "metadata" not in tree.attrs:
        raise BadInput(
            "not a run file of bufferstand (no metadata attribute)",
            file=path,
            remedy="foreign records are read by “bufferstand import”",
        )
    try:
        document = json.loads(tree.attrs["metadata"])
    except (ValueError, TypeError):
        raise BadInput("the metadata are no JSON", file=path, place="metadata", remedy=RESTORE) from None
    if not isinstance(document, dict):
        raise BadInput("the metadata are no JSON document", file=path, place="metadata", remedy=RESTORE)
    return document


def read_column(tree: Any, path: Path, place: str, facts: Mapping[str, Any]) -> NDArray[Any]:
    """Return a dataset that is as the metadata document says.

    Raises
    ------
    BadInput
        If it is missing, cannot be read, or has another type, length or unit.
    """
    if not isinstance(tree.get(place), h5py.Dataset):
        raise BadInput("the dataset is missing", file=path, place=place, remedy=RESTORE)
    dataset = tree[place]
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
    try:
        values: NDArray[Any] = np.asarray(dataset[()])
    except OSError as error:
        raise BadInput(f"cannot be read: {_short(error)}", file=path, place=place, remedy=RESTORE) from None
    return values


def _short(error: Exception) -> str:
    return str(error).splitlines()[0] if str(error) else type(error).__name__
