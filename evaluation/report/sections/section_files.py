"""Sections that stand in a file of their own beside the others: found by its name, and named nowhere else.

Such a file's name ends in ``_section.py``, and it has ``SECTION``, an :class:`AddedSection`.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module

from bufferstand.evaluation.report.content import Section
from bufferstand.evaluation.report.source import ReportSource

BuildSection = Callable[[ReportSource], Section | None]
"""Makes a section of a report's source; None where there is nothing to say."""


@dataclass(frozen=True)
class AddedSection:
    """A section of a file of its own.

    Attributes
    ----------
    build : callable
        Makes it.
    after : str
        Name of the function that makes the section before it (``cycles_section``).
    """

    build: BuildSection
    after: str


def with_added(sections: Sequence[BuildSection]) -> tuple[BuildSection, ...]:
    """Return the sections of a report in their order, with those of files of their own.

    Two after the same one are in the order of their files' names.

    Raises
    ------
    TypeError
        If such a file has no ``SECTION``.
    ValueError
        If one is to be after a section that is not among ``sections``.
    """
    after: dict[str, list[BuildSection]] = {build.__name__: [] for build in sections}
    package = __name__.rpartition(".")[0]
    for module in pkgutil.iter_modules(import_module(package).__path__):
        if not module.name.endswith("_section"):
            continue
        added = getattr(import_module(f"{package}.{module.name}"), "SECTION", None)
        if not isinstance(added, AddedSection):
            raise TypeError(f"{package}.{module.name} has no SECTION that is an AddedSection")
        if added.after not in after:
            known = ", ".join(after)
            raise ValueError(f"{package}.{module.name}: nothing is made by “{added.after}”; known: {known}")
        after[added.after].append(added.build)
    return tuple(one for build in sections for one in (build, *after[build.__name__]))
