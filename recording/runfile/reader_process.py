"""The process that reads run files with HDF5 for another one, which may end it at any time.

HDF5 trusts what it reads: one turned bit, or a file made for it, can have its library run in circles for
ever, crash, or want gigabytes. No thread can stop it, as it runs in C. So this process has a bound of
processor time for each request, and one of memory; and it dies with the one that asks, even while HDF5 runs.

A request is a line of JSON. A reply is frames of a byte, a length (8 bytes, little endian) and as much
content: ``J`` for JSON, ``D`` for bytes. It begins with a ``J``; a ``J`` with ``refused`` ends it.
"""

from __future__ import annotations

import json
import os
import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.foundation.operating_system import bound_processor_time, bound_reader
from bufferstand.recording.runfile.content_checks import stated_faults
from bufferstand.recording.runfile.reading import (
    blocks_of,
    damage_named,
    document_text,
    open_tree,
    opened_tree,
)
from bufferstand.recording.runfile.structure import StoredDataset, datasets_of

HEAD = struct.Struct("<cQ")
INLINE_BYTES = 8 << 20
"""Numbers of so many bytes come with the reply to ``open``."""


class ReaderServer:
    """Answers requests; the file that was asked for last stays open."""

    def __init__(self, out: int) -> None:
        self._out = out
        self._tree: Any = None
        self._of: tuple[str, list[int]] | None = None
        self._datasets: dict[str, StoredDataset] = {}

    def answer(self, request: dict[str, Any]) -> None:
        """Answer one request; what is wrong with the file is the answer."""
        path = Path(request["path"])
        try:
            with damage_named(path):
                getattr(self, f"_{request['do']}")(path, request)
        except BadInput as error:
            self._refuse(error.problem, error.place, error.remedy)
        except MemoryError:
            self._refuse("it wants more memory than reading a run file may take", "", "do not evaluate it")

    def _document(self, path: Path, _: dict[str, Any]) -> None:
        with open_tree(path) as tree:
            text = document_text(tree, path)
        self._say({})
        self._send(b"D", text)

    def _open(self, path: Path, request: dict[str, Any]) -> None:
        """Check everything; then the document, and, where they are few and wanted, all numbers."""
        self._close()
        stamp = stamp_of(path)
        self._tree = opened_tree(path)
        text = document_text(self._tree, path)
        self._datasets = datasets_of(self._tree, path)
        total = sum(dataset.nbytes for dataset in self._datasets.values())
        kept: list[tuple[str, NDArray[Any]]] = []
        inline = bool(request["numbers"]) and total <= INLINE_BYTES
        faults = stated_faults(
            self._datasets, text, path, (lambda *rows: kept.append(rows)) if inline else None
        )
        self._of = str(path), stamp
        order = {place: number for number, place in enumerate(self._datasets)}
        self._say(
            {
                "faults": [[fault.place, fault.text] for fault in faults],
                "columns": [[p, d.dtype.str, list(d.shape)] for p, d in self._datasets.items()],
                "stamp": stamp,
                "inline": inline and not faults,
            }
        )
        self._send(b"D", text)
        if not faults:
            for _, block in sorted(kept, key=lambda part: order[part[0]]):
                self._send(b"D", block.reshape(-1).view(np.uint8).data)

    def _column(self, path: Path, request: dict[str, Any]) -> None:
        """Rows of a dataset of a file that was opened, and found right, with the same stamp."""
        if stamp_of(path) != request["stamp"]:
            raise BadInput("it was changed while it was in use", file=path, remedy="give the command again")
        if self._of != (str(path), request["stamp"]):
            self._close()
            self._tree = opened_tree(path)
            self._datasets = datasets_of(self._tree, path)
            self._of = str(path), request["stamp"]
        place, rows = request["place"], tuple(request["rows"])
        self._say({})
        for block in blocks_of(self._datasets[place], path, place, rows):
            self._send(b"D", block.reshape(-1).view(np.uint8).data)

    def _close(self) -> None:
        if self._tree is not None:
            self._datasets, self._of = {}, None
            self._tree.close()
            self._tree = None

    def _refuse(self, problem: str, place: str, remedy: str) -> None:
        self._say({"refused": {"problem": problem, "place": place, "remedy": remedy}})

    def _say(self, said: dict[str, Any]) -> None:
        self._send(b"J", orjson.dumps(said))

    def _send(self, kind: bytes, content: Any) -> None:
        view = memoryview(content).cast("B")
        for part in (memoryview(HEAD.pack(kind, len(view))), view):
            left = part
            while left:
                left = left[os.write(self._out, left) :]


def stamp_of(path: Path) -> list[int]:
    """Return what tells that a file is the one that was opened.

    Raises
    ------
    BadInput
        If it is gone.
    """
    try:
        facts = path.stat()
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=path, remedy="check the path") from None
    return [facts.st_size, facts.st_mtime_ns, facts.st_ino]


def serve(alive: int, memory_bytes: int) -> None:
    """Answer requests from standard input until it ends."""
    bound_reader(alive, memory_bytes)
    out = os.dup(sys.stdout.fileno())
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what a library prints is no reply
    server = ReaderServer(out)
    for line in sys.stdin.buffer:
        request = json.loads(line)  # a path that is no UTF-8 is no JSON for orjson
        bound_processor_time(request["seconds"])
        server.answer(request)
        bound_processor_time(0.0)


if __name__ == "__main__":
    serve(int(sys.argv[2]), int(sys.argv[1]))
