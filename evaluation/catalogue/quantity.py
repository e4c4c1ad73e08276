"""What a quantity of a cycle is: one entry says all of it, and everything that lists quantities reads it.

The entries are in :mod:`bufferstand.evaluation.catalogue.cycle_quantities`. An entry that is incomplete or
contradicts itself is refused when it is made, by its name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal, NamedTuple, get_args

from bufferstand.foundation import Kind

Needs = Literal["turns", "loop", "thermometer"]
"""What a cycle must have: both turning points, its whole loop, or readings of the specimen's temperature."""
Channel = Literal["force", "stroke", "temperature"]
NOT_FINITE = "it is not finite"
"""Why a figure is missing that is computed of every cycle."""
UNITS = ("mm", "kN", "mm/s", "Hz", "J", "1", "kN/mm", "°C")
KINDS = frozenset(get_args(Kind))


class Incomplete(ValueError):  # noqa: N818 - it is the entry that is incomplete
    """An entry of the catalogue that lacks a fact or contradicts itself; the text names both."""


class Rounding(NamedTuple):
    """How many digits are printed where no uncertainty tells.

    ``significant`` digits where they are given, else ``decimals``; of a value below ``finer_below`` one more.
    """

    decimals: int
    significant: int | None = None
    finer_below: float = 0.0


class Trended(NamedTuple):
    """A trend over frequency: its name in the document, the caption, the axis, and where it is looked for.

    ``amplitudes``: also at constant prestress alone, where the amplitude varies. ``two_sided``: whether the
    figure means something of a loop whose force changes sign.
    """

    name: str
    caption: str
    axis: str
    amplitudes: bool
    two_sided: bool


class Settled(NamedTuple):
    """A row of ``settling``: its place there, and its heading in the report (empty: not printed)."""

    place: int
    heading: str


class InCycles(NamedTuple):
    """A column of the report's tables of cycles: which of the two, and its place there."""

    table: Literal["motion", "energy"]
    place: int


class OnScreen(NamedTuple):
    """A column in the terminal or on the monitor: heading and decimals."""

    heading: str
    decimals: int


@dataclass(frozen=True, kw_only=True)
class Shown:
    """Where a quantity is shown besides the document, the tables of data, ``--where`` and docs/symbols.md.

    Attributes
    ----------
    main : bool
        One of the main results: with U cycle by cycle, a budget, and the figure of differences.
    heading : str
        Of its column in the report.
    beside_loops : bool
        Whether it stands beside the report's figures of loops.
    runs : str or None
        What of it the report's table of runs shows: the mean over cycles, or the extreme of all samples.
    compared : str or None
        Its name in the comparison of specimens; None: not compared.
    before_after : bool
        Whether a step that is repeated later is compared with the first by it.
    cycles, settled, trend, terminal, archive, monitor
        Whether and how it is there; None: it is not.
    """

    main: bool
    heading: str
    cycles: InCycles | None
    beside_loops: bool
    runs: Literal["mean", "extreme"] | None
    compared: str | None
    before_after: bool
    settled: Settled | None
    trend: Trended | None
    terminal: OnScreen | None
    archive: OnScreen | None
    monitor: OnScreen | None


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """One quantity of a cycle.

    Attributes
    ----------
    name : str
        In files and interfaces, with its unit.
    path : tuple of str
        Where it stands in a cycle of the evaluation document: a key, or a group and a key.
    symbol, label, unit : str
        Formula symbol (may be empty), words, and unit (``1``: none).
    rounding : Rounding
    meaning, source : str
        What it is, in a line, and where that is from (may be empty). They go into docs/symbols.md.
    kinds : frozenset of str
        Kinds of run of which it means something.
    reads : frozenset of str
        Channels that it is read from: a fault of one of them spoils it.
    needs : str
        What a cycle must have.
    compute : callable
        Returns the values of many cycles, NaN where one is missing. It is given
        :class:`bufferstand.evaluation.quantities.loop_readings.TurnFigures`, ``LoopFigures``, or the
        temperatures at the start and the highest, as ``needs`` says.
    why_missing : str or callable
        The reason where a value is missing. A function is given what ``compute`` is, and the place of the
        cycle, and returns it.
    propagate : callable
        Returns a draw of each Monte Carlo trial, shape (N,), or None where it has none. It is given
        :class:`bufferstand.evaluation.uncertainty.other_draws.DrawnTurns`, of a loop ``DrawnLoop``.
    why_no_u : str
        The reason where ``propagate`` gives nothing finite.
    like : str
        What a cycle has in common with a like one that was drawn: U as a ``share`` of the value, or the
        ``same`` U (of what may be close to 0).
    shown : Shown
    """

    name: str
    path: tuple[str, ...]
    symbol: str
    label: str
    unit: str
    rounding: Rounding
    meaning: str
    source: str
    kinds: frozenset[str]
    reads: frozenset[str]
    needs: Needs
    compute: Callable[[Any], Any]
    why_missing: str | Callable[[Any, int], str]
    propagate: Callable[[Any], Any]
    why_no_u: str
    like: Literal["share", "same"]
    shown: Shown

    def __post_init__(self) -> None:
        for why in _faults(self):
            raise Incomplete(f"quantity “{self.name}”: {why}")

    @property
    def printed_unit(self) -> str:
        """The unit as a heading has it: a dash where there is none."""
        return "–" if self.unit == "1" else self.unit

    @property
    def trended(self) -> Trended:
        """Its trend; only of an entry that has one."""
        assert self.shown.trend is not None
        return self.shown.trend

    @property
    def settled(self) -> Settled:
        """Its row of ``settling``; only of an entry that has one."""
        assert self.shown.settled is not None
        return self.shown.settled

    def reason(self, figures: Any, row: int) -> str:
        """Return why the value of a cycle is missing; ``figures`` and ``row`` as for ``why_missing``."""
        return self.why_missing if isinstance(self.why_missing, str) else self.why_missing(figures, row)

    def value_in(self, cycle: Mapping[str, Any]) -> Any:
        """Return the value in a cycle of the evaluation document; None where it is missing."""
        *group, key = self.path
        return (cycle.get(group[0]) or {} if group else cycle).get(key)


