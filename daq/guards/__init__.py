"""Guards.

What stops a test. Trips, the kinds of guards, the panel that latches the first trip, and what cannot be
guarded.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.guards.catalogue import (
        demand_own_tables,
    )
    from bufferstand.daq.guards.from_limits import (
        guards_for,
    )
    from bufferstand.daq.guards.guard import (
        Beside,
        Found,
        Guard,
    )
    from bufferstand.daq.guards.margin import (
        Margin,
    )
    from bufferstand.daq.guards.missing_guards import (
        UNGUARDED_AT_SPEED,
        demand_consent,
        demand_thermometers,
        unguarded,
        unguarded_at,
        watching_of,
        what_is_unguarded,
    )
    from bufferstand.daq.guards.panel import (
        GuardPanel,
        GuardSet,
    )
    from bufferstand.daq.guards.sights import (
        Computer,
        Phase,
        RecorderState,
        Samples,
        Sight,
    )
    from bufferstand.daq.guards.site import (
        ACTIONS,
        CONTROLLER_STREAM,
        FORCE_2_STREAM,
        Site,
    )
    from bufferstand.daq.guards.trips import (
        Action,
        Trip,
        run_status,
    )

__all__ = [
    "ACTIONS",
    "CONTROLLER_STREAM",
    "FORCE_2_STREAM",
    "UNGUARDED_AT_SPEED",
    "Action",
    "Beside",
    "Computer",
    "Found",
    "Guard",
    "GuardPanel",
    "GuardSet",
    "Margin",
    "Phase",
    "RecorderState",
    "Samples",
    "Sight",
    "Site",
    "Trip",
    "demand_consent",
    "demand_own_tables",
    "demand_thermometers",
    "guards_for",
    "run_status",
    "unguarded",
    "unguarded_at",
    "watching_of",
    "what_is_unguarded",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
