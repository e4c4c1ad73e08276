"""Checks the contents of a run file, whatever its bytes are."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.recording.runfile.document_format import check_format, is_unaltered
from bufferstand.recording.runfile.reading import blocks_of, parsed_document, refuse_other_facts
from bufferstand.recording.runfile.structure import StoredDataset

Took = Callable[[str, NDArray[Any]], None]
"""Is given the place of a dataset and its next rows."""


@dataclass(frozen=True)
class ContentFault:
    """One thing that was found.

    ``fault``: the file is damaged or altered and must not be trusted. ``note``: the file is as it was
    sealed, and the recording itself is not complete (gaps, a crash, a stop).
    """

    level: Literal["fault", "note"]
    place: str
    text: str


def stated_faults(
    datasets: Mapping[str, StoredDataset], text: bytes, path: Path, took: Took | None = None
) -> list[ContentFault]:
    """Compare the metadata document and every dataset with the hashes that the document states.

    Parameters
    ----------
    datasets : mapping of str to StoredDataset
        All datasets of the file, by place.
    text : bytes
        Its metadata document.
    path : Path
    took : callable, optional
        What else reads the numbers.

    Raises
    ------
    BadInput
        If the document is none of a run, or of a newer format.
    """
    document = parsed_document(text, path)
    check_format(document, path)
    faults = []
    if not is_unaltered(document):
        faults.append(ContentFault("fault", "metadata", "the metadata were altered"))
    stated = document.get("datasets")
    if not isinstance(stated, dict):
        return [*faults, ContentFault("fault", "metadata: datasets", "the list of datasets is missing")]
    for place, facts in stated.items():
        faults += _faults_of(datasets.get(place), facts, path, place, took)
    return faults + [
        ContentFault("fault", place, "a dataset that was not sealed with the rest")
        for place in sorted(set(datasets) - set(stated))
    ]


def _faults_of(
    dataset: StoredDataset | None, facts: Any, path: Path, place: str, took: Took | None
) -> list[ContentFault]:
    if dataset is None:
        return [ContentFault("fault", place, "the dataset is missing")]
    if not isinstance(facts, Mapping):
        return [ContentFault("fault", place, "the metadata say nothing of the dataset")]
    digest = hashlib.sha256()
    try:
        refuse_other_facts(dataset, facts, path, place)
        for block in blocks_of(dataset, path, place):
            digest.update(block.data)
            if took is not None:
                took(place, block)
    except BadInput as error:
        return [ContentFault("fault", place, error.problem)]
    if digest.hexdigest() != facts.get("sha256"):
        return [ContentFault("fault", place, "the numbers are not those that were sealed (SHA-256)")]
    return []
