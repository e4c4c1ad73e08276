"""Recorded sessions, byte for byte: the drivers say what they said, and make of it what they made."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from bufferstand.drivers.check.devices import check_stand
from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import Endpoints, with_endpoints
from bufferstand.drivers.transcripts.recorder import record_wires
from bufferstand.drivers.transcripts.transcript import HEAD, TranscriptPiece, read_transcript
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import BadInput
from tests.drivers.conftest import SAMPLE_STAND
from tests.drivers.replay import FOLDER, Replay, replayed_line, replayed_pieces, replayed_tcp
from tests.drivers.sessions import CHANGES, SESSIONS, WIRES, load


@pytest.mark.parametrize("name", SESSIONS)
def test_the_driver_repeats_the_session(name: str, tmp_path: Path) -> None:
    file, wire = load(tmp_path, name), WIRES[name]
    kept = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    if wire == "controller":
        with replayed_tcp(name) as (port, replay):
            found = SESSIONS[name](with_endpoints(file, Endpoints(host="127.0.0.1", port=port)))
    else:
        with replayed_line(name, wire, tmp_path) as (path, replay):
            found = SESSIONS[name](
                with_endpoints(file, Endpoints(instruments={"amplifier": path, "thermometers": path}))
            )
    assert replay.problem == ""
    assert found == kept


def test_another_byte_is_noticed(tmp_path: Path) -> None:
    with replayed_line("gsv2", "amplifier", tmp_path) as (path, replay):
        path.write_bytes(b"\x24\x24\x24")
        while not (replay.problem or replay.done.is_set()):
            pass
    assert "24 was sent, not 23" in replay.problem


def test_a_line_that_is_none_is_refused_with_its_number(tmp_path: Path) -> None:
    path = tmp_path / "t.txt"
    path.write_text(f"{HEAD}\n# a comment\n0.1 amplifier > 23\n0.2 amplifier ? 23\n", encoding="utf-8")
    with pytest.raises(BadInput, match=r"line 4: “0.2 amplifier \? 23” is no piece of a session"):
        read_transcript(path)
    path.write_text("hello\n", encoding="utf-8")
    with pytest.raises(BadInput, match="line 1: this is no transcript"):
        read_transcript(path)


def test_a_transcript_is_read_as_it_was_written(tmp_path: Path) -> None:
    pieces = [
        TranscriptPiece(0.5, "controller", "+"),
        TranscriptPiece(0.625, "controller", ">", b"\x00\xff"),
        TranscriptPiece(1.0, "onewire", "-"),
    ]
    path = tmp_path / "t.txt"
    path.write_text("\n".join([HEAD, *map(str, pieces)]), encoding="utf-8")
    assert read_transcript(path) == pieces
    assert Replay(pieces).problem == ""


@pytest.mark.slow
def test_a_live_session_becomes_a_transcript_that_can_be_replayed(tmp_path: Path) -> None:
    """Over RTU and a serial adapter, where the tap stands on pseudo-terminals."""
    text = SAMPLE_STAND.read_text(encoding="utf-8").replace("models/", f"{SAMPLE_STAND.parent}/models/", 1)
    for old, new in (
        ('host = "127.0.0.1"\nport = 15020', 'serial = "wires/controller"\nbaud = 115200'),
        CHANGES["ds2480b"][0],
    ):
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / "stand.toml"
    path.write_text(text, encoding="utf-8")
    kept = tmp_path / "session.txt"
    with start_process(path, directory=tmp_path / "run") as process:
        reached = with_endpoints(load_stand(path), process.served.endpoints())
        with record_wires(reached, kept) as tapped:
            found = SESSIONS["ring"](tapped)
            sensors = SESSIONS["ds2480b"](tapped)
    pieces = read_transcript(kept)
    assert {piece.wire for piece in pieces} == {"controller", "amplifier", "thermometers"}
    times_s = [piece.time_s for piece in pieces]
    assert times_s == sorted(times_s)
    assert "# controller: RTU, 115200 baud, profile ring, unit 1" in kept.read_text(encoding="utf-8")
    assert "# thermometers: ds2480b, 9600 baud" in kept.read_text(encoding="utf-8")
    for wire, name, what in (("controller", "ring", found), ("thermometers", "ds2480b", sensors)):
        own = [piece for piece in pieces if piece.wire == wire]
        with replayed_pieces(own, wire, tmp_path) as (line, replay):
            ends = Endpoints(controller_serial=line, instruments={"thermometers": line})
            assert SESSIONS[name](with_endpoints(load_stand(path), ends)) == what
        assert replay.problem == ""


@pytest.mark.slow
def test_a_wire_that_cannot_be_tapped_is_left_to_the_drivers(tmp_path: Path) -> None:
    file = load_stand(SAMPLE_STAND)
    dead = with_endpoints(file, Endpoints(port=1, instruments={"amplifier": tmp_path / "nothing"}))
    kept = tmp_path / "session.txt"
    with record_wires(dead, kept) as tapped:
        assert tapped.instruments[0].settings.port == str(tmp_path / "nothing")
        rows = check_stand(tapped, WallClock(), watch_s=0.0)
    told = {row.device: row.remark for row in rows if row.item == "connection"}
    assert "No such file" in told["amplifier"]
    text = kept.read_text(encoding="utf-8")
    assert "# amplifier: not recorded, its port cannot be opened" in text
    assert "# controller: cannot connect" in text
