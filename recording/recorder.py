"""Records while the stand runs: the acquisition hands samples over, threads bring them to the disk."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from queue import Empty, Full, Queue
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.foundation.files import canonical_json
from bufferstand.recording.content import Anchor, Event, RecordingFault
from bufferstand.recording.journal import (
    JOURNAL_SUFFIX,
    SEGMENT_BYTES,
    DataRecord,
    EndRecord,
    JournalFile,
    SegmentedJournal,
)
from bufferstand.recording.runfile import STATUSES, check_new_document
from bufferstand.recording.sealing import RUN_SUFFIX, seal_held

QUEUE_BLOCKS = 8192
"""Blocks that wait at most: over a minute of a stand with five devices."""
PROMISED_S = 0.25
"""What a power cut costs at most; a sync that ends later after the one before is counted."""
_BATCH = 256


@dataclass(frozen=True)
class _Stop:
    """Tells the writer thread that nothing more will come."""


class RunRecorder:
    """Records one run: a journal while it lasts, a sealed run file afterwards.

    The constructor returns when the run is visible on the disk under its name; only then is it recording.
    ``append``, ``anchor`` and ``event`` hand over to a thread and never wait for the disk.

    Parameters
    ----------
    directory : Path
        Folder of the run file (must exist).
    run_id : str
        Name of the run: the files are ``<run_id>.journal``, then ``<run_id>.h5``.
    metadata : mapping
        The metadata document (docs/run-file.md) without ``datasets``; ``run.status`` may be missing.
    sync_interval_s : float
        How often what was written is brought to the disk [s].
    queue_blocks : int
        How many blocks may wait for the disk.
    segment_bytes : int
        A journal file of this size is followed by another.
    journal_file : callable, optional
        Makes the file behind the recording (tried with failing ones).

    Raises
    ------
    BadInput
        If the metadata document lacks something, the run is there already or the folder takes no file.
    """

    def __init__(
        self,
        directory: Path,
        run_id: str,
        metadata: Mapping[str, Any],
        *,
        sync_interval_s: float = 0.1,
        queue_blocks: int = QUEUE_BLOCKS,
        segment_bytes: int = SEGMENT_BYTES,
        journal_file: Callable[[Path, bytes], JournalFile] = JournalFile,
    ) -> None:
        self.path = directory / f"{run_id}{JOURNAL_SUFFIX}"
        """The journal while recording; a live monitor reads it with ``ChainReader``."""
        self.failure: Exception | None = None
        """The first thing that went wrong with the recording, once something did."""
        self.late_syncs = 0
        """How often more than ``PROMISED_S`` lay between two acknowledgements of waiting data."""
        self.worst_sync_s = 0.0
        """The longest that data waited for its acknowledgement after it was written [s]."""
        document = {**metadata, "run": {"status": "recovered", **dict(metadata.get("run", {}))}}
        self._streams = check_new_document(document, self.path)
        if document["run"]["id"] != run_id:
            raise BadInput(f"run.id is not “{run_id}”", file=self.path, place="metadata: run.id")
        if (directory / f"{run_id}{RUN_SUFFIX}").exists():
            raise BadInput("this run is recorded already", file=directory / f"{run_id}{RUN_SUFFIX}")
        self._journal = SegmentedJournal(
            self.path, run_id, document, journal_file=journal_file, segment_bytes=segment_bytes
        )
        self._queue: Queue[DataRecord | Anchor | Event | _Stop] = Queue(queue_blocks)
        self._unsynced_since: float | None = None
        self._sealed: Path | None = None
        self._file_closed = False
        self._file_full = False
        self._sync_failed = False
        self._ending = threading.Event()
        self._sync_interval_s = sync_interval_s
        self._writer = threading.Thread(target=self._write, name=f"write {run_id}", daemon=True)
        self._syncer = threading.Thread(target=self._sync, name=f"sync {run_id}", daemon=True)
        self._writer.start()
        self._syncer.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._sealed is None and error is not None:
            self.close("failed", f"{type(error).__name__}: {error}")
        elif self._sealed is None:
            self.close("complete")

    @property
    def written(self) -> int:
        """Samples of the leading stream that the operating system has."""
        return self._journal.written

    @property
    def durable(self) -> int:
        """Samples of the leading stream that are on the disk (acknowledged)."""
        return self._journal.durable

    @property
    def renewals(self) -> tuple[str, ...]:
        """Why a journal file was given up for a new one: nothing is lost, but that disk is ailing."""
        return tuple(self._journal.renewals)

    @property
    def disk_warning(self) -> str | None:
        """Why no space could be reserved ahead: the disk is nearly full. Stop the run while there is room."""
        return self._journal.disk_warning

    def append(
        self,
        stream: str,
        sequence: int,
        time_us: NDArray[np.int64],
        counts: Mapping[str, NDArray[Any]],
        lost: int = 0,
    ) -> None:
        """Record a block of consecutive samples.

        Parameters
        ----------
        stream : str
            A stream of the metadata document.
        sequence : int
            Absolute sequence number of the first row.
        time_us : NDArray[int64]
            Time stamps as received [µs], shape (n,); not used after the call.
        counts : mapping of str to NDArray
            Raw counts of every channel of the stream, shape (n,) each.
        lost : int
            Samples known to be lost before this block.

        Raises
        ------
        ValueError
            If the stream or its channels are not those of the metadata document, or shapes differ.
        RuntimeError
            If the recording was closed.
        """
        head = self._streams.get(stream)
        if head is None:
            raise ValueError(f"stream {stream} is not in the run's metadata")
        names = {channel.name for channel in head.channels}
        if set(counts) != names:
            raise ValueError(f"stream {stream} delivers {sorted(counts)}, its metadata says {sorted(names)}")
        stamps = np.array(time_us, dtype=np.int64)
        columns = {channel.name: np.array(counts[channel.name]) for channel in head.channels}
        for name, column in columns.items():
            if column.shape != stamps.shape or column.dtype.kind not in "iuf":
                raise ValueError(f"channel {name}: {column.dtype}{column.shape} beside {stamps.shape} stamps")
        self._hand_over(DataRecord(stream, int(sequence), int(lost), stamps, columns))

    def anchor(self, device_us: int, host_s: float, utc: str) -> None:
        """Record one moment on the device's, the host's and the world's clock.

        Raises
        ------
        RuntimeError
            If the recording was closed.
        ValueError
            If a number is not finite.
        """
        anchor = Anchor(int(device_us), float(host_s), str(utc))
        canonical_json(vars(anchor)).encode()
        self._hand_over(anchor)

    def event(self, at_s: float, kind: str, text: str, **data: Any) -> None:
        """Record what happened at ``at_s`` of the host's stand time [s].

        Raises
        ------
        RuntimeError
            If the recording was closed.
        ValueError, TypeError
            If ``data`` has no JSON form, or a number is not finite.
        """
        event = Event(float(at_s), kind, text, data)
        canonical_json(vars(event)).encode()  # here, where the caller sees what is wrong with it
        self._hand_over(event)

    def close(self, status: str, reason: str = "") -> Path:
        """End the recording and seal it. Waits for the disk: bring the stand to rest first.

        Parameters
        ----------
        status : str
            ``complete``, ``stopped`` or ``failed``; a recording that failed itself always says ``failed``.
        reason : str
            Why, in words.

        Returns
        -------
        Path
            The sealed run file; a second call returns it again.

        Raises
        ------
        RecordingFault
            If it could not be sealed (disk full …). The journal stays, to be sealed later.
        ValueError
            If ``status`` is not one of the above.
        """
        if status not in STATUSES[:3]:
            raise ValueError(f"status {status!r} is none of {STATUSES[:3]}")
        if self._sealed is None and not self._file_closed:
            self._stop_threads()
            try:
                self._finish(status, reason)
                self._sealed = seal_held(self.path)
            except (OSError, BadInput) as error:
                self._fail(error)
            finally:
                self._journal.close()
                self._file_closed = True
        if self._sealed is None:
            raise RecordingFault(
                f"{self.path}: recorded, but not sealed ({self.failure}); "
                "what was acknowledged is in this journal and can be sealed once the disk has room"
            ) from self.failure
        return self._sealed

    def _hand_over(self, item: DataRecord | Anchor | Event) -> None:
        if self._ending.is_set():
            raise RuntimeError(f"the recording {self.path.stem} is closed")
        try:
            self._queue.put_nowait(item)
        except Full:
            self._fail(
                RecordingFault(f"{self.path}: the disk is too slow, {self._queue.maxsize} blocks waited")
            )

    def _fail(self, error: Exception) -> None:
        if self.failure is None:
            self.failure = error

    def _write(self) -> None:
        """Run the writer thread: frames in the order of hand-over, as many at once as wait."""
        running = True
        while running:
            items = [self._queue.get()]
            try:
                while len(items) < _BATCH:
                    items.append(self._queue.get_nowait())
            except Empty:
                pass
            running = not isinstance(items[-1], _Stop)
            self._write_batch([item for item in items if not isinstance(item, _Stop)])

    def _write_batch(self, items: list[DataRecord | Anchor | Event]) -> None:
        if self._file_full:
            return
        try:
            if items:
                self._journal.write(items)
        except Exception as error:  # noqa: BLE001 - whatever it is, it must be seen, not lost in a thread
            self._fail(error)
            if len(items) > 1:  # those that still fit must not be lost with the one that does not
                for item in items:
                    self._write_batch([item])
            else:
                self._file_full = isinstance(error, OSError)
            return
        if items and self._unsynced_since is None:
            self._unsynced_since = time.monotonic()

    def _sync(self) -> None:
        """Run the sync thread: acknowledge what was written, every interval."""
        while not self._ending.wait(self._sync_interval_s):
            self._acknowledge()

    def _acknowledge(self) -> None:
        since = self._unsynced_since
        if since is None or self._sync_failed:
            return
        # Whatever is written from here on counts for the next sync, so the order of these lines matters.
        self._unsynced_since = None
        try:
            self._journal.sync()
        except OSError as error:
            self._sync_failed = True  # final: no file takes what waits
            self._fail(error)
            return
        waited_s = time.monotonic() - since
        self.worst_sync_s = max(self.worst_sync_s, waited_s)
        self.late_syncs += waited_s > PROMISED_S

    def _stop_threads(self) -> None:
        self._ending.set()
        self._syncer.join()
        if self._writer.is_alive():
            self._queue.put(_Stop())
            self._writer.join()

    def _finish(self, status: str, reason: str) -> None:
        if self.failure is not None:
            status = "failed"
            reason = "; ".join(part for part in (reason, f"recording failed: {self.failure}") if part)
        figures: dict[str, Any] = {
            "late_syncs": self.late_syncs,
            "worst_sync_s": round(self.worst_sync_s, 6),
            "renewals": list(self.renewals),
        }
        end = EndRecord(status, reason, datetime.now(UTC).isoformat(timespec="microseconds"), figures)
        try:
            self._journal.finish(end)
        except OSError as error:
            self._fail(error)
