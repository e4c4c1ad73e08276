"""A disk that loses what was not brought to it: every state that a power cut may leave, drawn by a seed.

What POSIX promises and no more. What was done to a file before its last sync began, and a name given before
the last sync of its folder began, is there if that sync had returned before the cut. Of what was done since,
each name by itself may be there or not, each sector of 512 bytes may have any of the contents that it had
since, and the file any of its sizes: one that runs ahead of the data shows zeros.

Taken for granted, as every journaling file system has it: a rename is there or not, never half; a sector is
never mixed; a hole or reserved space reads as zeros; a disk that says it has synchronised has.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from random import Random

from tests.power_cut.tape import (
    ROOT,
    Entry,
    Gone,
    Made,
    Moved,
    Node,
    Sized,
    SyncBegins,
    Synced,
    Tape,
    Written,
)

SECTOR = 512
NAMES = Made | Gone | Moved
Nodes = dict[int, Node]


@dataclass(frozen=True)
class Leaves:
    """How much of what was not synchronised a cut leaves: the share of names and of sectors, and the sizes.

    Parameters
    ----------
    names, sectors : float
        How probable it is that a name, or a sector, had come to the disk.
    ahead : float or None
        How probable it is that a file has its newest size whatever of its data is there; None: any size.
    in_order : bool
        Whether names come to the disk in the order in which they were given (as ext4 and XFS have it).
    """

    name: str
    names: float
    sectors: float
    ahead: float | None = None
    in_order: bool = False


MANNERS = (
    Leaves("nothing that was not synchronised", 0.0, 0.0, 0.0),
    Leaves("everything, as a kill", 1.0, 1.0, 1.0),
    Leaves("names and sizes, no data", 1.0, 0.0, 1.0),
    Leaves("data, no names", 0.0, 1.0, 1.0),
    Leaves("names in order, any data", 0.5, 0.5, in_order=True),
    Leaves("any names, any data", 0.5, 0.5),
    Leaves("most of it", 0.8, 0.9),
    Leaves("little of it", 0.2, 0.1),
)


def after_cut(tape: Tape, moment: int, manner: Leaves, draw: Random) -> Nodes:
    """Return a state of the disk that a cut after so many entries of the tape may leave."""
    entries = tape.entries[:moment]
    certain = _certain(entries)
    nodes = deepcopy(tape.first)
    _give_names(nodes, entries, certain, manner, draw)
    for number, node in nodes.items():
        if not node.is_folder:
            _fill(node, entries, number, certain.get(number, 0), manner, draw)
    return nodes


def as_left(tape: Tape) -> Nodes:
    """Return what the program itself sees at the end of the tape."""
    return after_cut(tape, len(tape.entries), MANNERS[1], Random(0))


def put_on(nodes: Nodes, folder: Path) -> None:
    """Make a state of the disk in an empty folder."""

    def put(number: int, path: Path) -> None:
        node = nodes[number]
        if node.is_folder:
            path.mkdir(exist_ok=True)
            for name, other in node.names.items():
                put(other, path / name)
            return
        with path.open("wb") as stream:
            stream.write(node.content[: node.size])
            stream.truncate(node.size)

    put(ROOT, folder)


def _certain(entries: Sequence[Entry]) -> dict[int, int]:
    """Return, by file or folder, before which entry everything is on the disk for certain."""
    begun: dict[int, int] = {}
    found: dict[int, int] = {}
    for at, entry in enumerate(entries):
        if isinstance(entry, SyncBegins):
            begun[entry.ticket] = at
        elif isinstance(entry, Synced):
            found[entry.node] = max(found.get(entry.node, 0), begun[entry.ticket])
    return found


def _give_names(
    nodes: Nodes, entries: Sequence[Entry], certain: dict[int, int], manner: Leaves, draw: Random
) -> None:
    left = 1.0
    for at, entry in enumerate(entries):
        if not isinstance(entry, Made | Gone | Moved):
            continue
        if isinstance(entry, Made) and entry.node not in nodes:
            nodes[entry.node] = Node(entry.is_folder)
        folders = {entry.folder, entry.to_folder} if isinstance(entry, Moved) else {entry.folder}
        if not any(at < certain.get(folder, 0) for folder in folders):
            if manner.in_order and left and draw.random() < 1.0 - manner.names**0.3:
                left = 0.0  # and nothing after it
            if not left or (not manner.in_order and draw.random() >= manner.names):
                continue
        _give(nodes, entry, entries)


def _give(nodes: Nodes, entry: NAMES, entries: Sequence[Entry]) -> None:
    if isinstance(entry, Made):
        nodes[entry.folder].names[entry.name] = entry.node
    elif isinstance(entry, Gone):
        nodes[entry.folder].names.pop(entry.name, None)
    else:
        moved = nodes[entry.folder].names.pop(entry.name, None)
        if moved is None:  # the old name never came to the disk, the new one did
            moved = _named(entries, entry)
        nodes[entry.to_folder].names[entry.to_name] = moved


def _named(entries: Sequence[Entry], moved: Moved) -> int:
    """Return which file a rename was of."""
    names: dict[tuple[int, str], int] = {}
    for entry in entries:
        if isinstance(entry, Made):
            names[entry.folder, entry.name] = entry.node
        elif isinstance(entry, Gone):
            names.pop((entry.folder, entry.name), None)
        elif isinstance(entry, Moved):
            if entry is moved:
                break
            names[entry.to_folder, entry.to_name] = names.pop((entry.folder, entry.name), -1)
    return names[moved.folder, moved.name]


def _fill(
    node: Node, entries: Sequence[Entry], number: int, certain: int, manner: Leaves, draw: Random
) -> None:
    """Give a file its content: what is certain, and of what came after it what the manner leaves."""
    own = [
        (at, one) for at, one in enumerate(entries) if isinstance(one, Written | Sized) and one.node == number
    ]
    for at, entry in own:
        if at < certain:
            _do(node, entry)
    live, sizes = deepcopy(node), [node.size]
    for at, entry in own:
        if at < certain:
            continue
        _do(live, entry)
        sizes.append(live.size)
        if isinstance(entry, Written) and manner.sectors:
            for sector in range(entry.offset // SECTOR, -(-(entry.offset + len(entry.data)) // SECTOR)):
                if draw.random() < manner.sectors:
                    _copy(live.content, node.content, sector * SECTOR)
    if manner.ahead is None:
        node.size = draw.choice(sizes)
    else:
        node.size = sizes[-1] if draw.random() < manner.ahead else sizes[0]
    del node.content[node.size :]
    node.content.extend(bytes(node.size - len(node.content)))  # a size ahead of its data reads as zeros


def _do(node: Node, entry: Written | Sized) -> None:
    if isinstance(entry, Sized):
        node.size = max(node.size, entry.size) if entry.at_least else entry.size
        del node.content[node.size :]
        return
    end = entry.offset + len(entry.data)
    if end > len(node.content):
        node.content.extend(bytes(end - len(node.content)))
    node.content[entry.offset : end] = entry.data
    node.size = max(node.size, end)


def _copy(live: bytearray, onto: bytearray, at: int) -> None:
    piece = live[at : at + SECTOR]
    if len(onto) < at + len(piece):
        onto.extend(bytes(at + len(piece) - len(onto)))
    onto[at : at + len(piece)] = piece
