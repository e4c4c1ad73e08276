"""``python -m bufferstand.drivers.simulated STAND.toml``: the simulated stand as a process of its own."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

from bufferstand.drivers.simulated.faults import load_faults, parse_fault
from bufferstand.drivers.simulated.serving import Served, ServerOptions, serve, write_endpoints
from bufferstand.foundation import BadInput, ExitStatus


def main(arguments: list[str] | None = None) -> int:
    """Serve a stand as the command line says; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bufferstand.drivers.simulated", description=__doc__)
    parser.add_argument("stand", type=Path, help="stand file with a table [simulation]")
    parser.add_argument("--model", type=Path, help="spring model instead of the stand file's")
    parser.add_argument("--speed", type=float, default=1.0, help="stand seconds in one second of the wall")
    parser.add_argument("--port", type=int, help="TCP port instead of the stand file's; 0: a free one")
    parser.add_argument("--wires", type=Path, help="folder for serial device and 1-Wire tree")
    parser.add_argument("--truth", type=Path, help="file for what really happened (.npz or .csv)")
    parser.add_argument("--endpoints", type=Path, help="file that says where it can be reached, once it is")
    parser.add_argument("--fault", action="append", default=[], help="e.g. temperature_1=silent@30:60")
    parser.add_argument("--faults", type=Path, help="schedule of faults (TOML)")
    parser.add_argument("--with-parent", action="store_true", help="end when standard input ends")
    parser.add_argument("--wait-for-reader", action="store_true", help="at speeds up to 1, too")
    given = parser.parse_args(arguments)

    def ready(served: Served) -> None:
        if given.endpoints is not None:
            write_endpoints(served, given.endpoints)
        sys.stdout.write(json.dumps(asdict(served)) + "\n")
        sys.stdout.flush()

    try:
        faults, seed = ((), 0) if given.faults is None else load_faults(given.faults)
        options = ServerOptions(
            model=given.model,
            speed=given.speed,
            port=given.port,
            wires=given.wires,
            truth=given.truth,
            faults=(*faults, *(parse_fault(text) for text in given.fault)),
            fault_seed=seed,
            with_parent=given.with_parent,
            wait_for_reader=given.wait_for_reader,
        )
        serve(given.stand, options, ready=ready)
    except BadInput as error:
        sys.stderr.write(f"{error}\n")
        return int(ExitStatus.BAD_INPUT)
    return int(ExitStatus.DONE)


if __name__ == "__main__":
    raise SystemExit(main())
