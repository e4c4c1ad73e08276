"""Every quantity of a cycle, from every file of this folder that has entries.

Such a file's name ends in ``_quantities.py``, and it has ``ENTRIES``. Those of
:mod:`bufferstand.evaluation.catalogue.cycle_quantities` come first, then the others in the order of the
files' names: a further quantity moves neither a column nor a random number of those that were there before.
"""

from __future__ import annotations

import pkgutil
from importlib import import_module

from bufferstand.evaluation.catalogue import cycle_quantities
from bufferstand.evaluation.catalogue.quantity import Catalogue


def _entries() -> Catalogue:
    package = __name__.rpartition(".")[0]
    found = list(cycle_quantities.ENTRIES)
    for module in pkgutil.iter_modules(import_module(package).__path__):
        name = f"{package}.{module.name}"
        if name.endswith("_quantities") and name != cycle_quantities.__name__:
            found += import_module(name).ENTRIES
    return Catalogue(found)


QUANTITIES = _entries()
"""In the order of the document's columns."""
MAIN = QUANTITIES.that(lambda entry: entry.shown.main)
"""The main results."""
OF_TURNS = QUANTITIES.that(lambda entry: entry.needs == "turns")
OF_LOOP = QUANTITIES.that(lambda entry: entry.needs == "loop")
OF_THERMOMETER = QUANTITIES.that(lambda entry: entry.needs == "thermometer")
SETTLING = Catalogue(
    sorted(QUANTITIES.that(lambda entry: entry.shown.settled), key=lambda entry: entry.settled.place)
)
"""Those of which ``settling`` of the document tells, in the order in which it does."""
