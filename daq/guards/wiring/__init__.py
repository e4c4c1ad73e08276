"""Does the stand measure what it moves? Signals compared with each other, against the command and the plan.

Every guard elsewhere believes its signal. Here signals are doubted: sign, scale, zero and delay of force,
draw wires and piston are seen in the first slow motion, before any great force; later a wire that slips, a
force that leaves its specimen's curve, a thermometer that does not show the heat. Each judge is a file of
its own; what it holds against what, and by how much that may differ, is stated there.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.guards.wiring.doubt import (
        SignalDoubt,
        channel_setting,
        doubt_trip,
    )
    from bufferstand.daq.guards.wiring.expectations import (
        little_expected,
        wiring_guard,
    )
    from bufferstand.daq.guards.wiring.first_touch import (
        TouchOutcome,
        doubt_of_touch,
        has_risen,
        scatter_doubt,
    )
    from bufferstand.daq.guards.wiring.sample_stretch import (
        SampleStretch,
        noise_of,
    )
    from bufferstand.daq.guards.wiring.settings import (
        Compared,
        ForceCurve,
        WiringGuard,
    )
    from bufferstand.daq.guards.wiring.trip_reason import (
        Limited,
    )
    from bufferstand.daq.guards.wiring.wiring_watch import (
        WiringWatch,
    )

__all__ = [
    "Compared",
    "ForceCurve",
    "Limited",
    "SampleStretch",
    "SignalDoubt",
    "TouchOutcome",
    "WiringGuard",
    "WiringWatch",
    "channel_setting",
    "doubt_of_touch",
    "doubt_trip",
    "has_risen",
    "little_expected",
    "noise_of",
    "scatter_doubt",
    "wiring_guard",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
