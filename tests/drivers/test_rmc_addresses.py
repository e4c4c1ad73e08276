"""An RMC's addresses by the manual's own numbers, and its 32-bit values in either word order."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.drivers.controllers.rmc import MODELS, RmcAddress, bytes_of, parse_address, words_of
from bufferstand.drivers.controllers.rmc.registers import RmcRegisters, WordOrder


@pytest.mark.parametrize(
    ("text", "modbus"),
    [
        ("%MD12:3", 6151),  # p. 1041
        ("%MD9:56", 4721),  # p. 1041
        ("%MD111.0", 56833),  # p. 1138
        ("%MD111.4", 56841),  # p. 1138
        ("%MD7.2", 3589),  # p. 1110
        ("%MD37.9", 18963),  # p. 1100
        ("%MD40.5", 20491),  # help, RMC75 files 40-47
        ("%MD8.8", 4113),  # help, RMC150 files 8-23
    ],
)
def test_modbus_addresses_are_those_of_the_manual(text: str, modbus: int) -> None:
    address = parse_address(text)
    assert address.modbus == modbus
    assert address.wire == modbus - 1, "the manual counts from 1, the wire from 0"


@pytest.mark.parametrize(("text", "number"), [("%MD8.33", 32801), ("%MD20.10", 81930), ("%MD44.10", 180234)])
def test_addresses_in_commands_are_those_of_the_manual(text: str, number: int) -> None:
    assert parse_address(text).number == number  # pp. 779, 782


def test_the_files_of_both_models_are_those_of_the_manual() -> None:
    assert MODELS["rmc150"].upload(7).modbus == 56833
    assert MODELS["rmc75"].upload(0).modbus == 20481
    assert str(MODELS["rmc75"].setup(5).plus(9)) == "%MD37.9"
    assert str(MODELS["rmc75"].command(1)) == "%MD25.10"
    assert str(MODELS["rmc150"].command(5)) == "%MD40.50"


@pytest.mark.parametrize("text", ["MD8.1", "%MD8", "%MD8.256", "%MD128.0", "%MD8.x", ""])
def test_what_modbus_cannot_reach_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"no register of an RMC|cannot be reached"):
        parse_address(text)


addresses = st.builds(RmcAddress, st.integers(0, 127), st.integers(0, 255))


@given(addresses, st.integers(0, 300))
def test_a_step_of_elements_is_two_addresses_each(address: RmcAddress, steps: int) -> None:
    assert address.plus(steps).wire == address.wire + 2 * steps
    assert parse_address(str(address)) == address


@given(
    st.lists(st.floats(width=32, allow_nan=False), min_size=1, max_size=20),
    st.sampled_from(("big", "little")),
)
def test_reals_come_back_as_they_went(values: list[float], order: WordOrder) -> None:
    kept: dict[int, list[int]] = {}

    def write(address: int, words: object, what: str, once: bool) -> None:
        del what, once
        kept[address] = list(words)  # type: ignore[call-overload]

    registers = RmcRegisters(lambda address, count, _: kept[address][:count], write, order)
    registers.set_reals(RmcAddress(56, 0), values, "values")
    assert registers.reals(RmcAddress(56, 0), len(values), "values") == tuple(values)


def test_the_word_order_is_what_it_says() -> None:
    raw = struct.pack(">f", -1234.5)
    assert words_of(raw, "big") == [0xC49A, 0x5000]
    assert words_of(raw, "little") == [0x5000, 0xC49A]
    assert bytes_of([0x5000, 0xC49A], "little") == raw
