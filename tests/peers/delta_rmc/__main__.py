"""Serve an RMC: ``python -m tests.peers.delta_rmc --port 1502``; words on its input are troubles."""

from __future__ import annotations

import argparse
import json
import sys

from tests.peers.delta_rmc.controller import RmcController, UserProgram
from tests.peers.delta_rmc.server import RmcServer
from tests.peers.delta_rmc.unsaid import Unsaid


def main() -> None:
    """Serve until the input ends; print the address as one line of JSON."""
    words = argparse.ArgumentParser(prog="python -m tests.peers.delta_rmc", description=__doc__)
    words.add_argument("--port", type=int, default=0)
    words.add_argument("--model", choices=("RMC75", "RMC150"), default="RMC150")
    words.add_argument("--sets", default="position,force,target", help="data sets of plot 0")
    words.add_argument(
        "--period", type=float, default=1e-3, metavar="SECONDS", help="sample period of the plot"
    )
    words.add_argument("--high-word-first", action="store_true")
    words.add_argument("--without-program", action="store_true", help="no user program watches the heartbeat")
    words.add_argument("--force-sign", type=float, default=1.0)
    given = words.parse_args()
    controller = RmcController(
        given.model,
        plot_period_s=given.period,
        plots=(given.sets.split(","),),
        program=None if given.without_program else UserProgram(),
        force_sign=given.force_sign,
        unsaid=Unsaid(low_word_first=not given.high_word_first),
    )
    with RmcServer(controller, given.port) as server:
        print(json.dumps({"host": server.address[0], "port": server.address[1]}), flush=True)
        for line in sys.stdin:
            _trouble(server, line.split())


def _trouble(server: RmcServer, words: list[str]) -> None:
    match words:
        case ["lose", count]:
            server.lose(int(count))
        case ["late", seconds, count]:
            server.delay(float(seconds), int(count))
        case ["drop"]:
            server.drop()
        case ["reset"]:
            server.reset()
        case ["overrun"]:
            server.overrun()
        case ["state"]:
            with server.lock:
                axis = server.controller.axis
                state = {"position_mm": axis.position_mm, "force_kN": server.controller.force_kN}
                print(json.dumps(state | {"enabled": axis.enabled, "closed": axis.closed}), flush=True)
        case _:
            print("lose N | late SECONDS N | drop | reset | overrun | state", file=sys.stderr)


if __name__ == "__main__":
    main()
