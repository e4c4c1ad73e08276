"""Entries of a stand file for Modbus I/O, as the tests write them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bufferstand.drivers.acquisition.modbus_io.settings import ModbusIoSettings

Wanted = Mapping[str, tuple[str, str, str, Sequence[float]]]
"""Point → name, quantity, unit and calibration of its channel."""


def io_entry(description: str, wanted: Wanted, **keys: Any) -> ModbusIoSettings:
    """Return an entry with an input for each wanted point."""
    inputs = [
        {
            "point": point,
            "channel": {
                "name": name,
                "quantity": quantity,
                "unit": unit,
                "calibration": {"id": name, "coefficients": list(coefficients)},
            },
        }
        for point, (name, quantity, unit, coefficients) in wanted.items()
    ]
    content = {"kind": "modbus-io", "description": description, "input": inputs, **keys}
    return ModbusIoSettings.model_validate(content)


def wago_entry(port: int, **keys: Any) -> ModbusIoSettings:
    """Return a WAGO 750-456 as the first module of a node: force on AI1 (63 kN/V), stroke on AI2."""
    wanted = {
        "AI1": ("force", "force", "kN", [0.0, 63.0]),
        "AI2": ("stroke_1", "stroke", "mm", [0.0, 50.0]),
    }
    keys = {"rate_Hz": 50.0, "answers": {"first_word": 0}, "host": "127.0.0.1", "port": port} | keys
    return io_entry("wago-750-10v", wanted, **keys)
