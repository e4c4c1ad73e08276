"""From campaign file to plan: expansion, order, temperatures, estimates, and planning again what is left."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.protocols.planning.plan import (
        HEADER,
        Plan,
        expected_total_s,
        make_plan,
    )
    from bufferstand.protocols.planning.replanning import (
        Replanner,
    )
    from bufferstand.protocols.planning.standard_conditions import (
        missed_conditions,
    )
    from bufferstand.protocols.planning.step_text import (
        asked_text,
        canonical_text,
    )
    from bufferstand.protocols.planning.stroke_history import (
        stroke_over_time,
    )
    from bufferstand.protocols.planning.temperature_limits import (
        limits_of,
    )
    from bufferstand.protocols.planning.unwatched_heating import (
        demand_heat_is_seen,
    )

__all__ = [
    "HEADER",
    "Plan",
    "Replanner",
    "asked_text",
    "canonical_text",
    "demand_heat_is_seen",
    "expected_total_s",
    "limits_of",
    "make_plan",
    "missed_conditions",
    "stroke_over_time",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
