"""The stand before and beside a campaign.

In use or free, checks before a start, live readings, motions by hand.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.stand.calibration_dates import (
        expired_calibrations,
    )
    from bufferstand.daq.stand.in_use import (
        await_free,
        give_back,
        look_at_use,
        rests_long,
        use_trouble,
    )
    from bufferstand.daq.stand.manual import (
        FORCE_MAX_KN,
        RELEASE_SPEED_MM_PER_S,
        ManualLimits,
        ManualStand,
        by_hand,
        watchdog_s,
    )
    from bufferstand.daq.stand.readings import (
        ChannelReading,
        StandReader,
    )
    from bufferstand.daq.stand.start_checks import (
        apart_trouble,
        delivery_remark,
        delivery_trouble,
        disk_trouble,
        first_look,
        forces_doubt,
        specimen_gaps,
        stroke_trouble,
        wires_doubt,
        zero_trouble,
    )

__all__ = [
    "FORCE_MAX_KN",
    "RELEASE_SPEED_MM_PER_S",
    "ChannelReading",
    "ManualLimits",
    "ManualStand",
    "StandReader",
    "apart_trouble",
    "await_free",
    "by_hand",
    "delivery_remark",
    "delivery_trouble",
    "disk_trouble",
    "expired_calibrations",
    "first_look",
    "forces_doubt",
    "give_back",
    "look_at_use",
    "rests_long",
    "specimen_gaps",
    "stroke_trouble",
    "use_trouble",
    "watchdog_s",
    "wires_doubt",
    "zero_trouble",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
