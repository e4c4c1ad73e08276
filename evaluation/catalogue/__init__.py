"""Every quantity of a cycle, described once.

What it is, how it is computed, why it is missing, and where it is shown.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.catalogue.cycle_quantities import (
        NOWHERE,
        of_loop,
    )
    from bufferstand.evaluation.catalogue.every_quantity import (
        MAIN,
        OF_LOOP,
        OF_THERMOMETER,
        OF_TURNS,
        QUANTITIES,
        SETTLING,
    )
    from bufferstand.evaluation.catalogue.published_values import (
        PUBLISHED_VALUES,
        PublishedValue,
        published,
    )
    from bufferstand.evaluation.catalogue.quantity import (
        KINDS,
        NOT_FINITE,
        Catalogue,
        Channel,
        InCycles,
        Quantity,
        Rounding,
    )

__all__ = [
    "KINDS",
    "MAIN",
    "NOT_FINITE",
    "NOWHERE",
    "OF_LOOP",
    "OF_THERMOMETER",
    "OF_TURNS",
    "PUBLISHED_VALUES",
    "QUANTITIES",
    "SETTLING",
    "Catalogue",
    "Channel",
    "InCycles",
    "PublishedValue",
    "Quantity",
    "Rounding",
    "of_loop",
    "published",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
