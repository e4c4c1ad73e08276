"""A rehearsal (``run --simulate``) and then ``resume``: the real stand is never come to."""

from __future__ import annotations

import json
import shutil
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bufferstand.recording.runfile.file import open_run
from tests.clean_stand import clean_stand_text
from tests.main_job.conftest import bufferstand

SAMPLES = Path(__file__).resolve().parents[2] / "sample_runs"
HEAD = """[campaign]
id = "rehearsal"
stand = "stand.toml"
specimen = "specimens/category-a-elastomer.toml"
[zero]
touch = false
"""
STEP = """[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = {amplitude}
frequency_Hz = 2.0
cycles = 1
"""


class Witness:
    """Listens where the stand file says that the real controller is, and counts who comes."""

    def __init__(self, server: socket.socket) -> None:
        self.port: int = server.getsockname()[1]
        self.came = 0
        self._server = server

    def watch(self) -> None:
        """Count connections until the server is closed."""
        while True:
            try:
                wire, _ = self._server.accept()
            except OSError:
                return
            self.came += 1
            wire.close()


@contextmanager
def witness() -> Iterator[Witness]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        watching = Witness(server)
        thread = threading.Thread(target=watching.watch, daemon=True)
        thread.start()
        yield watching
        server.shutdown(socket.SHUT_RDWR)
    thread.join(60.0)


def test_a_rehearsal_is_resumed_as_one_and_the_real_stand_sees_nobody(tmp_path: Path) -> None:
    shutil.copytree(SAMPLES / "specimens", tmp_path / "specimens")
    shutil.copytree(SAMPLES / "models", tmp_path / "models")
    campaign, out = tmp_path / "rehearsal.toml", tmp_path / "out"
    campaign.write_text(HEAD + STEP.format(amplitude=5.0))
    with witness() as real:
        text = clean_stand_text().replace("port = 15020", f"port = {real.port}")
        named = text.replace('"simulated-630kN"', '"hall-3"').replace("Simulated servo", "Servo")
        assert "simulat" not in named.partition("[limits]")[0].partition("[stand]")[2].lower()
        (tmp_path / "stand.toml").write_text(named)
        begun = bufferstand("run", campaign, "--out", out, "--simulate", "--speed", "50")
        assert begun.returncode == 0, begun.stderr
        campaign.write_text(HEAD + STEP.format(amplitude=5.0) + STEP.format(amplitude=6.0))
        resumed = bufferstand("resume", out, "--take-edits")  # nobody was asked, no --simulate
        assert resumed.returncode == 0, resumed.stderr
        assert "begun with --simulate: it goes on on a simulated stand, at 50 times" in resumed.stderr
        assert real.came == 0
        with socket.create_connection(("127.0.0.1", real.port)) as wire:
            assert wire.recv(1) == b"", "and who comes there is counted"
    assert real.came == 1
    for path in sorted((out / "runs").glob("*.h5")):
        run = open_run(path).metadata["run"]
        assert run["simulated"] is True
        assert "--simulate" in run["simulated_by"]
    starts = json.loads((out / "campaign.json").read_text())["starts"]
    assert [(start["simulate"], start["speed"], start["simulated"]) for start in starts] == [
        (True, 50.0, True)
    ] * 2
    added = {change["what"]: change["now"] for change in starts[1]["changes"]}
    assert added["rehearsal.toml: step[2].amplitude_mm"] == "6"
