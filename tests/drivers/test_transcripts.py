"""Recorded sessions, byte for byte: the drivers say what they said, and make of it what they made."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drivers.stand_file import Endpoints, with_endpoints
from drivers.transcript import HEAD, Piece, read_transcript
from foundation.errors import BadInput
from tests.drivers.replay import FOLDER, Replay, replayed_line, replayed_tcp
from tests.drivers.sessions import SESSIONS, WIRES, load


@pytest.mark.parametrize("name", SESSIONS)
def test_the_driver_repeats_the_session(name: str, tmp_path: Path) -> None:
    file, wire = load(tmp_path, name), WIRES[name]
    kept = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    if wire == "controller":
        with replayed_tcp(name) as (port, replay):
            found = SESSIONS[name](with_endpoints(file, Endpoints(host="127.0.0.1", port=port)))
    else:
        with replayed_line(name, wire, tmp_path) as (path, replay):
            found = SESSIONS[name](with_endpoints(file, Endpoints(amplifier_port=path, onewire_port=path)))
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
        Piece(0.5, "controller", "+"),
        Piece(0.625, "controller", ">", b"\x00\xff"),
        Piece(1.0, "onewire", "-"),
    ]
    path = tmp_path / "t.txt"
    path.write_text("\n".join([HEAD, *map(str, pieces)]), encoding="utf-8")
    assert read_transcript(path) == pieces
    assert Replay(pieces).problem == ""
