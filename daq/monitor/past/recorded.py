"""The history of a campaign from its files, for a page that is opened late; a process of its own.

python -m bufferstand.daq.monitor.past.recorded DIR [BEGAN_S]

Runs that are over are read from their files, the one under way from its journal, block by block. The time is
the stand's of the newest start; what earlier starts recorded is put before it, without the pauses between.
"""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.campaign_folder import load_record
from bufferstand.daq.guards import CONTROLLER_STREAM
from bufferstand.daq.monitor.past.buckets import LONGEST_S, held
from bufferstand.daq.monitor.past.history import FINEST_S, History
from bufferstand.daq.monitor.past.journal_streams import JournalStreams
from bufferstand.daq.monitor.past.run_samples import run_blocks, units_of
from bufferstand.daq.monitor.sample_rows import channels_of
from bufferstand.foundation import BadInput
from bufferstand.recording import MAIN_STREAM, Anchor
from bufferstand.recording.finding import run_files
from bufferstand.recording.journal import ChainReader, DataRecord
from bufferstand.recording.runfile import open_run

BLOCK_ROWS = 1 << 15
BETWEEN_S = 10.0
"""Between what two starts recorded, so much is left [s]."""
Floats = NDArray[np.float64]
Samples = tuple[str, Floats, Mapping[str, Floats]]
"""Stream, stand times [s], values by channel."""


class _Filling:
    """Pours samples into a history, those that come seldom as their readers saw them: until the next one."""

    def __init__(self, history: History, shift_s: float) -> None:
        self._history = history
        self._shift_s = shift_s
        self._last: dict[str, tuple[float, dict[str, float]]] = {}

    def take(self, samples: Samples) -> None:
        stream, time_s, values = samples
        if not time_s.size:
            return
        time_s = time_s + self._shift_s
        known = self._last.get(stream)
        self._last[stream] = float(time_s[-1]), {name: float(one[-1]) for name, one in values.items()}
        if known is not None and known[0] < time_s[0] and known[1].keys() == values.keys():
            time_s = np.concatenate([[known[0]], time_s])
            values = {name: np.concatenate([[known[1][name]], one]) for name, one in values.items()}
        time_s = np.maximum.accumulate(time_s)
        self._history.take(*held(time_s, values, FINEST_S, LONGEST_S))


def history_of(folder: Path, began_s: float | None = None) -> History:
    """Return what a campaign's folder holds of the campaign's past.

    Parameters
    ----------
    folder : Path
        The campaign's folder. Files that cannot be read are left out: the page says elsewhere what is wrong.
    began_s : float, optional
        Stand time since when the newest start is followed [s]; without it, only files tell when it began.
    """
    history = History()
    ends_s = np.inf if began_s is None else began_s
    for start in reversed(_starts(folder, began_s is not None)):
        shift_s = 0.0
        if np.isfinite(ends_s) and not start.newest:
            last_s = max((anchors[-1].host_s for anchors in start.files.values() if anchors), default=0.0)
            shift_s = ends_s - BETWEEN_S - last_s
        for path, anchors in start.files.items():
            filling = _Filling(history, shift_s)
            with suppress(BadInput, OSError):
                for samples in _samples_of(path, history):
                    filling.take(samples)
            if anchors:  # before it, the stand was already moved by this start
                began = anchors[0].host_s - max(0.0, _moment(anchors[0].utc) - start.utc_s)
                ends_s = min(ends_s, max(began, 0.0) + shift_s)
    return history


@dataclass
class _Start:
    """A start of the campaign, and the files of what it recorded, with their clock anchors once sealed."""

    utc_s: float
    newest: bool
    files: dict[Path, Sequence[Anchor]] = field(default_factory=dict)


def _starts(folder: Path, running: bool) -> list[_Start]:
    """Return the starts that recorded something, oldest first; of one that runs, the newest even if not."""
    record = load_record(folder)
    began_s = [_moment(str(one.get("at_utc", ""))) for one in record.starts] if record else []
    starts = [_Start(utc_s, newest=False) for utc_s in began_s or [0.0]]
    files: Sequence[Path] = ()
    with suppress(BadInput):  # of the first run there is no file yet
        files = run_files([folder])
    for path in files:
        if anchors := _anchors(path):
            begun_s = _moment(anchors[0].utc)
            starts[max(0, sum(one <= begun_s for one in began_s) - 1)].files[path] = anchors
    sealed = {path.stem for start in starts for path in start.files}
    under_way = [path for path in (folder / "runs").glob("*.journal") if path.stem not in sealed]
    starts[-1].files |= dict.fromkeys(sorted(under_way)[-1:], ())
    if not running:
        starts = [one for one in starts if one.files]
    if starts:
        starts[-1].newest = True
    return starts


