"""``simulate-stand``, ``fault`` and ``check`` as an engineer uses them: in three terminals."""

from __future__ import annotations

import fcntl
import json
import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from bufferstand.drivers.transcripts.transcript import read_transcript
from tests.clean_stand import clean_stand_text
from tests.main_job.conftest import bufferstand

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = ROOT / "sample_runs"


@pytest.fixture(scope="module")
def stand(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Serve a stand on a free port; give a stand file that names it."""
    folder = tmp_path_factory.mktemp("stand")
    text = clean_stand_text()
    text = text.replace("models/", f"{SAMPLES}/models/", 1)
    path = folder / "stand.toml"
    path.write_text(text, encoding="utf-8")
    ends = folder / "endpoints.json"
    process = subprocess.Popen(
        [
            sys.executable,
            "-P",
            "-m",
            "bufferstand",
            "simulate-stand",
            str(path),
            "--port",
            "0",
            "--endpoints",
            str(ends),
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith("serving"):
            break
        assert not line.startswith("faults") or str(path) in line
    port = json.loads(ends.read_text(encoding="utf-8"))["port"]
    path.write_text(text.replace("port = 15020", f"port = {port}"), encoding="utf-8")
    yield path
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 0
    process.stdout.close()


def test_a_sound_stand_checks_sound_as_json(stand: Path, tmp_path: Path) -> None:
    kept = tmp_path / "session.txt"
    done = bufferstand("check", stand, "--json", "--watch", "2", "--transcript", kept)
    assert done.returncode == 0, done.stdout + done.stderr
    document = json.loads(done.stdout)  # nothing else on standard output
    assert (document["schema"], document["faults"]) == ("bufferstand/check/1", 0)
    found = {(one["device"], one["item"]): one for one in document["findings"]}
    figures = found["controller", "clock drift"]["figures"]
    # Set to +20 ppm. However busy the computer is, the bounds of the readings hold it.
    assert abs(figures["drift_ppm"] - 20.0) <= figures["drift_expanded_uncertainty_ppm"]
    assert found["controller", "round trip"]["figures"]["round_trip_p50_ms"] > 0.0
    assert {piece.wire for piece in read_transcript(kept)} == {"controller", "amplifier"}


@pytest.mark.parametrize("width", [80, 120])
def test_faults_are_shown_in_a_terminal_of_any_width(stand: Path, width: int) -> None:
    given = bufferstand("fault", stand, "temperature_1=missing", "controller=stuck", "--for", "600")
    assert given.returncode == 0, given.stderr
    assert "temperature_1=missing@" in given.stdout
    status, shown = in_terminal(width, "check", str(stand), "--watch", "0")
    assert bufferstand("fault", stand, "--clear").stdout == "2 faults taken away\n"
    assert status == 4
    plain = re.sub(r"\x1b\[[0-9;]*m", "", shown)
    assert "\x1b[31m" in shown  # red
    assert max(len(line) for line in plain.splitlines()) <= width
    flat = " ".join(plain.split())
    assert "its control loop stands still" in flat
    assert "not on the bus; look at plug and cable, and at the ROM in the stand file" in flat
    assert "2 faults; their remarks say where to look" in flat


def test_a_fault_that_is_none_is_refused(stand: Path) -> None:
    for fault, told in (
        ("temperature_1=stael", "did you mean “stale”?"),
        ("ampliier=silent", "“amplifier”?"),
    ):
        done = bufferstand("fault", stand, fault)
        assert done.returncode == 2
        assert told in done.stderr
        assert done.stderr.count("\n") == 1
    assert bufferstand("fault", stand).returncode == 2
    assert bufferstand("fault", stand, "--list").stdout.startswith("stand time")


def test_an_expired_calibration_is_loud(stand: Path, tmp_path: Path) -> None:
    text = stand.read_text(encoding="utf-8").replace('"wires/', f'"{stand.parent}/wires/')
    path = tmp_path / "stand.toml"
    path.write_text(text.replace("2099-01-15", "2026-02-01", 1), encoding="utf-8")
    done = bufferstand("check", path, "--watch", "0")
    assert done.returncode == 4
    assert "FAULT  calibration force" in done.stdout
    assert "GTM-K-630-0001, EXPIRED" in done.stdout
    assert re.search(
        r"expired on 2026-02-01, \d+ days ago: nothing measured since can be traced", done.stdout
    )


def in_terminal(width: int, *arguments: str) -> tuple[int, str]:
    """Run the command in a terminal of a width; return its status and what it showed."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 50, width, 0, 0))
    environment = {key: value for key, value in os.environ.items() if key not in {"COLUMNS", "NO_COLOR"}}
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "bufferstand", *arguments],
        stdin=slave,
        stdout=slave,
        stderr=slave,
        env={**environment, "TERM": "xterm"},
    )
    os.close(slave)
    shown, end_s = b"", time.monotonic() + 60.0
    try:
        while time.monotonic() < end_s:
            if select.select([master], [], [], 0.1)[0]:
                shown += os.read(master, 65536)
            elif process.poll() is not None:
                break
    except OSError:  # the other end is closed
        pass
    finally:
        os.close(master)
    return process.wait(60), shown.decode()
