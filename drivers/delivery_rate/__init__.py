"""How many samples a second a wire delivers: in blocks from a ring, or by single polls."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.delivery_rate.blocks import (
        FEED_S,
        STATUS_LONGEST_S,
        WORK_S,
        Delivery,
        status_rest_s,
    )
    from bufferstand.drivers.delivery_rate.polls import (
        LEFT_OUT_SHARE,
        PollDelivery,
    )

__all__ = [
    "FEED_S",
    "LEFT_OUT_SHARE",
    "STATUS_LONGEST_S",
    "WORK_S",
    "Delivery",
    "PollDelivery",
    "status_rest_s",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
