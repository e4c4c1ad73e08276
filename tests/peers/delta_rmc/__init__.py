"""A Delta RMC75/RMC150 motion controller on Modbus TCP, written from the maker's manual alone.

Nobody who wrote it has seen the driver. What each part takes from the manual, and what the manual pages that
were to be had do not say (`Unsaid`), stands in the README of this folder.
"""

from tests.peers.delta_rmc.addresses import MODELS, Model, iec_number, modbus_address
from tests.peers.delta_rmc.axis import AxisFacts
from tests.peers.delta_rmc.controller import RmcController, UserProgram
from tests.peers.delta_rmc.server import RmcServer
from tests.peers.delta_rmc.specimen import SpecimenFacts
from tests.peers.delta_rmc.unsaid import Unsaid

__all__ = [
    "MODELS",
    "AxisFacts",
    "Model",
    "RmcController",
    "RmcServer",
    "SpecimenFacts",
    "Unsaid",
    "UserProgram",
    "iec_number",
    "modbus_address",
]
