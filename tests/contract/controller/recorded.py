"""A plugin of pytest (``-p``): a simulated controller in the place of the real one, whose orders are kept.

They go to the file that the environment names in ``ORDERS``, one JSON array ``[order, parameters]`` a line.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

from bufferstand.drivers.interfaces import Controller
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.foundation.clock import Clock
from tests.contract.controller import backends


class Recorded:
    """Writes down every call that carries parameters, whatever it is called, before it goes on."""

    def __init__(self, controller: Any, orders: Path) -> None:
        self._controller, self._orders = controller, orders

    def __getattr__(self, name: str) -> Any:
        member = getattr(self._controller, name)
        if not callable(member):
            return member

        def called(*values: Any, **named: Any) -> Any:
            if values or named:
                order = [name, list(values), named]
                if name == "start":
                    order = [values[0].name, [], asdict(values[0])]
                with self._orders.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(order) + "\n")
            return member(*values, **named)

        return called


def pytest_configure() -> None:
    def open_recorded(stand: StandFile) -> tuple[Any, Clock]:
        made = open_in_process(stand)

        def second(_: StandFile, __: Clock) -> Controller:
            controller = made.second()
            controller.connect()
            return controller

        backends._second = second
        return Recorded(made.stand.controller, Path(os.environ["ORDERS"])), made.clock

    backends.open_real = open_recorded  # type: ignore[assignment]
