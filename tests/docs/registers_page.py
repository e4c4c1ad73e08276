"""Make the page of registers from the profile: python -m tests.docs.registers_page > docs/registers.md"""

from __future__ import annotations

from collections.abc import Iterator

from bufferstand.drivers.register_maps import Profile, ProfileRegister, load_profile

HEAD = """\
# Registers of a controller with a sample ring

Made from `drivers/register_maps/profiles/ring.toml` by `python -m tests.docs.registers_page`; a test
compares it.
Addresses are wire addresses from 0 on. 32-bit values take two registers. How they are used:
[devices and wires](drivers.md#the-register-profile).

| address | name | type | access | unit | meaning |
|---|---|---|---|---|---|
"""


def text_of(value: float) -> str:
    """Return a test value: a whole number as the registers show it."""
    return f"{value:#x}" if isinstance(value, int) else f"{value:g}"


def meaning(register: ProfileRegister) -> str:
    """Return what a register must hold, and what it means."""
    must = (
        [] if register.expect is None else [text_of(value) for value in (register.expect, *register.accept)]
    )
    holds = [f"must hold {' or '.join(must)}"] if must else []
    return "; ".join(holds + [register.description] * bool(register.description))


def rows(profile: Profile) -> Iterator[str]:
    """Yield one row for each register."""
    for one in profile.registers.values():
        cells = (str(one.address), f"`{one.name}`", one.type, one.access, one.unit, meaning(one))
        yield f"| {' | '.join(cells)} |\n"


def page() -> str:
    """Return the page."""
    profile = load_profile("ring")
    ring = profile.ring
    parts = [", ".join(f"`{name}` {kind}" for name, kind in part) for part in (ring.header, ring.sample)]
    tail = (
        f"\n## The window of the ring\n\nIt begins at address {ring.address} and has {ring.registers} "
        f"registers: a header ({parts[0]}) and {ring.samples_per_block} samples of {ring.sample_words} "
        f"registers ({parts[1]}; `tick` in µs).\n\nIts meaning: {ring.description}.\n"
    )
    return HEAD + "".join(rows(profile)) + tail


if __name__ == "__main__":
    print(page(), end="")
