"""Settings from TOML files: strict schemas, bounds, and messages with file, line, key and remedy."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.foundation.settings.allowed_values import (
        SchemaPlace,
        Within,
        alternatives,
        fields_by_key,
    )
    from bufferstand.foundation.settings.loading import (
        Day,
        Moment,
        Numbers,
        Settings,
        demand_named,
        demand_within,
        load_settings,
        load_shipped_or_own,
        parse_settings,
        read_text,
        refusal,
        shipped_names,
        toml_document,
    )
    from bufferstand.foundation.settings.messages import (
        nearest_key,
        shown,
    )
    from bufferstand.foundation.settings.physical import (
        COEFFICIENT,
        COUNTS,
        CYCLES,
        CYCLES_OR_NONE,
        DURATION_S,
        ENERGY_J,
        FACTOR,
        FIGURE,
        FORCE_KN,
        FREQUENCY_HZ,
        HEAT_CAPACITY_J_PER_K,
        HEAT_LOSS_W_PER_K,
        LENGTH_MM,
        LENGTH_SCALE_MM,
        LINE,
        NOT_NEGATIVE,
        PER_K,
        REST_H,
        SCALE,
        SHARE,
        SIGNED_FORCE_KN,
        SLOPE_KN_PER_MM,
        SPEED_KM_H,
        SPEED_MM_PER_S,
        STIFFNESS_KN_PER_MM,
        TEMPERATURE_C,
        TIME_CONSTANT_S,
    )
    from bufferstand.foundation.settings.places import (
        place_of,
    )
    from bufferstand.foundation.settings.toml_text import (
        NotToml,
        toml_content,
    )
    from bufferstand.foundation.settings.wrong_key import (
        WrongKeyError,
    )

__all__ = [
    "COEFFICIENT",
    "COUNTS",
    "CYCLES",
    "CYCLES_OR_NONE",
    "DURATION_S",
    "ENERGY_J",
    "FACTOR",
    "FIGURE",
    "FORCE_KN",
    "FREQUENCY_HZ",
    "HEAT_CAPACITY_J_PER_K",
    "HEAT_LOSS_W_PER_K",
    "LENGTH_MM",
    "LENGTH_SCALE_MM",
    "LINE",
    "NOT_NEGATIVE",
    "PER_K",
    "REST_H",
    "SCALE",
    "SHARE",
    "SIGNED_FORCE_KN",
    "SLOPE_KN_PER_MM",
    "SPEED_KM_H",
    "SPEED_MM_PER_S",
    "STIFFNESS_KN_PER_MM",
    "TEMPERATURE_C",
    "TIME_CONSTANT_S",
    "Day",
    "Moment",
    "NotToml",
    "Numbers",
    "SchemaPlace",
    "Settings",
    "Within",
    "WrongKeyError",
    "alternatives",
    "demand_named",
    "demand_within",
    "fields_by_key",
    "load_settings",
    "load_shipped_or_own",
    "nearest_key",
    "parse_settings",
    "place_of",
    "read_text",
    "refusal",
    "shipped_names",
    "shown",
    "toml_content",
    "toml_document",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
