"""The simulated stand as a server in a process of its own, with its clock."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.simulated.serving.clock import (
        SHOWN,
        StandClock,
    )
    from bufferstand.drivers.simulated.serving.process import (
        start_process,
        wires_folder,
    )
    from bufferstand.drivers.simulated.serving.server import (
        Served,
        ServerOptions,
        serve,
        write_endpoints,
    )
    from bufferstand.drivers.simulated.serving.waiting_sign import (
        NAME,
        WIRES,
        is_waiting,
    )

__all__ = [
    "NAME",
    "SHOWN",
    "WIRES",
    "Served",
    "ServerOptions",
    "StandClock",
    "is_waiting",
    "serve",
    "start_process",
    "wires_folder",
    "write_endpoints",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
