"""Checks the contents of a run file, whatever its bytes are."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import h5py
import numpy as np

from bufferstand.foundation import BadInput
from bufferstand.recording.runfile.metadata import check_document, check_format, is_unaltered
from bufferstand.recording.runfile.reading import column_blocks, open_tree, read_document


@dataclass(frozen=True)
class ContentFault:
    """One thing that was found.

    ``fault``: the file is damaged or altered and must not be trusted. ``note``: the file is as it was
    sealed, and the recording itself is not complete (gaps, a crash, a stop).
    """

    level: Literal["fault", "note"]
    place: str
    text: str


def content_faults(path: Path) -> list[ContentFault]:
    """Compare the metadata document and every dataset with their hashes; independent of the file's bytes.

    Raises
    ------
    BadInput
        If it cannot be opened, or is no run file or one of a newer format.
    """
    with open_tree(path) as tree:
        document = read_document(tree, path)
        check_format(document, path)
        faults = []
        if not is_unaltered(document):
            faults.append(ContentFault("fault", "metadata", "the metadata were altered"))
        datasets = document.get("datasets")
        if not isinstance(datasets, dict):
            return [*faults, ContentFault("fault", "metadata: datasets", "the list of datasets is missing")]
        for place, facts in datasets.items():
            faults += _dataset_faults(tree, path, place, facts)
        present: list[str] = []
        tree.visititems(lambda name, item: present.append(name) if isinstance(item, h5py.Dataset) else None)
        faults += [
            ContentFault("fault", name, "a dataset that was not sealed with the rest")
            for name in sorted(set(present) - set(datasets))
        ]
        try:
            check_document(document, path)
        except BadInput as error:
            faults.append(ContentFault("fault", error.place, error.problem))
    return faults


def _dataset_faults(tree: Any, path: Path, place: str, facts: Mapping[str, Any]) -> list[ContentFault]:
    digest = hashlib.sha256()
    try:
        for block in column_blocks(tree, path, place, facts):
            digest.update(np.ascontiguousarray(block).data)
    except BadInput as error:
        return [ContentFault("fault", place, error.problem)]
    if digest.hexdigest() != facts.get("sha256"):
        return [ContentFault("fault", place, "the numbers are not those that were sealed (SHA-256)")]
    return []
