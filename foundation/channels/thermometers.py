"""The thermometers in the record of a stand file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def recorded_thermometers(stand: Mapping[str, Any]) -> tuple[Mapping[str, Any], ...]:
    """Return each sensor of ``temperature``, which is one table or a list of them, in its order.

    Parameters
    ----------
    stand : mapping
        A stand file as a run file or a campaign folder holds it.
    """
    devices = stand.get("temperature") or ()
    devices = (devices,) if isinstance(devices, Mapping) else devices
    sensors = (
        sensor for device in devices if isinstance(device, Mapping) for sensor in device.get("sensor") or ()
    )
    return tuple(sensor for sensor in sensors if isinstance(sensor, Mapping))  # whoever wrote the document
