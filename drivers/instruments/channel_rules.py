"""What a channel of a stand file must be."""

from __future__ import annotations

from bufferstand.foundation.channels import Channel
from bufferstand.foundation.settings import WrongKeyError


def demand_channel(channel: Channel, quantity: str, unit: str, *, place: tuple[str | int, ...]) -> None:
    """Demand the quantity and unit that a channel of this name has everywhere in the house.

    Parameters
    ----------
    channel : Channel
    quantity, unit : str
        What is wanted of it.
    place : tuple of str and int
        Of the channel in its table, for the message.

    Raises
    ------
    WrongKeyError
        With what to write.
    """
    if channel.quantity != quantity:
        raise WrongKeyError(
            f"quantity = “{channel.quantity}” is not possible for the channel “{channel.name}”; write "
            f"quantity = “{quantity}” and unit = “{unit}”",
            (*place, "quantity"),
        )
    if channel.unit != unit:
        raise WrongKeyError(
            f"unit = “{channel.unit}” is not possible for the channel “{channel.name}”; write unit = "
            f"“{unit}”, and in its calibration coefficients that give {unit}",
            (*place, "unit"),
        )
