from __future__ import annotations

import json
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from bufferstand.foundation.line_socket import connected, exchange, short_address


@contextmanager
def answering(path: Path, *pieces: bytes) -> Iterator[list[bytes]]:
    """Listen at a path; answer the first request with these bytes."""
    heard: list[bytes] = []
    with socket.socket(socket.AF_UNIX) as server:
        with short_address(path) as address:
            server.bind(address)
        server.listen(1)
        server.settimeout(10)

        def serve() -> None:
            wire, _ = server.accept()
            with wire:
                wire.settimeout(10)
                with wire.makefile("rb") as lines:
                    heard.append(lines.readline())
                for piece in pieces:
                    wire.sendall(piece)

        thread = threading.Thread(target=serve)
        thread.start()
        yield heard
        thread.join()


@pytest.fixture(params=["near", "d" * 120 + "/" + "e" * 120])
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A socket's path, short or longer than the system's 108 bytes."""
    folder: Path = tmp_path / request.param
    folder.mkdir(parents=True)
    return folder / "socket"


def test_a_request_is_answered_however_deep_the_folder(path: Path) -> None:
    with answering(path, b'{"ok": true, ', b'"text": "\\u00b5m"}\n') as heard:
        reply = exchange(path, {"note": "ä"}, timeout_s=10, longest=1000)
    assert reply == {"ok": True, "text": "µm"}
    assert json.loads(heard[0]) == {"note": "ä"}


def test_nobody_there(path: Path) -> None:
    with pytest.raises(OSError, match="No such file"), connected(path, 1.0):
        pass


@pytest.mark.parametrize("answer", [b"", b"nonsense\n", b'{"text": "' + b"x" * 2000 + b'"}\n'])
def test_what_is_no_line_of_json_is_refused(path: Path, answer: bytes) -> None:
    with answering(path, answer), pytest.raises(ValueError, match=r"Expecting|Unterminated"):
        exchange(path, {}, timeout_s=10, longest=1000)
