"""``python -m tests.drivers.record_transcripts``: make the kept transcripts anew from the simulated stand.

Beside each transcript lies what the drivers made of it, as JSON.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.schema import with_endpoints
from bufferstand.drivers.transcripts.recorder import record_wires
from bufferstand.drivers.transcripts.transcript import HEAD, TranscriptPiece, read_transcript
from tests.drivers.replay import FOLDER
from tests.drivers.sessions import SESSIONS, WIRES, load


def record(name: str) -> None:
    """Record one session."""
    with tempfile.TemporaryDirectory() as folder:
        file = load(Path(folder), name)
        raw = Path(folder) / "raw.txt"
        with start_process(file.path, directory=Path(folder) / "run") as process:
            served = with_endpoints(file, process.served.endpoints())
            with record_wires(served, raw) as tapped:
                found = SESSIONS[name](tapped)
        pieces = [piece for piece in read_transcript(raw) if piece.wire == WIRES[name]]
    write(FOLDER / f"{name}.txt", pieces)
    text = json.dumps(found, indent=1, ensure_ascii=False) + "\n"
    (FOLDER / f"{name}.json").write_text(text, encoding="utf-8")
    sys.stdout.write(f"{name}: {len(pieces)} pieces\n")


def write(path: Path, pieces: list[TranscriptPiece]) -> None:
    """Write a transcript."""
    path.parent.mkdir(exist_ok=True)
    path.write_text("\n".join([HEAD, *map(str, pieces)]) + "\n", encoding="utf-8")


if __name__ == "__main__":
    for one in sys.argv[1:] or SESSIONS:
        record(one)
