"""A simulated controller says over its wire that it is one; whoever does not say it is a real one."""

from __future__ import annotations

import pytest

from bufferstand.drivers.controllers.register_controller import RegisterController
from bufferstand.drivers.modbus.link import ModbusLink
from bufferstand.drivers.register_maps.profile import SIMULATED_SIGN, Profile, load_profile
from bufferstand.drivers.simulated.inprocess.register_wire import VirtualWire
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.simulated.wires.controller_registers import RegisterBank
from bufferstand.drivers.simulated.wires.modbus_requests import EXCHANGE, WRITE_ONE, WRITE_SEVERAL
from bufferstand.drivers.stand_file.loading import load_stand
from tests.daq.cases import SAMPLES
from tests.drivers.profiles import changed_ring

STAND = load_stand(SAMPLES / "stand.toml")
WORD = '\n[[register]]\nname = "simulated"\naddress = 10\ntype = "u16"'
WITHOUT = changed_ring({WORD: '\n[[register]]\nname = "other"\naddress = 10\ntype = "u16"'})
AWAY = changed_ring({WORD: '\n[[register]]\nname = "simulated"\naddress = 14\ntype = "u16"'})


def asked(profile: Profile) -> tuple[bool, list[bytes]]:
    """Return what the shipped simulated device says under a map of its own, and what was written to it."""
    opened, seen = open_in_process(STAND, log_truth=False), []

    def kept(request: bytes) -> str:
        seen.append(request)
        return ""

    wire = VirtualWire(opened.device, profile, opened.clock, lambda: 0.001, kept)  # type: ignore[arg-type]
    link = ModbusLink(wire, read_write=profile.read_write)
    controller = RegisterController(link, profile)
    controller.identify()
    found = controller.says_simulated()
    return found, [one for one in seen if one[0] in (WRITE_ONE, WRITE_SEVERAL, EXCHANGE)]


@pytest.mark.parametrize("name", ["ring", "polling"])
def test_the_shipped_profiles_ask_and_the_simulated_controller_says_so(name: str) -> None:
    assert asked(load_profile(name)) == (True, [])


def test_under_a_map_without_the_register_nothing_is_asked_and_nobody_is_simulated() -> None:
    assert asked(WITHOUT) == (False, [])
    assert asked(AWAY) == (True, []), "it may lie anywhere"


@pytest.mark.parametrize("there", [None, 0, 1, SIMULATED_SIGN - 1])
def test_a_controller_that_refuses_the_register_or_holds_something_else_there_is_real(
    monkeypatch: pytest.MonkeyPatch, there: int | None
) -> None:
    """None: the address does not exist (exception 2)."""
    profile = load_profile("ring")
    at = profile.find("simulated").address
    if there is None:
        held = RegisterBank.readable.func  # type: ignore[attr-defined]

        def without(bank: RegisterBank) -> object:
            return {table: places - {at} for table, places in held(bank).items()}

        monkeypatch.setattr(RegisterBank, "readable", property(without))
    else:
        monkeypatch.setattr("bufferstand.drivers.simulated.wires.controller_registers.SIMULATED_SIGN", there)
    assert asked(profile) == (False, [])
