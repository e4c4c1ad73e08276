"""Makes run files that are not what they say: a good one is changed, and its hashes and seal are made anew.

Whoever can change a file can do that, too: a seal without a key proves nothing of where a file is from.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from bufferstand.foundation.files import canonical_json, content_hash
from bufferstand.recording.runfile.layout import user_block

ROOT = Path(__file__).resolve().parents[2]
GOOD = ROOT / "sample_runs" / "runs" / "005-harmonic-20mm-20mm-1.27Hz.h5"
Change = Callable[[Any, Path], object]
"""Takes the open tree and the folder of the file, where other files may be put."""
DocumentChange = Callable[[dict[str, Any]], object]


def crafted(folder: Path, change: Change, *, truthful: bool = True, sealed: bool = True) -> Path:
    """Return a copy of a good run file with a change in its tree.

    Parameters
    ----------
    folder : Path
    change : callable
    truthful : bool
        Whether the document states the datasets, and its own hash, as they are then.
    sealed : bool
        Whether the bytes get a seal that fits.
    """
    path = folder / "run.h5"
    shutil.copyfile(GOOD, path)
    with h5py.File(path, "r+", locking=False) as tree:
        change(tree, folder)
        if truthful:
            state(tree)
    if sealed:
        seal(path)
    return path


def with_document(folder: Path, change: DocumentChange) -> Path:
    """Return a copy of a good run file with a change in its document, whose hash fits."""

    def changed(tree: Any, _: Path) -> None:
        document = json.loads(tree.attrs["metadata"])
        change(document)
        put_document(tree, document)

    return crafted(folder, changed, truthful=False)


def state(tree: Any) -> None:
    """Let the document of a tree state the datasets that can be read as they are."""
    if not isinstance(tree.attrs.get("metadata"), str):
        return
    document = json.loads(tree.attrs["metadata"])
    found: dict[str, Any] = {}

    def take(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset):
            return
        try:
            content = np.ascontiguousarray(item[()]).tobytes() if item.nbytes < 1e8 else b""
        except (OSError, TypeError, AttributeError, ValueError):
            content = b""
        units = item.attrs.get("units")
        units = units if isinstance(units, str) else None
        rows = item.shape[0] if item.shape else 0
        digest = hashlib.sha256(content).hexdigest()
        found[name] = {"dtype": item.dtype.str, "rows": rows, "units": units, "sha256": digest}

    tree.visititems(take)
    document["datasets"] = {**document["datasets"], **found}
    for name in set(document["datasets"]) - set(found):
        if name not in tree:
            del document["datasets"][name]
    put_document(tree, document)


def put_document(tree: Any, document: dict[str, Any]) -> None:
    """Write a document with the hash that fits it."""
    document.pop("content_sha256", None)
    document["content_sha256"] = content_hash(document)
    tree.attrs["metadata"] = canonical_json(document)


def seal(path: Path) -> None:
    """Give a file the user block that fits its bytes."""
    block = user_block(path)
    with path.open("r+b") as stream:
        stream.write(block)


def replaced(tree: Any, place: str, values: Any, **options: Any) -> None:
    """Put another dataset in the place of one, with its unit."""
    units = tree[place].attrs.get("units")
    del tree[place]
    made = tree.create_dataset(place, data=values, **options)
    if units is not None:
        made.attrs["units"] = units
