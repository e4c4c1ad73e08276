"""All standard data sets."""

from __future__ import annotations

from tests.validation.making.closed_form import closed_form_sets
from tests.validation.making.noisy import noisy_sets
from tests.validation.making.standard_set import StandardSet
from tests.validation.making.static import static_sets
from tests.validation.making.steps import stepped_sets
from tests.validation.making.timing import timing_sets


def every_set() -> list[StandardSet]:
    """Return all of them, in the order of the validation record."""
    return [*closed_form_sets(), *noisy_sets(), *timing_sets(), *stepped_sets(), *static_sets()]
