from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.drivers.thermometers.ds18b20 import (
    FAULT_TEXTS,
    ReadingFault,
    TemperatureReading,
    crc8,
    decode_scratchpad,
    decode_w1_slave,
    looks_genuine,
)


def scratchpad(count: int, *, bits: int = 12, byte_6: int = 0x10) -> bytes:
    data = count.to_bytes(2, "little", signed=True) + bytes(
        [0x4B, 0x46, 0x1F | (bits - 9) << 5, 0xFF, byte_6, 0x10]
    )
    return data + bytes([crc8(data)])


def w1_text(pad: bytes, verdict: str = "YES", millidegrees: int = 0) -> str:
    words = " ".join(f"{byte:02x}" for byte in pad)
    return f"{words} : crc={pad[8]:02x} {verdict}\n{words} t={millidegrees}\n"


def test_crc_of_the_known_vectors() -> None:
    # docs/facts/devices.md, measured
    assert crc8(bytes.fromhex("3f004b467fff0110")) == 0x47
    assert crc8(bytes(8)) == 0x00
    assert crc8(b"\xff" * 8) == 0xC9


@pytest.mark.parametrize(
    ("words", "celsius"),
    [("d007", 125.0), ("5005", 85.0), ("9101", 25.0625), ("a200", 10.125), ("0800", 0.5), ("0000", 0.0),
     ("f8ff", -0.5), ("5eff", -10.125), ("6ffe", -25.0625), ("90fc", -55.0)],
)  # fmt: skip
def test_table_of_the_data_sheet(words: str, celsius: float) -> None:
    got = decode_scratchpad(scratchpad(int.from_bytes(bytes.fromhex(words), "little", signed=True)))
    assert got == TemperatureReading(round(celsius * 16), 12)


@given(st.integers(-55 * 16, 125 * 16), st.integers(9, 12))
def test_every_value_is_read_back_with_its_undefined_bits_cleared(count: int, bits: int) -> None:
    if count == 0x07FF:
        return  # stands for too little power
    unit = 1 << 12 - bits
    got = decode_scratchpad(scratchpad(count, bits=bits))
    assert got == TemperatureReading(count // unit * unit, bits) or count // unit * unit < -55 * 16


@given(st.integers(-55 * 16, 125 * 16), st.integers(0, 71))
def test_no_single_flipped_bit_passes(count: int, bit: int) -> None:
    pad = bytearray(scratchpad(count))
    pad[bit // 8] ^= 1 << bit % 8
    assert decode_scratchpad(bytes(pad)) is ReadingFault.CRC_MISMATCH


def test_power_on_value_needs_both_marks() -> None:
    assert decode_scratchpad(scratchpad(0x0550, byte_6=0x0C)) is ReadingFault.POWER_ON
    assert decode_scratchpad(scratchpad(0x0550, byte_6=0x10)) == TemperatureReading(0x0550, 12)
    assert decode_scratchpad(scratchpad(0x0190, byte_6=0x0C)) == TemperatureReading(0x0190, 12)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", ReadingFault.EMPTY),
        ("\n", ReadingFault.EMPTY),
        (w1_text(scratchpad(336), "NO"), ReadingFault.CRC_REFUSED),
        (w1_text(scratchpad(336)[:8] + b"\x00"), ReadingFault.CRC_MISMATCH),
        (w1_text(bytes(9)), ReadingFault.ALL_ZERO),
        (w1_text(b"\xff" * 9), ReadingFault.CRC_MISMATCH),
        (w1_text(scratchpad(0x0550, byte_6=0x0C)), ReadingFault.POWER_ON),
        (w1_text(scratchpad(0x07FF)), ReadingFault.NO_POWER),
        (w1_text(scratchpad(126 * 16)), ReadingFault.OUT_OF_RANGE),
        (w1_text(scratchpad(-56 * 16)), ReadingFault.OUT_OF_RANGE),
        ("21.5\n", ReadingFault.GARBLED),
        ("50 05 4b : crc=1c YES\n", ReadingFault.GARBLED),
    ],
)
def test_each_fault_is_told_apart(text: str, fault: ReadingFault) -> None:
    assert decode_w1_slave(text) is fault


def test_the_bytes_count_not_the_printed_number() -> None:
    assert decode_w1_slave(w1_text(scratchpad(336), millidegrees=99_000)) == TemperatureReading(336, 12)


def test_every_fault_says_where_to_look() -> None:
    assert set(FAULT_TEXTS) == set(ReadingFault)
    assert len(set(FAULT_TEXTS.values())) == len(ReadingFault)
    assert all("look" in text for text in FAULT_TEXTS.values())


def test_a_scratchpad_has_nine_bytes() -> None:
    with pytest.raises(ValueError, match="a scratchpad has 9 bytes, got 8"):
        decode_scratchpad(bytes(8))


def test_clones_are_known_by_their_rom() -> None:
    assert looks_genuine("28-00000a3f91c2")
    assert not looks_genuine("28-3c01d607a2f4")
