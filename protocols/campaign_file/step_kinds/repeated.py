"""Steps that are run several times over, in the order in which they are written."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from bufferstand.protocols.campaign_file.step_kinds.common import Named, as_tuple
from bufferstand.protocols.campaign_file.step_kinds.cyclic import SweepStep
from bufferstand.protocols.campaign_file.step_kinds.kind_check import checked_kind
from bufferstand.protocols.campaign_file.step_kinds.single_steps import SingleStep

MOST_TIMES = 1000
"""So often at most steps are repeated; more is a slip of the pen."""
NESTED_KINDS = (
    "static", "harmonic", "sweep", "hold", "conditioning", "inner-loops", "motion", "cool-down", "touch",
    "warm-up", "force-cycles",
)  # fmt: skip
"""Kinds of ``[[step.step]]``."""

_Nested = Annotated[
    Annotated[SingleStep | SweepStep, Field(discriminator="kind")],
    BeforeValidator(
        checked_kind(
            NESTED_KINDS, ("repeat",), "steps are repeated on one level only; write its steps out instead"
        )
    ),
]


class RepeatStep(Named):
    """``[[step.step]]`` in order, ``times`` times over."""

    kind: Literal["repeat"]
    times: int = Field(ge=1, le=MOST_TIMES)
    """How often, 1 to 1000."""
    step: Annotated[tuple[_Nested, ...], BeforeValidator(as_tuple), Field(min_length=1)]
    """``[[step.step]]``: steps of any kind but ``repeat``."""

    def keeps_order(self) -> bool:
        """Return whether its steps stay where they are whatever their kind: else it would repeat nothing."""
        return self.keep_order is not False