def _anchors(path: Path) -> Sequence[Anchor]:
    """Return the clock anchors of a run that is over; none of a file that cannot be read."""
    with suppress(BadInput, OSError):
        return open_run(path).anchors
    return ()


def _moment(utc: str) -> float:
    try:
        return datetime.fromisoformat(utc).timestamp()
    except ValueError:
        return 0.0


def _samples_of(path: Path, history: History) -> Iterator[Samples]:
    return _of_journal(path, history) if path.suffix == ".journal" else _of_run(path, history)


def _ahead_s(anchors: Sequence[Anchor]) -> float:
    """Return by how much the host's clock is ahead of the device's [s]: as the pair with least delay says."""
    return min(anchor.ahead_s for anchor in anchors)


def _of_run(path: Path, history: History) -> Iterator[Samples]:
    run = open_run(path)
    main = run.streams.get(MAIN_STREAM)
    if main is None or not main.rows or not run.anchors:
        return
    zero_s = float(main.in_seconds(np.array([main.first_stamp]))[0]) + _ahead_s(run.anchors)
    history.name_further(units_of(run))
    for stream in run.streams:
        for time_s, values in run_blocks(run, list(run.streams[stream].channels), BLOCK_ROWS):
            yield stream, time_s + zero_s, values


def _of_journal(path: Path, history: History) -> Iterator[Samples]:
    with ChainReader(path) as reader:
        streams: JournalStreams | None = None
        newest_us = 0
        for records in reader.batches():
            if streams is None and reader.header is not None:
                streams = JournalStreams(reader.header["metadata"], path)
                named = channels_of(streams.facts.values())
                history.name_further({str(one["name"]): str(one["unit"]) for one in named})
            if streams is None:
                continue
            anchors = [one for one in records if isinstance(one, Anchor)]
            streams.anchor = min(anchors, key=lambda one: one.ahead_s, default=streams.anchor)
            if streams.anchor is None:
                continue
            joined = _joined(records, streams)
            if CONTROLLER_STREAM in joined:
                newest_us = int(joined[CONTROLLER_STREAM].time_us[-1])
            for name, record in joined.items():
                scaled = streams.scaled(record, newest_us)
                ahead_s = streams.ahead_s if name == CONTROLLER_STREAM else 0.0
                yield name, scaled.time_us / 1e6 + ahead_s, scaled.values


def _joined(records: Sequence[object], streams: JournalStreams) -> dict[str, DataRecord]:
    """Return the samples of several records as one of each stream: thousands of small ones take long."""
    parts: dict[str, list[DataRecord]] = {}
    for one in records:
        if isinstance(one, DataRecord) and one.stream in streams.facts and len(one.time_us):
            parts.setdefault(one.stream, []).append(one)
    return {
        name: replace(
            found[-1],
            time_us=np.concatenate([one.time_us for one in found]),
            counts={key: np.concatenate([one.counts[key] for one in found]) for key in found[0].counts},
        )
        for name, found in parts.items()
    }


async def recorded_history(folder: Path, began_s: float | None) -> History | None:
    """Have another process put the history of a campaign together from its files (:func:`history_of`).

    Returns
    -------
    History or None
        None where that process could not.
    """
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-P", "-m", "bufferstand.daq.monitor.past.recorded", str(folder),
        *([] if began_s is None else [repr(began_s)]),
        stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.DEVNULL,
    )  # fmt: skip
    try:
        content, _ = await process.communicate()
        return await asyncio.to_thread(History.from_bytes, content)
    except ValueError:
        return None
    finally:
        if process.returncode is None:
            process.kill()


def main(folder: Path, *began_s: str) -> None:
    """Write the history to standard output."""
    os.nice(10)
    sys.stdout.buffer.write(history_of(folder, *map(float, began_s)).as_bytes())


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:3])
