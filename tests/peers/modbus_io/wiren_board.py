"""A Wiren Board WB-M1W2 with two DS18B20, from its wiki page (docs/facts/devices.md).

Input registers 7 and 8: °C × 16, signed, 0x7FFF in error; 20 and 21 keep the last valid value, and discrete
inputs 16 and 17 say whether the sensor is well; the six bytes of its model's signature lie at 200, one in a
register.
"""

from __future__ import annotations

from dataclasses import dataclass

from tests.peers.modbus_io.wire import ILLEGAL_ADDRESS, ILLEGAL_FUNCTION, Refused

ERROR = 0x7FFF
SIGNATURE = b"WBM1W2"
"""Which six bytes it has is not on the page: these are the emulator's own."""


@dataclass
class M1W2:
    """One; None is a sensor that is off.

    Parameters
    ----------
    first, second : float or None
        Temperatures [°C].
    """

    first: float | None = 20.0
    second: float | None = 20.0
    unit: int = 1
    _kept: tuple[int, int] = (0, 0)

    def registers(self, function: int, address: int, count: int) -> list[int]:
        """Return input registers; the signature also as holding registers."""
        if function not in {3, 4}:
            raise Refused(ILLEGAL_FUNCTION)
        words = [ERROR if one is None else round(one * 16.0) & 0xFFFF for one in (self.first, self.second)]
        self._kept = tuple(  # type: ignore[assignment]
            old if one is None else new
            for one, new, old in zip((self.first, self.second), words, self._kept, strict=True)
        )
        content = {200 + place: byte for place, byte in enumerate(SIGNATURE)}
        if function == 4:
            content |= {7: words[0], 8: words[1], 20: self._kept[0], 21: self._kept[1]}
        if any(one not in content for one in range(address, address + count)):
            raise Refused(ILLEGAL_ADDRESS)
        return [content[one] for one in range(address, address + count)]

    def bits(self, function: int, address: int, count: int) -> list[bool]:
        """Return whether each sensor is well."""
        content = {16: self.first is not None, 17: self.second is not None}
        if function != 2 or any(one not in content for one in range(address, address + count)):
            raise Refused(ILLEGAL_ADDRESS)
        return [content[one] for one in range(address, address + count)]
