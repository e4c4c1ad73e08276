"""Of which channels the figures are made, where an acquisition device measures beside the controller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated

from pydantic import BeforeValidator

from bufferstand.foundation.channels import CHANNEL_UNITS, STROKE_CHANNELS, Channel
from bufferstand.foundation.settings import Settings, WrongKeyError


def _as_tuple(value: object) -> object:
    if isinstance(value, str):
        return (value,)
    return tuple(value) if isinstance(value, list) else value


class FigureChannels(Settings):
    """Table ``[figures]``: which channels force and stroke of every figure are."""

    force: str = "force"
    """Name of the channel."""
    stroke: Annotated[tuple[str, ...], BeforeValidator(_as_tuple)] = ()
    """Names of the draw wires whose mean it is, all of one device; none: those of the controller."""

    def demand(self, streams: Mapping[str, Sequence[Channel]]) -> None:
        """Demand that the channels are there.

        Parameters
        ----------
        streams : mapping of str to sequence of Channel
            Of the controller and of the acquisition devices.

        Raises
        ------
        WrongKeyError
            If one is not, or the draw wires are of several devices.
        """
        names = {one.name: one.quantity for channels in streams.values() for one in channels}
        for key, chosen in (("force", (self.force,)), ("stroke", self.stroke)):
            there = sorted(name for name, quantity in names.items() if quantity == key)
            for name in chosen:
                if name not in there:
                    raise WrongKeyError(
                        f"figures.{key} = “{name}” is no {key} of the controller or of [[acquisition]]; "
                        f"there are {', '.join(there)}",
                        ("figures", key),
                    )
        of = {stream for stream, own in streams.items() for one in own if one.name in self.stroke}
        if len(of) > 1:
            raise WrongKeyError(
                f"figures.stroke names draw wires of {' and '.join(sorted(of))}: their mean needs common "
                "instants; name those of one device",
                ("figures", "stroke"),
            )


def demand_beside(channels: Sequence[Channel], place: tuple[str | int, ...]) -> None:
    """Demand of an acquisition device's channels what they must be beside a controller.

    Parameters
    ----------
    channels : sequence of Channel
    place : tuple of str and int
        Of the device in the stand file.

    Raises
    ------
    WrongKeyError
        If one has a name of the controller's own, or another unit.
    """
    for channel in channels:
        units = CHANNEL_UNITS[channel.quantity]
        if channel.unit not in units:
            raise WrongKeyError(
                f"channel “{channel.name}” is in “{channel.unit}”; write unit = “{' or '.join(units)}”, and "
                "a calibration that gives it",
                place,
            )
        known = channel.name in STROKE_CHANNELS if channel.quantity == "stroke" else True
        if channel.name == "force" or not known:
            raise WrongKeyError(
                f"channel “{channel.name}” cannot have this name beside a controller, whose own force and "
                "draw wires are needed for its limits: write “force_2”, or “stroke_3” and “stroke_4” behind "
                "the controller's draw wires, and say in [figures] of which the figures are made",
                place,
            )
