"""From raw counts to a channel's unit: what a certificate or an in-place calibration says, as data.

``counts → input → wiper → unit → temperature → tare``; every stage but the polynomial is optional, and one
that is not there changes no bit. The same object scales a block in the acquisition loop and, years later,
the raw counts in a run file.
"""

from __future__ import annotations

import datetime
import itertools
import math
from collections.abc import Callable
from functools import lru_cache
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BeforeValidator, Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from bufferstand.foundation.settings import Day, Numbers, Settings, Within, WrongKeyError

FloatArray = NDArray[np.float64]

_BISECTIONS = 80


def _as_pairs(value: object) -> object:
    if isinstance(value, list | tuple):
        return tuple(tuple(pair) if isinstance(pair, list) else pair for pair in value)
    return value


Pairs = Annotated[tuple[tuple[float, float], ...], BeforeValidator(_as_pairs)]
"""A TOML array of pairs of numbers."""


Ohm = Annotated[float, Field(gt=0), Within(1.0, 1e12, "less is a short circuit, more is a broken wire")]
PerTenKelvin = Annotated[float, Within(-10.0, 10.0, "10 % in 10 K is no transducer")]
Climate = Annotated[float, Within(-55.0, 125.0, "no transducer works outside −55 … 125 °C")]
Counts = Within(-(2.0**32), 2.0**32, "no converter here has more than 32 bits")
Figure = Within(-1e12, 1e12, "larger than any count times any unit; what it makes of counts is judged, too")


class Divider(Settings):
    """A potentiometer whose wiper is loaded by the input that reads it."""

    potentiometer_ohm: Ohm
    """Whole resistance of the potentiometer [Ω]."""
    input_ohm: Ohm
    """Input resistance of the converter [Ω]."""

    def load(self, wiper: ArrayLike) -> FloatArray:
        """Return what the input reads, as a share of the reference, with the wiper at a share of travel.

        The input lies parallel to the lower part: ``r = x / (1 + k x (1 − x))``, ``k = R / R_input``.
        """
        x = np.asarray(wiper, dtype=np.float64)
        loaded: FloatArray = x / (1.0 + self.potentiometer_ohm / self.input_ohm * x * (1.0 - x))
        return loaded

    def unload(self, ratio: ArrayLike) -> FloatArray:
        """Return where the wiper stands; undoes :meth:`load` exactly.

        The root of ``k r x² + (1 − k r) x − r = 0`` in 0 … 1, in the form that does not cancel.
        """
        r = np.asarray(ratio, dtype=np.float64)
        k = self.potentiometer_ohm / self.input_ohm
        linear = 1.0 - k * r
        wiper: FloatArray = 2.0 * r / (linear + np.sqrt(linear * linear + 4.0 * k * r * r))
        return wiper


class TemperatureEffect(Settings):
    """What the transducer's temperature does to its zero and its sensitivity, by its data sheet."""

    tk0_percent_per_10K: PerTenKelvin = 0.0
    """Shift of the zero, % of the nominal value per 10 K."""
    tkc_percent_per_10K: PerTenKelvin = 0.0
    """Change of the sensitivity, % of the present value per 10 K."""
    nominal: Annotated[float, Field(gt=0), Within(0.1, 20_000.0, "of no transducer of a stand it is more")]
    """Nominal value, in the channel's unit."""
    reference_C: Climate
    """Temperature at which it was calibrated [°C]."""
    at_C: Climate
    """Temperature of the transducer when its zero was set and the test ran [°C]."""

    def correct(self, value: FloatArray, temperature_C: float | None = None) -> FloatArray:
        """Return values as they would be at the reference temperature.

        Parameters
        ----------
        value : NDArray[float64]
            In the channel's unit, any shape.
        temperature_C : float, optional
            A measured temperature instead of ``at_C`` [°C].
        """
        tens_K = ((self.at_C if temperature_C is None else temperature_C) - self.reference_C) / 10.0
        shift = self.tk0_percent_per_10K / 100.0 * tens_K * self.nominal
        corrected: FloatArray = (value - shift) / (1.0 + self.tkc_percent_per_10K / 100.0 * tens_K)
        return corrected

    def disturb(self, value: FloatArray) -> FloatArray:
        """Return what the transducer shows at ``at_C`` of true values; undoes :meth:`correct`."""
        tens_K = (self.at_C - self.reference_C) / 10.0
        shift = self.tk0_percent_per_10K / 100.0 * tens_K * self.nominal
        shown: FloatArray = value * (1.0 + self.tkc_percent_per_10K / 100.0 * tens_K) + shift
        return shown


