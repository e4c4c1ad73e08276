"""``bufferstand stand`` as an engineer uses it: a stand in one terminal, a hand on the keys in another."""

from __future__ import annotations

import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import serial

from bufferstand.cli.arming import user_name
from bufferstand.daq.zero.file import stored_path, stored_zero
from tests.clean_stand import clean_stand_text
from tests.main_job.conftest import bufferstand

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = ROOT / "sample_runs"
STAND_ID = "simulated-630kN"
OFF = "wire_zero_mm = [1.5, 1.2]\ngap_mm = 1.0\nforce_zero_kN = 0.6\n"
HANGS_S = 120.0


@pytest.fixture(scope="module")
def stand(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Serve a stand whose zeros are off on a free port; give a stand file that names it."""
    folder = tmp_path_factory.mktemp("stand")
    text = clean_stand_text().replace("models/", f"{SAMPLES}/models/", 1)
    path, ends = folder / "stand.toml", folder / "endpoints.json"
    path.write_text(text + OFF, encoding="utf-8")
    words = ["simulate-stand", str(path), "--port", "0", "--endpoints", str(ends), "--wait-for-reader"]
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "bufferstand", *words], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith("serving"):
            break
    port = json.loads(ends.read_text(encoding="utf-8"))["port"]
    path.write_text((text + OFF).replace("port = 15020", f"port = {port}"), encoding="utf-8")
    yield path
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 0
    process.stdout.close()


@pytest.fixture(autouse=True)
def no_zero_before(stand: Path) -> None:
    stored_path(stand).unlink(missing_ok=True)


def positions(shown: str) -> list[float]:
    """Return the column of positions of a table of ``jog``."""
    rows = re.findall(r"-?\d+\.\d{3}\s+(-?\d+\.\d{4})\s+-?\d+\.\d\s", shown)
    return [float(position) for position in rows]


def test_readings_in_counts_and_units(stand: Path) -> None:
    done = bufferstand("stand", "read", stand, "--once")
    assert done.returncode == 0, done.stderr
    row = next(line.split() for line in done.stdout.splitlines() if line.startswith("stroke_1"))
    assert float(row[1]) == pytest.approx(51.5 / 0.00762939453125, abs=5.0)
    assert float(row[3]) == pytest.approx(1.5, abs=0.01)
    done = bufferstand("stand", "read", stand, "--json", "--for", "2")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["schema"] == "bufferstand/stand-read/1"
    force = next(one for one in document["channels"] if one["name"] == "force")
    assert force["value"] == pytest.approx(0.6, abs=0.03)
    assert force["noise"] == pytest.approx(0.15, rel=0.2)


def test_readings_while_another_terminal_holds_the_amplifier(stand: Path) -> None:
    """As “stand jog” does: what is not held is read, and what is held is named."""
    with serial.Serial(str(stand.parent / "wires" / "amplifier"), 38400, exclusive=True):
        done = bufferstand("stand", "read", stand, "--json")
        refused = bufferstand("stand", "zero", stand, "--yes-move", STAND_ID)
    assert refused.returncode == 4
    assert "another program holds it (“stand read”, a campaign, a terminal): end that one" in refused.stderr
    assert done.returncode == 0, done.stderr
    assert "another program holds it" in done.stderr
    document = json.loads(done.stdout)
    assert any("amplifier" in text for text in document["faults"])
    read = {one["name"]: one["samples"] for one in document["channels"]}
    assert read["force"] > 0
    assert read["force_2"] == 0


def test_a_tare_is_stored_and_one_that_hides_a_fault_is_not(stand: Path, tmp_path: Path) -> None:
    done = bufferstand("stand", "tare", stand, "--channel", "force", "--operator", "me")
    assert done.returncode == 0, done.stderr
    assert "written to" in done.stdout
    zero = stored_zero(stand)
    assert zero is not None
    assert [one.name for one in zero.channel] == ["force"]
    assert zero.value("force") == pytest.approx(0.6, abs=0.03)
    other = tmp_path / "stand.toml"
    text = stand.read_text(encoding="utf-8")
    text = text.replace('"wires/', f'"{stand.parent}/wires/')
    other.write_text(text.replace("coefficients = [-50.0,", "coefficients = [-30.0,"), encoding="utf-8")
    refused = bufferstand("stand", "tare", other)
    assert refused.returncode == 3
    assert re.search(r"stroke_1 reads \+21\.5\d mm at rest, more than 10 mm: hook", refused.stderr)
    assert "nothing was written" in refused.stderr
    assert not stored_path(other).exists()


def test_what_moves_asks_and_is_refused_without_an_answer(stand: Path) -> None:
    for words in (("zero",), ("jog", "--by", "0.5")):
        done = subprocess.run(
            [sys.executable, "-P", "-m", "bufferstand", "stand", words[0], str(stand), *words[1:]],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 2
        assert f"add --yes-move {STAND_ID}" in done.stderr
    wrong = bufferstand("stand", "zero", stand, "--yes-move", "another")
    assert wrong.returncode == 2
    assert not stored_path(stand).exists()


def test_first_contact_by_hand(stand: Path) -> None:
    done = bufferstand("stand", "zero", stand, "--specimen", "A-1", "--yes-move", STAND_ID)
    assert done.returncode == 0, done.stderr
    assert "to the piston's zero from wherever it stands: back at 5 mm/s, forward at 0.5 mm/s" in done.stderr
    assert "up to 10 mm at 0.5 mm/s, to 2.8 kN at most, and back" in done.stderr
    assert "valve off" in done.stderr
    zero = stored_zero(stand)
    assert zero is not None
    assert (zero.how, zero.specimen, zero.operator) == ("touch", "A-1", user_name())
    assert zero.value("stroke_1") == pytest.approx(1.5, abs=0.1)
    assert zero.value("position") == pytest.approx(1.0, abs=0.1)
    document = json.loads(bufferstand("stand", "read", stand, "--json").stdout)
    stroke = next(one for one in document["channels"] if one["name"] == "stroke_1")
    assert stroke["from_zero"] == pytest.approx(0.0, abs=0.05)


def test_without_a_terminal_it_jogs_step_by_step(stand: Path) -> None:
    before = bufferstand("stand", "jog", stand, "--by", "-0.2", "--yes-move", STAND_ID)
    after = bufferstand("stand", "jog", stand, "--by", "-0.8", "--yes-move", STAND_ID)
    assert (before.returncode, after.returncode) == (0, 0), after.stderr
    (first,), (second,) = positions(before.stdout), positions(after.stdout)
    assert second - first == pytest.approx(-0.8, abs=0.05)
    far = bufferstand("stand", "jog", stand, "--by", "5", "--yes-move", STAND_ID)
    assert far.returncode == 2
    assert far.stderr.startswith("bufferstand: --by: ")
    assert "one command moves by 1 mm at most" in far.stderr
    to = bufferstand("stand", "jog", stand, "--to", "5", "--yes-move", STAND_ID)
    assert to.stderr.startswith("bufferstand: --to: ")


def test_a_latched_fault_is_named_and_reset_by_what_asks_before_it_moves(stand: Path) -> None:
    """As after a jog into the device's own limit: nobody has to restart the controller."""
    given = bufferstand("fault", stand, "controller=trip,code=2")
    assert given.returncode == 0, given.stderr
    tare = bufferstand("stand", "tare", stand)
    assert tare.returncode == 4
    assert "the controller shows fault 2 (force limit of the device) from before" in tare.stderr
    checked = bufferstand("check", stand, "--watch", "0")
    assert checked.returncode == 4
    assert "fault 2 (force limit of the device): look why; the next start that moves" in checked.stdout
    refused = bufferstand("stand", "jog", stand, "--by", "0.2")
    assert refused.returncode == 2
    assert bufferstand("stand", "tare", stand).returncode == 4, "no fault is reset without consent"
    jog = bufferstand("stand", "jog", stand, "--by", "-0.2", "--yes-move", STAND_ID)
    assert jog.returncode == 0, jog.stderr
    assert "note: the controller shows fault 2 (force limit of the device) from before" in jog.stderr
    assert "fault 2 (force limit of the device) of the controller was reset" in jog.stderr
    assert bufferstand("stand", "tare", stand).returncode == 0


class Held:
    """A command in a terminal of its own, and a finger on its keys."""

    def __init__(self, *words: str) -> None:
        self.pid, self.descriptor = pty.fork()
        if self.pid == 0:  # pragma: no cover - another program from here on
            os.chdir(ROOT)
            command = [sys.executable, "-P", "-m", "bufferstand", *words]
            os.execvpe(command[0], command, {**os.environ, "PYTHONPATH": str(ROOT)})
        self.text = ""
        self.status: int | None = None

    def read(self, seconds: float) -> None:
        until_s = time.monotonic() + seconds
        while (left_s := until_s - time.monotonic()) > 0.0:
            if select.select([self.descriptor], [], [], left_s)[0]:
                try:
                    self.text += os.read(self.descriptor, 65536).decode(errors="replace")
                except OSError:
                    return

    def wait_for(self, pattern: str, *, holding: bool = False) -> None:
        until_s = time.monotonic() + HANGS_S
        while not re.search(pattern, self.text):
            assert time.monotonic() < until_s, f"never shown: {pattern}\n{self.text[-1500:]}"
            if holding:
                os.write(self.descriptor, b"m")
            self.read(0.05)

    def place(self) -> float:
        """Return the last position that was shown [mm]."""
        self.read(0.3)
        return float(re.findall(r"position (-?\d+\.\d+)", self.text)[-1])

    def hang_up(self) -> int:
        """Close the terminal while it runs; return its exit status."""
        os.close(self.descriptor)
        _, status = os.waitpid(self.pid, 0)
        return os.waitstatus_to_exitcode(status)

    def end(self) -> int:
        until_s = time.monotonic() + HANGS_S
        while self.status is None:
            assert time.monotonic() < until_s, "it does not end"
            self.read(0.1)
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            self.status = os.waitstatus_to_exitcode(status) if pid else None
        os.close(self.descriptor)
        return self.status


def test_in_a_terminal_it_moves_while_a_key_is_held(stand: Path) -> None:
    held = Held("stand", "jog", str(stand), "--to", "-4", "--to", "-2", "--speed", "2", "--for", "0.5")
    held.wait_for("type the id of the stand")
    os.write(held.descriptor, f"{STAND_ID}\n".encode())
    held.wait_for("hold any key to move, let go to hold; q ends")
    held.wait_for(r"position -?\d")
    began = held.place()
    held.read(1.0)
    assert held.place() == pytest.approx(began, abs=0.08), "nobody holds a key"
    os.write(held.descriptor, b"m")
    held.read(2.0)
    stood = held.place()
    assert stood < began - 0.2, "a key moves it for half a second"
    held.read(1.0)
    assert held.place() == pytest.approx(stood, abs=0.08), "and it holds when it is not repeated"
    assert stood > -3.9, "it has not gone on to its goal"
    held.wait_for(r"-2\.000\s+-?\d+\.\d{4}", holding=True)
    assert held.end() == 0
    assert positions(held.text)[-2:] == pytest.approx([-4.0, -2.0], abs=0.05)
    assert "valve off" in held.text


def test_a_terminal_that_is_closed_is_the_operator_s_stop(stand: Path) -> None:
    held = Held("stand", "jog", str(stand), "--to", "-9", "--yes-move", STAND_ID)
    held.wait_for("hold any key to move")
    held.wait_for(r"position -?\d", holding=True)
    assert held.hang_up() == 3, "1 is that of a specimen that failed"
    assert bufferstand("stand", "tare", stand, "--channel", "force").returncode == 0, "its valve is off"


def test_a_reader_whose_terminal_is_closed_is_stopped_and_no_bad_input(stand: Path) -> None:
    held = Held("stand", "read", str(stand))
    held.wait_for(r"stroke_1 +\d")
    assert held.hang_up() == 3


@pytest.mark.parametrize("words", [("zero",), pytest.param(("jog", "--by", "0.5"), marks=pytest.mark.long)])
def test_a_stand_that_another_program_moves_is_left_alone(
    stand: Path, tmp_path: Path, words: tuple[str, ...]
) -> None:
    """No amplifier's port keeps the second out: refused, it must not switch the first one's valve off."""
    lone = tmp_path / "stand.toml"
    text = stand.read_text(encoding="utf-8").replace('"wires/', f'"{stand.parent}/wires/')
    lone.write_text(
        re.sub(r"\n\[amplifier\].*?(?=\n\[(?!amplifier))", "", text, flags=re.DOTALL), encoding="utf-8"
    )
    held = Held("stand", "jog", str(lone), "--to", "-9", "--speed", "0.2", "--yes-move", STAND_ID)
    held.wait_for("hold any key to move")
    held.wait_for(r"position -?\d", holding=True)
    refused = bufferstand("stand", words[0], lone, *words[1:], "--yes-move", STAND_ID)
    assert refused.returncode == 4, refused.stderr
    assert re.search(r"another program gives the controller commands: process \d+ of ", refused.stderr)
    assert refused.stderr.rstrip().endswith("; the stand was not touched")
    assert "safe stop" not in refused.stderr
    read = bufferstand("stand", "read", lone, "--json", "--for", "0.5")
    assert read.returncode == 0, read.stderr
    document = json.loads(read.stdout)
    assert [one["samples"] for one in document["channels"] if one["name"] == "force"] == [0]
    (why,) = (text for text in document["faults"] if text.startswith("controller: program "))
    assert why.endswith("its ring is not read, since that would acknowledge samples that the other program "
                        "still wants: look at the readings that one shows")  # fmt: skip
    began = held.place()
    held.wait_for(f"position {began - 0.1:.1f}", holding=True)
    os.write(held.descriptor, b"q")
    assert held.end() == 0, held.text
