"""Ground floor: what every room needs and no room owns (messages, units, files of settings, shared facts)."""

from typing import TYPE_CHECKING

from bufferstand.foundation.lazy_face import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.foundation.clock import (
        DELAYS_TO_SPEED,
        MISSED_CYCLES_MAX_PER_MIN,
        Clock,
        WallClock,
        steady_s,
    )
    from bufferstand.foundation.durations import (
        duration_text,
    )
    from bufferstand.foundation.errors import (
        BadInput,
        CommandRejected,
        DeviceFault,
        ExitStatus,
        NotInCharge,
        WireLost,
    )
    from bufferstand.foundation.force_speed import (
        ForceSpeed,
        curve_problem,
    )
    from bufferstand.foundation.how_called import (
        how_to_add,
        program,
        with_same_imports,
    )
    from bufferstand.foundation.installed import (
        installed_kinds,
    )
    from bufferstand.foundation.json_schemas import (
        json_schema,
    )
    from bufferstand.foundation.line_socket import (
        bind_for_oneself,
        connected,
        exchange,
        short_address,
    )
    from bufferstand.foundation.motions import (
        Commandable,
        ControllerMotion,
        Harmonic,
        RampTo,
        Release,
        StandStill,
        StaticCycles,
    )
    from bufferstand.foundation.plain_text import (
        as_cell,
        counted,
        has_controls,
        plain,
        plain_but_for_displays,
    )
    from bufferstand.foundation.published_campaigns import (
        PAPER_CAMPAIGN,
        PublishedCampaign,
    )
    from bufferstand.foundation.run_kinds import (
        Kind,
    )
    from bufferstand.foundation.run_purposes import (
        Purpose,
    )
    from bufferstand.foundation.sample_rates import (
        LOGGER_HZ,
    )
    from bufferstand.foundation.unguarded_text import (
        NO_TEMPERATURE_STOP,
    )
    from bufferstand.foundation.units import (
        DSI_UNITS,
        FACTORS,
        INSIDE_UNIT,
        conversion,
        to_inside,
    )

__all__ = [
    "DELAYS_TO_SPEED",
    "DSI_UNITS",
    "FACTORS",
    "INSIDE_UNIT",
    "LOGGER_HZ",
    "MISSED_CYCLES_MAX_PER_MIN",
    "NO_TEMPERATURE_STOP",
    "PAPER_CAMPAIGN",
    "BadInput",
    "Clock",
    "CommandRejected",
    "Commandable",
    "ControllerMotion",
    "DeviceFault",
    "ExitStatus",
    "ForceSpeed",
    "Harmonic",
    "Kind",
    "NotInCharge",
    "PublishedCampaign",
    "Purpose",
    "RampTo",
    "Release",
    "StandStill",
    "StaticCycles",
    "WallClock",
    "WireLost",
    "as_cell",
    "bind_for_oneself",
    "connected",
    "conversion",
    "counted",
    "curve_problem",
    "duration_text",
    "exchange",
    "has_controls",
    "how_to_add",
    "installed_kinds",
    "json_schema",
    "loaded_when_used",
    "plain",
    "plain_but_for_displays",
    "program",
    "short_address",
    "steady_s",
    "to_inside",
    "with_same_imports",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
