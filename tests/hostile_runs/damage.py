"""Damage on which HDF5's library runs in circles, and where the next bits of it may be."""

from __future__ import annotations

import struct
from pathlib import Path

import h5py

from bufferstand.recording.runfile import write_run
from tests.hostile_runs.crafting import seal
from tests.recording import samples

_HEAP = b"GCOL"
_OBJECT = struct.Struct("<HHIQ")


def small_run(path: Path) -> Path:
    """Write a run whose document lies in one heap with all other texts, as of a recording without samples."""
    metadata = samples.metadata(path.stem, status="complete")
    metadata["streams"] = {"temperature_1": metadata["streams"]["temperature_1"]}
    write_run(path, metadata, {})
    path.chmod(0o644)
    return path


def circle(path: Path, *, sealed: bool) -> Path:
    """Turn one bit of a run of :func:`small_run`: the free rest of its heap is 0 bytes long then, for ever.

    The heap of texts (HDF5 File Format Specification, III.E Global Heap) has no check sum.
    """
    data = bytearray(path.read_bytes())
    begin = data.index(_HEAP)
    place = begin + 16
    while (found := _OBJECT.unpack_from(data, place))[0]:
        place += _OBJECT.size + -(-found[3] // 8) * 8
    length = found[3]
    data[place + 8 : place + 16] = (length ^ (1 << 8)).to_bytes(8, "little")
    path.write_bytes(data)
    if sealed:
        seal(path)
    return path


def structure_of(path: Path) -> list[int]:
    """Return the places of all bytes that are HDF5's own: what is left beside user block and numbers."""
    numbers: list[range] = []

    def take(_: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and item.chunks:
            for number in range(item.id.get_num_chunks()):
                chunk = item.id.get_chunk_info(number)
                numbers.append(range(chunk.byte_offset, chunk.byte_offset + chunk.size))

    with h5py.File(path) as tree:
        tree.visititems(take)
    return [place for place in range(512, path.stat().st_size) if not any(place in part for part in numbers)]
