"""With what it was measured: the stand's channels and their calibrations (``dcc:measuringEquipments``)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any
from xml.etree import ElementTree as ET

from bufferstand.evaluation.report.digital.elements import add, add_text
from bufferstand.evaluation.report.digital.quantities import add_quantity
from bufferstand.evaluation.report.source import ReportRun

_NOT_USED = "Simulated: the stand file's calibration; no such instrument was used."
_STATED = (
    ("accuracy_percent", "Limit of the relative error", "%"),
    ("reversibility_percent", "Limit of the difference rising, falling", "%"),
    ("zero", "Limit of the zero error", ""),
    ("linearity", "Limit of the deviation from the straight line", ""),
    ("drift", "Limit of the drift of the zero during a run", ""),
)
"""Of a channel's ``uncertainty``: key, words, unit (empty: the channel's own)."""


def channels_of(run: ReportRun) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Return the measuring channels of a run, each with the device that sampled it."""
    for stream in (run.fact("streams") or {}).values():
        for channel in stream.get("channels") or []:
            if channel.get("quantity") not in {"command", "position"}:
                yield str(stream.get("device") or ""), channel


def add_equipment(parent: ET.Element, run: ReportRun) -> None:
    """Add the channels of a run with certificate, dates of calibration and validity, and error limits."""
    channels = list(channels_of(run))
    if not channels:
        return
    equipments = add(parent, "measuringEquipments")
    for device, channel in channels:
        _add_channel(equipments, device, channel, simulated=bool(run.simulated))


def _add_channel(parent: ET.Element, device: str, channel: Mapping[str, Any], *, simulated: bool) -> None:
    calibration: Mapping[str, Any] = channel.get("calibration") or {}
    one = add(parent, "measuringEquipment")
    add_text(one, "name", f"channel {channel.get('name')} ({channel.get('quantity')})")
    described = [text for text in (channel.get("place"), device) if text]
    if simulated:
        described.append(_NOT_USED)
    if described:
        add_text(one, "description", *described)
    identified = (
        ("Calibration", calibration.get("id")),
        ("Certificate of calibration", calibration.get("certificate")),
    )
    if any(value for _, value in identified):
        identifications = add(one, "identifications")
        for name, value in identified:
            if value:
                entry = add(identifications, "identification")
                add(entry, "issuer", "calibrationLaboratory")
                add(entry, "value", value)
                add_text(entry, "name", name)
    quantities = add(one, "measuringEquipmentQuantities")
    for key, words in (("date", "Calibrated"), ("valid_until", "Calibration valid until")):
        dated = add(quantities, "measuringEquipmentQuantity")
        add_text(dated, "name", words)
        add_text(dated, "noQuantity", calibration.get(key) or "")
    uncertainty: Mapping[str, Any] = channel.get("uncertainty") or {}
    for key, words, unit in _STATED:
        if uncertainty.get(key) is not None:
            add_quantity(
                quantities,
                words,
                uncertainty[key],
                unit or str(channel.get("unit") or ""),
                element="measuringEquipmentQuantity",
            )