_MAY_BE_EMPTY = ("symbol", "source")


def _faults(entry: Quantity) -> Iterator[str]:
    """Yield what an entry lacks, and where two of its facts contradict each other."""
    for field in fields(entry):
        value = getattr(entry, field.name)
        if value is None or (value in ("", (), frozenset()) and field.name not in _MAY_BE_EMPTY):
            yield f"{field.name} is missing"
    shown = entry.shown
    if len(entry.path) > 2:
        yield "path is a key, or a group and a key"
    if entry.unit not in UNITS:
        yield f"unit “{entry.unit}” is none of {', '.join(UNITS)}"
    if entry.needs not in get_args(Needs):
        yield f"needs “{entry.needs}” is none of {', '.join(get_args(Needs))}"
    if unknown := (entry.kinds - KINDS) | (entry.reads - frozenset(get_args(Channel))):
        yield f"unknown kind of run or channel: {', '.join(sorted(unknown))}"
    if not (callable(entry.compute) and callable(entry.propagate)):
        yield "compute and propagate must be functions"
    if not shown.heading:
        yield "shown.heading is missing"
    if shown.main and not entry.symbol:
        yield "a main result needs a symbol, which its budget is headed by"
    if shown.trend is not None and "harmonic" not in entry.kinds:
        yield "a trend over frequency is of harmonic runs"


class Catalogue(tuple[Quantity, ...]):
    """The quantities in the order of the document's columns, each name once."""

    __slots__ = ()

    def __new__(cls, entries: Iterable[Quantity]) -> Catalogue:
        """Refuse entries that take each other's name or place."""
        catalogue = super().__new__(cls, entries)
        for what in ("name", "path"):
            taken = [getattr(entry, what) for entry in catalogue]
            for entry, value in zip(catalogue, taken, strict=True):
                if taken.count(value) > 1:
                    raise Incomplete(f"quantity “{entry.name}”: its {what} is another's, too")
        return catalogue

    @property
    def names(self) -> tuple[str, ...]:
        """The name of every quantity."""
        return tuple(entry.name for entry in self)

    def named(self, name: str) -> Quantity:
        """Return the entry of a name.

        Raises
        ------
        KeyError
            If there is none.
        """
        for entry in self:
            if entry.name == name:
                return entry
        raise KeyError(name)

    def that(self, test: Callable[[Quantity], object]) -> Catalogue:
        """Return the entries that a test holds for, in their order."""
        return Catalogue(entry for entry in self if test(entry))
