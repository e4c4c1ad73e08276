"""Whether the calibrations of a stand hold on the day of a run, in words that must not be missed."""

from __future__ import annotations

from datetime import date

from bufferstand.drivers import Stand


def expired_calibrations(stand: Stand, day: date) -> list[str]:
    """Return one sentence for each channel whose calibration has expired.

    Parameters
    ----------
    stand : Stand
        Controller and sensors with their channels.
    day : date
        Of the run.
    """
    said: list[str] = []
    for facts in (stand.controller.facts, *(sensor.facts for sensor in stand.sensors)):
        for channel in facts.channels:
            calibration = channel.calibration
            if calibration.expired(day):
                named = f"“{calibration.id}”" + (
                    f" ({calibration.certificate})" if calibration.certificate else ""
                )
                said.append(
                    f"the calibration {named} of {channel.name} expired on {calibration.valid_until}: "
                    "figures of this run cannot be traced; calibrate, or enter the new certificate"
                )
    return said
