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
        demand_within,
        load_settings,
        parse_settings,
        place_of,
        read_text,
        refusal,
    )
    from bufferstand.foundation.settings.messages import (
        nearest_key,
        shown,
    )
    from bufferstand.foundation.settings.wrong_key import (
        WrongKeyError,
    )

__all__ = [
    "Day",
    "Moment",
    "Numbers",
    "SchemaPlace",
    "Settings",
    "Within",
    "WrongKeyError",
    "alternatives",
    "demand_within",
    "fields_by_key",
    "load_settings",
    "nearest_key",
    "parse_settings",
    "place_of",
    "read_text",
    "refusal",
    "shown",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
