"""``python -m tests.drivers.labjack_session``: make the kept transcript of a LabJack anew."""

from __future__ import annotations

import socket
import sys
import threading
import time

from bufferstand.drivers.acquisition.labjack.device import LabJack
from bufferstand.drivers.acquisition.labjack.settings import LabJackSettings
from bufferstand.drivers.modbus.link import ModbusLink
from bufferstand.drivers.modbus.wires import TcpWire
from bufferstand.drivers.transcripts.transcript import Sign, TranscriptPiece
from tests.drivers.record_transcripts import write
from tests.drivers.replay import FOLDER
from tests.peers.labjack.emulator import LabJackEmulator

NAME, WIRE = "labjack", "acquisition"


def session(host: str, port: int) -> LabJack:
    """Identify a T7 with two inputs, set its stream up by requests and start it, set a line, stop."""
    channel = {"quantity": "pressure", "unit": "bar"}
    settings = LabJackSettings.model_validate(
        {
            "kind": "labjack",
            "model": "T7",
            "host": host,
            "port": port,
            "rate_Hz": 1000.0,
            "delivery": "requests",
            "stop_output": "FIO3",
            "input": [
                {"terminal": "AIN0", "channel": {"name": "pressure_1", **channel}},
                {
                    "terminal": "AIN2",
                    "differential": True,
                    "range_V": 0.1,
                    "channel": {"name": "pressure_2", **channel},
                },
            ],
        }
    )
    device = LabJack(ModbusLink(TcpWire(host, port), timeout_s=5.0, name=WIRE), settings, WIRE)
    device.identify()
    device.set_line("FIO3", high=True)
    device.start_stream()
    device.stop_stream()
    device.link.close()
    return device


def _tapped(far_port: int, pieces: list[TranscriptPiece]) -> int:
    listener = socket.create_server(("127.0.0.1", 0))
    begun_s = time.monotonic()

    def copy(source: socket.socket, target: socket.socket, sign: Sign) -> None:
        while data := source.recv(4096):
            pieces.append(TranscriptPiece(time.monotonic() - begun_s, WIRE, sign, data))
            target.sendall(data)

    def serve() -> None:
        near, _ = listener.accept()
        with near, listener, socket.create_connection(("127.0.0.1", far_port)) as far:
            threading.Thread(target=copy, args=(far, near, "<"), daemon=True).start()
            copy(near, far, ">")

    threading.Thread(target=serve, daemon=True).start()
    return int(listener.getsockname()[1])


if __name__ == "__main__":
    found: list[TranscriptPiece] = []
    with LabJackEmulator({}) as emulator:
        session("127.0.0.1", _tapped(emulator.port, found))
    write(FOLDER / f"{NAME}.txt", found)
    sys.stdout.write(f"{NAME}: {len(found)} pieces\n")