class Branch:
    """Where a channel stands between the rising and the falling branch: memory from block to block.

    The play (backlash) operator: the state follows the counts by ``turn`` before it turns with them, so
    that the value moves from one branch to the other without a jump, and noise smaller than the play does
    not turn it. Integer counts make it exact: blocks of any length give the same as the whole.
    """

    def __init__(self) -> None:
        self._last: float | None = None
        self._play = 0.0

    def follow(self, counts: FloatArray, turn: float) -> FloatArray:
        """Return the share of the falling branch, 0 … 1, for counts in their order; same shape."""
        play, last = self._play, self._last
        plays: list[float] = []
        for count in counts.ravel().tolist():
            if not math.isnan(count):  # a missing value turns nothing
                if last is not None:
                    play -= count - last
                    play = 0.0 if play < 0.0 else min(play, turn)
                last = count
            plays.append(play)
        self._play, self._last = play, last
        return np.array(plays).reshape(counts.shape) / turn


class Calibration(Settings):
    """How raw counts become the channel's unit.

    Without the optional stages ``value = Σ coefficients[i] · counts**i``.
    """

    id: str = "nominal"
    """Short name, for run files and reports."""
    coefficients: Annotated[Numbers, Figure] = Field(default=(0.0, 1.0), min_length=1)
    """Polynomial of the input, lowest power first; with ``falling`` the rising branch."""
    certificate: str = ""
    """Number of the certificate."""
    date: Day | None = None
    """Day of the calibration."""
    valid_until: Day | None = None
    """Last day of its validity."""

    zero_counts: Annotated[float, Counts] = 0.0
    """Counts at zero input: what it shows with nothing on it."""
    input_per_count: Annotated[float, Figure] = Field(default=1.0)
    """Input of one count: mV/V behind an amplifier, share of the reference behind a converter."""
    input_unit: str = ""
    """Unit of the input, e.g. ``mV/V``; for the reader."""
    divider: Divider | None = None
    """Loading of the wiper; the input is a share of the reference then."""
    table: Annotated[Pairs, Figure] = ()
    """In-place calibration: pairs of input and value, instead of the polynomial; monotone in between."""
    falling: Annotated[Numbers, Figure] = ()
    """Polynomial of the falling branch, where the certificate has one."""
    turn_counts: Annotated[float, Counts] = Field(default=0.0, ge=0)
    """Counts of reversal over which the value moves from one branch to the other."""
    temperature: TemperatureEffect | None = None
    """Effect of the temperature: ``tk0_percent_per_10K`` (of ``nominal``), ``tkc_percent_per_10K`` (of the
    value), ``reference_C``, ``at_C``.
    """
    tare: Annotated[float, Within(-10_000.0, 10_000.0, "more than any channel of a stand shows")] = 0.0
    """Subtracted at the end, in the channel's unit."""

    @model_validator(mode="after")
    def _stages_fit(self) -> Calibration:
        if self.input_per_count == 0.0:
            raise WrongKeyError(
                "input_per_count = 0 would make every value the same; write the input of one count",
                "input_per_count",
            )
        if self.falling and self.turn_counts <= 0.0:
            raise WrongKeyError(
                "a falling branch needs turn_counts: the reversal over which it is reached",
                "falling",
                "turn_counts",
            )
        if self.table and (self.falling or self.coefficients != (0.0, 1.0)):
            raise WrongKeyError("give either a table or polynomials, not both", "table")
        if self.table:
            _check_table(self.table)
        if self.date and self.valid_until and self.valid_until < self.date:
            raise WrongKeyError("valid_until lies before date; look at both", "valid_until", "date")
        return self

    @model_serializer(mode="wrap")
    def _short(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out optional stages that are not there: the record of a plain polynomial stays as it was."""
        content: dict[str, Any] = handler(self)
        fields = type(self).model_fields
        return {
            key: value
            for key, value in content.items()
            if key not in _OPTIONAL or getattr(self, key) != fields[key].default
        }

    def expired(self, day: datetime.date) -> bool:
        """Return whether it no longer holds on a day."""
        return self.valid_until is not None and self.valid_until < day

    def apply(
        self, counts: ArrayLike, branch: Branch | None = None, temperature_C: float | None = None
    ) -> FloatArray:
        """Return counts of any shape in the channel's unit, same shape.

        Parameters
        ----------
        counts : array
            Raw counts, in the order of time where there is a falling branch.
        branch : Branch, optional
            Memory of the branch from the block before; without it the counts begin on the rising one.
        temperature_C : float, optional
            A measured temperature of the transducer instead of the one that is stated [°C].
        """
        raw = np.asarray(counts, dtype=np.float64)
        with np.errstate(over="ignore"):  # an absurd number of an import: infinite, which counts as no value
            value = self._value(self._input(raw))
        if self.falling:
            share = (branch or Branch()).follow(raw, self.turn_counts)
            value += share * (_polynomial(self.falling, self._input(raw)) - value)
        if self.temperature is not None:
            value = self.temperature.correct(value, temperature_C)
        if self.tare:
            value = value - self.tare
        return value

    def counts_of(self, values: ArrayLike) -> FloatArray:
        """Return the (broken) counts of values on the rising branch; undoes :meth:`apply`.

        Raises
        ------
        ValueError
            If it is a polynomial of higher degree, whose inverse is not unique.
        """
        value = np.asarray(values, dtype=np.float64) + self.tare
        if self.temperature is not None:
            value = self.temperature.disturb(value)
        if self.table:
            inside = _table(self.table).invert(value)
        elif len(self.coefficients) == 2 and self.coefficients[1] != 0.0:
            inside = (value - self.coefficients[0]) / self.coefficients[1]
        else:
            raise ValueError(f"calibration “{self.id}” is not linear")
        if self.divider is not None:
            inside = self.divider.load(inside)
        counts: FloatArray = inside / self.input_per_count + self.zero_counts
        return counts

    def invert_linear(self, value: float) -> float:
        """Return the counts of one value; see :meth:`counts_of`.

        Raises
        ------
        ValueError
            If the calibration is a polynomial that is not of first degree.
        """
        return float(self.counts_of(value))

    def _input(self, raw: FloatArray) -> FloatArray:
        if self.zero_counts:
            raw = raw - self.zero_counts
        if self.input_per_count != 1.0:
            raw = raw * self.input_per_count
        return raw if self.divider is None else self.divider.unload(raw)

    def _value(self, inside: FloatArray) -> FloatArray:
        return _table(self.table)(inside) if self.table else _polynomial(self.coefficients, inside)


_OPTIONAL = frozenset(Calibration.model_fields) - {"id", "coefficients", "certificate", "date", "valid_until"}


def _polynomial(coefficients: tuple[float, ...], x: FloatArray) -> FloatArray:
    """Return ``Σ coefficients[i] · x**i`` (Horner's scheme)."""
    *lower, highest = coefficients
    if not lower:
        return 0.0 * x + highest
    value = highest * x
    value += lower.pop()
    for coefficient in reversed(lower):
        value *= x
        value += coefficient
    return value


def _check_table(table: tuple[tuple[float, float], ...]) -> None:
    if len(table) < 2:
        raise WrongKeyError("a calibration table needs two points at least", "table")
    for (x0, y0), (x1, y1) in itertools.pairwise(table):
        if x1 <= x0:
            raise WrongKeyError(
                f"the inputs of a calibration table must rise, {x1:g} follows {x0:g}", "table"
            )
        if y1 == y0 or (y1 > y0) != (table[1][1] > table[0][1]):
            raise WrongKeyError(
                f"the values of a calibration table must rise, or fall, all along (at {y1:g})", "table"
            )


class _Table:
    """A monotone curve through points (Fritsch and Butland 1984), straight beyond its ends."""

    def __init__(self, table: tuple[tuple[float, float], ...]) -> None:
        from scipy.interpolate import PchipInterpolator  # noqa: PLC0415 - slow to import, and seldom needed

        points = np.array(table, dtype=np.float64)
        self._x, self._y = points[:, 0], points[:, 1]
        self._inside: Callable[[FloatArray], FloatArray] = PchipInterpolator(self._x, self._y)
        chord = np.diff(self._y) / np.diff(self._x)
        self._slopes = float(chord[0]), float(chord[-1])

    def __call__(self, x: FloatArray) -> FloatArray:
        below, above = np.minimum(x - self._x[0], 0.0), np.maximum(x - self._x[-1], 0.0)
        value: FloatArray = self._inside(np.clip(x, self._x[0], self._x[-1]))
        if np.any(below) or np.any(above):
            value = value + self._slopes[0] * below + self._slopes[1] * above
        return np.asarray(value)

    def invert(self, y: FloatArray) -> FloatArray:
        """Return the inputs of values, by bisection: the curve is monotone, so it cannot fail."""
        span = self._x[-1] - self._x[0]
        steep = min(abs(slope) for slope in self._slopes)
        reach = span + float(np.max(np.abs(y - self._y[0]), initial=0.0)) / steep
        low, high = np.full(y.shape, self._x[0] - reach), np.full(y.shape, self._x[-1] + reach)
        rises = self._y[-1] > self._y[0]
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            beyond = (self(middle) > y) == rises
            high, low = np.where(beyond, middle, high), np.where(beyond, low, middle)
        found: FloatArray = 0.5 * (low + high)
        return found


@lru_cache(maxsize=64)
def _table(table: tuple[tuple[float, float], ...]) -> _Table:
    return _Table(table)
