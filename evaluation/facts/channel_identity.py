"""Identifies the instrument behind an error of a channel, and the setting of it.

Runs that name the same instrument have the same error of it. What a certificate covers (scale, reversibility,
linearity) is one error for as long as the certificate is the same; a zero is set with each specimen; a delay
is that of one setting of the channel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bufferstand.evaluation.facts.document_types import Basis
from bufferstand.foundation.channels import Channel, ChannelUncertainty

_NO_CALIBRATION = ("", "nominal")


@dataclass(frozen=True)
class ChannelIdentity:
    """By what the errors of a channel are known to be those of another run.

    Attributes
    ----------
    instrument : str
        Scale, reversibility and linearity are one error in all runs with the same text.
    zero : str
        So is the error of the zero.
    delay : str
        So is the error of the delay.
    basis : str
    """

    instrument: str
    zero: str
    delay: str
    basis: Basis


@dataclass(frozen=True)
class Occasion:
    """When and with what a run was made: ``stand`` is empty where the record names none.

    ``setting`` is what the zeros were set for: the campaign, or the day, and the specimen.
    """

    stand: str = ""
    setting: str = ""


def identity_of(channel: Channel, occasion: Occasion) -> ChannelIdentity:
    """Return the identity of a channel's errors.

    By its certificate where one is on record (number or date); else by the stand and what the channel
    states; else by what it states alone.
    """
    calibration = channel.calibration
    basis: Basis = "statement"
    text = f"{channel.name}: {_stated(channel.uncertainty)}"
    if calibration.certificate or calibration.date is not None:
        certificate = ", ".join(str(part) for part in (calibration.certificate, calibration.date) if part)
        text, basis = f"{channel.name}: {calibration.id} ({certificate})", "certificate"
    elif occasion.stand:
        # A zero that was found says how good this setting is, and nothing of the instrument.
        lasting = channel.uncertainty.model_copy(update={"zero": None})
        text, basis = f"{channel.name} of {occasion.stand}: {_stated(lasting)}", "stand"
        if calibration.id not in _NO_CALIBRATION:
            text += f", {calibration.id}"
    zero = (
        f"{text}; {channel.uncertainty.zero}, tare {calibration.tare:g}, "
        f"zero at {calibration.zero_counts:g}; {occasion.setting}"
    )
    return ChannelIdentity(text, zero, f"{text}; {channel.delay_s:.9g} s", basis)


def assumed(name: str, uncertainty: ChannelUncertainty) -> ChannelIdentity:
    """Return the identity of a channel of which nothing but its uncertainty is known."""
    text = f"{name}: {_stated(uncertainty)}"
    return ChannelIdentity(text, text, text, "statement")


def weakest(bases: Sequence[Basis]) -> Basis:
    """Return the weakest basis of several; that of a certificate where there are none."""
    order: tuple[Basis, ...] = ("statement", "stand", "certificate")
    return next((basis for basis in order if basis in bases), "certificate")


def _stated(uncertainty: ChannelUncertainty) -> str:
    stated = uncertainty.model_dump(exclude_none=True, exclude={"u_delay_s"})  # that is one of the setting
    return ", ".join(f"{name} {value:g}" for name, value in sorted(stated.items())) or "nothing stated"
