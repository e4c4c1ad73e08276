"""Checks that the device is that of the profile; if not, says if device, address or word order is wrong."""

from __future__ import annotations

from collections.abc import Sequence

from bufferstand.drivers.register_maps import Layout, Profile, encode_value


def find_mismatch(profile: Profile, window: Layout, registers: Sequence[int]) -> str:
    """Return what is wrong with the test values in a window of registers, and where to look.

    Parameters
    ----------
    profile : Profile
        The register map with its expected values.
    window : Layout
        The window that was read.
    registers : sequence of int
        What was read.

    Returns
    -------
    str
        Empty where every expected value is there.
    """
    expected = _expected_words(profile, window, profile.word_order)
    if _fits(expected, registers, 0):
        return ""
    other_order = "little" if profile.word_order == "big" else "big"
    if _fits(_expected_words(profile, window, other_order), registers, 0):
        return (
            f"its 32-bit values come with the other word first: the profile says word_order = "
            f"“{profile.word_order}”, the device sends “{other_order}”; set it in the profile"
        )
    swapped = {offset: {_swap_bytes(word) for word in words} for offset, words in expected.items()}
    if _fits(swapped, registers, 0):
        return "the bytes inside its registers are swapped; look at the device's (or gateway's) byte order"
    for shift, numbering in ((1, "one too high"), (-1, "one too low")):
        for order in (profile.word_order, other_order):
            if _fits(_expected_words(profile, window, order), registers, shift):
                return (
                    f"its registers are {numbering} by address: device_type is at "
                    f"{window.address + shift}, not {window.address} (numbered from 1 instead of 0?); "
                    "look at the addresses in the profile"
                )
    return _first_difference(profile, window, registers)


def _expected_words(profile: Profile, window: Layout, word_order: str) -> dict[int, set[int]]:
    """Return the words that test values may make, by offset in the window."""
    words: dict[int, set[int]] = {}
    for place in window.places:
        register = profile.find(place.name)
        if register.expect is not None:
            own = place.word_order or word_order
            for offset, word in enumerate(encode_value(register.expect, place.kind, own), start=place.offset):
                words[offset] = {word}
            for other in register.accept:  # one word each
                words[place.offset] |= set(encode_value(other, place.kind, own))
    return words


def _fits(expected: dict[int, set[int]], registers: Sequence[int], shift: int) -> bool:
    """Return whether the words are there, moved by ``shift``; what falls outside the window is not judged."""
    inside = {offset + shift: words for offset, words in expected.items()}
    return all(registers[offset] in words for offset, words in inside.items() if 0 <= offset < len(registers))


def _swap_bytes(word: int) -> int:
    return (word & 0xFF) << 8 | word >> 8


def _first_difference(profile: Profile, window: Layout, registers: Sequence[int]) -> str:
    values = window.decode(registers)
    for name, value in values.items():
        register = profile.find(name)
        if register.expect is None or value == register.expect or value in register.accept:
            continue
        shown, wanted = (
            (f"{value}", f"{register.expect}")
            if register.type == "f32"
            else (f"0x{int(value):X}", f"0x{int(register.expect):X}")
        )
        where = f"register {name} (address {register.address}) holds {shown} instead of {wanted}"
        if name == "device_type":
            return f"{where}: another device answers here; look at host, port and device_id"
        if name == "profile_version":
            return f"{where}: its firmware has another register map; look for a profile of that version"
        return f"{where}: the test value is wrong; look at the register profile"
    return "its test values differ from the profile; look at the register profile"
