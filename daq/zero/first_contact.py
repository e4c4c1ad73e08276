"""First contact from the samples of a touch: where the force leaves its level at rest.

The piston creeps into the specimen to a small force and turns. Up to the contact the force stands at its
level at rest, behind it rises with the piston's way: ``F = F0 + a d + b d²``, ``d = max(0, x − x_c)``,
``b >= 0`` (frame and specimen in series; a spring without preload grows stiffer as it goes in). ``x`` is the
piston's measured way, smoothed: what the servo makes of a command, or when a command arrived, does not
matter. ``x_c`` is sought by least squares; the draw wires are read at ``x_c`` by a line on either side of it,
so that it does not matter either whether they hang on the specimen and stand still before it, or follow the
plate.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.guards.wiring import noise_of

FloatArray = NDArray[np.float64]

SMOOTHED_S = 0.04
"""The piston's way is averaged over so long [s]: noise of some 0.01 mm, times the stiffness of a frame, would
hide the force otherwise."""
REST_S = 3.0
"""So much of the approach before the rise is looked at [s]."""
FEWEST_REST = 20
"""Samples before the contact, below which there is no fit."""
MEAN_S, MEAN_MOST = 0.005, 5
"""The force at the turn is the mean over so long [s], of so many samples at most."""
SURE = 8.0
"""The force has risen by so many standard deviations of its noise, in the mean of the samples at the turn."""
FAR = 5.0
"""The contact lies at most so many times the upper half of the rise before it."""
CURVED = 9.0
"""A rise counts as curved where the curve takes this much (in variances of the noise) off the squares."""
JUMPED = 20.0
"""A jump must take more off: there is one somewhere in any noise."""
_GRID = 121
_REFINED = 3
_LEAST_RISE_MM = 0.01


class NoContactError(ValueError):
    """The samples show no contact; the text says why."""


@dataclass(frozen=True)
class TouchSamples:
    """Samples of a touch, from rest to the turn and beyond; shape (n,) each.

    Parameters
    ----------
    time_s : NDArray
        Time stamps [s].
    force_kN, position_mm : NDArray
        Force, and position of the piston.
    wires_mm : mapping of str to NDArray
        Draw wires by name.
    delay_s : mapping of str to float
        By how much each channel is late [s]; 0 for one that is not there.
    step : mapping of str to float
        What one count of a channel is worth, in its unit.
    """

    time_s: FloatArray
    force_kN: FloatArray
    position_mm: FloatArray
    wires_mm: Mapping[str, FloatArray]
    delay_s: Mapping[str, float]
    step: Mapping[str, float]


@dataclass(frozen=True)
class ContactReading:
    """A channel at first contact.

    Parameters
    ----------
    value : float
    u_own : float
        Standard uncertainty from its own noise and resolution.
    u_place : float
        That from where the contact is; all channels of one touch have it in common.
    """

    value: float
    u_own: float
    u_place: float

    @property
    def u(self) -> float:
        """Return both together."""
        return float(np.hypot(self.u_own, self.u_place))


@dataclass(frozen=True)
class TouchContact:
    """First contact as the samples show it.

    Parameters
    ----------
    position : Reading
        Of the piston [mm].
    wires : mapping of str to Reading
        Of the draw wires [mm].
    rest_kN, noise_kN : float
        Level of the force before it, and its standard deviation.
    u_rest_kN : float
        Standard uncertainty of the level.
    stiffness_kN_per_mm : float
        Of the first rise.
    peak_kN : float
        Greatest force over the level at rest, in the mean of some samples.
    """

    position: ContactReading
    wires: Mapping[str, ContactReading]
    rest_kN: float
    noise_kN: float
    u_rest_kN: float
    stiffness_kN_per_mm: float
    peak_kN: float


def find_contact(samples: TouchSamples) -> TouchContact:
    """Return first contact.

    Raises
    ------
    NoContactError
        If the force does not rise above its noise, or there are too few samples before or behind the contact.
    """
    rate_Hz = _rate_Hz(samples.time_s)
    way_mm = _way(samples, rate_Hz)
    few = max(1, min(MEAN_MOST, round(MEAN_S * rate_Hz)))
    turn = _turn(samples.force_kN, few)
    force, way = samples.force_kN[:turn], way_mm[:turn]
    if turn < FEWEST_REST + few:
        raise NoContactError(f"only {turn} samples were taken before the piston turned")
    level, noise = float(np.median(force[: max(FEWEST_REST, turn // 2)])), noise_of(force)
    crest = _crest(force, level, noise, few)
    half = _first_lasting(force > level + 0.5 * crest)
    if half < FEWEST_REST:
        raise NoContactError(f"only {half} samples lie before the rise of the force")
    reach = FAR * max(float(way[-1] - way[half]), _LEAST_RISE_MM)
    # Where it stood before it moved the force was that at rest: the contact does not lie before it.
    stood = float(np.median(way[:FEWEST_REST]))
    lowest = max(float(way[half]) - reach, min(stood, float(way[half]) - _LEAST_RISE_MM))
    reached = int(np.searchsorted(np.maximum.accumulate(way), lowest))
    used = slice(max(0, min(reached, half) - round(REST_S * rate_Hz)), turn)
    moved_mm = float(np.max(np.abs(way[used][_lag(rate_Hz) :] - way[used][: -_lag(rate_Hz)])))
    own = samples.step.get("position", 0.0) / float(np.sqrt(12.0))
    scatter_mm = float(np.hypot(noise_of(samples.position_mm), own))
    fit = _Hinge(way[used], force[used], scatter_mm).best(lowest, float(way[half]), moved_mm)
    wires = {
        name: _reading(way[used], _moved(samples, name, values)[used], fit, samples.step.get(name, 0.0))
        for name, values in samples.wires_mm.items()
    }
    return TouchContact(
        position=ContactReading(fit.place, own, fit.u_place),
        wires=wires,
        rest_kN=fit.level,
        noise_kN=fit.noise,
        u_rest_kN=fit.u_level,
        stiffness_kN_per_mm=fit.slope,
        peak_kN=crest,
    )


def _rate_Hz(time_s: FloatArray) -> float:  # noqa: N802 - the unit keeps its capital
    if time_s.size < FEWEST_REST:
        raise NoContactError(f"only {time_s.size} samples were taken")
    return 1.0 / float(np.median(np.diff(time_s)))


def _way(samples: TouchSamples, rate_Hz: float) -> FloatArray:
    """Return the piston's way, averaged, at the moments at which the force was true; shape (n,)."""
    width = max(3, round(SMOOTHED_S * rate_Hz) | 1)
    edged = np.pad(samples.position_mm, width // 2, mode="edge")
    smooth = np.convolve(edged, np.full(width, 1.0 / width), mode="valid")
    late_s = samples.delay_s.get("force", 0.0) - samples.delay_s.get("position", 0.0)
    return np.asarray(np.interp(samples.time_s - late_s, samples.time_s, smooth))


def _lag(rate_Hz: float) -> int:
    return max(1, round(SMOOTHED_S * rate_Hz))


def _moved(samples: TouchSamples, name: str, values: FloatArray) -> FloatArray:
    """Return a wire at the moments at which the force was true."""
    late_s = samples.delay_s.get("force", 0.0) - samples.delay_s.get(name, 0.0)
    return np.asarray(np.interp(samples.time_s - late_s, samples.time_s, values))


def _turn(force: FloatArray, count: int) -> int:
    """Return how many samples there are up to the greatest force, in the mean of ``count``."""
    means = np.convolve(force, np.full(count, 1.0 / count), mode="valid")
    return int(np.argmax(means)) + count // 2 + 1


def _crest(force: FloatArray, level: float, noise: float, count: int) -> float:
    """Return the height of the force at the turn over its level, in the mean of the samples there."""
    means = np.convolve(force, np.full(count, 1.0 / count), mode="valid")
    crest = float(np.max(means)) - level
    if crest < SURE * noise / np.sqrt(count) or crest <= 0.0:
        raise NoContactError(
            f"the force rose by {crest:.2f} kN at most, with a noise of {noise:.2f} kN: no contact"
        )
    return crest


def _first_lasting(above: NDArray[np.bool_]) -> int:
    """Return the first place from which most of the samples to the end lie above: noise before it is none."""
    later = np.cumsum(above[::-1])[::-1] / np.arange(above.size, 0, -1)
    return int(np.flatnonzero(above & (later > 0.5))[0])


@dataclass(frozen=True)
class _Fit:
    place: float
    u_place: float
    level: float
    u_level: float
    slope: float
    noise: float


@dataclass(frozen=True)
class _Family:
    """A shape of the rise: ``columns`` gives its terms behind a place, the last one may not be negative."""

    name: str
    columns: Callable[[FloatArray], list[FloatArray]]


_STRAIGHT = _Family("straight", lambda behind: [behind])
_CURVED = _Family("curved", lambda behind: [behind, behind**2])
_JUMP = _Family("jump", lambda behind: [behind, (behind > 0.0).astype(np.float64)])
"""A preload that is less than the touch's force: the frame's ramp up to it is too short to be seen."""


class _Hinge:
    """Least squares of a level and a rise behind a place, over a coordinate.

    ``scatter_mm`` is the noise of the single positions. Averaging takes it out of sight but leaves it in the
    place: the few samples of the rise hold few averages. Seen over the rise it counts as noise of the force,
    slope times as large.
    """

    def __init__(self, way: FloatArray, force: FloatArray, scatter_mm: float) -> None:
        self._way = way
        self._force = force
        self._scatter_mm = scatter_mm

    def best(self, low: float, high: float, shortest_mm: float) -> _Fit:
        """Return the fit whose place lies between two ends, in the simplest shape that the samples allow.

        ``shortest_mm``: the piston's way within which the averaging hides where something happened.
        """
        places = {family.name: self._sought(low, high, family) for family in (_STRAIGHT, _CURVED, _JUMP)}
        squares = {
            family.name: self._squares(places[family.name], family) for family in (_STRAIGHT, _CURVED, _JUMP)
        }
        family = min((_CURVED, _JUMP), key=lambda one: squares[one.name])
        needed = JUMPED if family is _JUMP else CURVED
        noise = self._noise_along(places[family.name], family, squares[family.name])
        if squares["straight"] - squares[family.name] <= needed * float(np.max(noise)):
            family = _STRAIGHT
            noise = self._noise_along(places[family.name], family, squares[family.name])
        place = places[family.name]
        coefficients = self._solved(place, family)[0]
        jump = shortest_mm / float(np.sqrt(12.0)) if family is _JUMP else 0.0
        u_place, u_level = self._u(place, coefficients, family, noise)
        return _Fit(
            place,
            float(min(np.hypot(u_place, jump), (high - low) / np.sqrt(3.0))),
            float(coefficients[0]),
            u_level,
            float(coefficients[1]),
            float(np.sqrt(squares[family.name] / max(1, self._way.size - 4))),
        )

    def _noise_along(self, place: float, family: _Family, squares: float) -> FloatArray:
        """Return the variance of the noise at each sample [kN²]: of the force, and of the position behind."""
        coefficients, residuals = self._solved(place, family)
        of_force = squares / max(1, self._way.size - 4) * _repeats(residuals)
        return of_force + (self._rise(place, coefficients, family) * self._scatter_mm) ** 2

    def _rise(self, place: float, coefficients: FloatArray, family: _Family) -> FloatArray:
        """Return the slope of the force along the way [kN/mm]."""
        bend = float(coefficients[2]) if family is _CURVED else 0.0
        behind = np.maximum(self._way - place, 0.0)
        return np.where(self._way > place, float(coefficients[1]) + 2.0 * bend * behind, 0.0)

    def _u(
        self, place: float, coefficients: FloatArray, family: _Family, noise: FloatArray
    ) -> tuple[float, float]:
        """Return the standard uncertainties of place and level, by the curved shape or that with a jump.

        A bend that noise hides may still be there, so that a straight rise is no surer than a curved one.
        With n samples on a straight rise of slope s, noises σ of force and σx of position, the place has
        ``3 √((σ / s)² + σx²) / √n``: three times the mean's, as an end of a parabola has.
        """
        behind = np.maximum(self._way - place, 0.0)
        rise = self._rise(place, coefficients, family)
        columns = np.column_stack((np.ones_like(behind), behind, behind**2, -rise))
        width = np.max(np.abs(columns), axis=0)
        width[width == 0.0] = 1.0  # a column of zeros has no say
        scaled = columns / width
        inverse = np.linalg.pinv(scaled.T @ scaled, hermitian=True)
        covariance = inverse @ (scaled.T * noise) @ scaled @ inverse / np.outer(width, width)
        u = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        return 0.0 if family is _JUMP else float(u[3]), float(u[0])

    def _sought(self, low: float, high: float, family: _Family) -> float:
        for _ in range(_REFINED):
            places = np.linspace(low, high, _GRID)
            squares = [self._squares(place, family) for place in places.tolist()]
            at = int(np.argmin(squares))
            low, high = places[max(0, at - 1)], places[min(_GRID - 1, at + 1)]
        return float(places[at])

    def _solved(self, place: float, family: _Family) -> tuple[FloatArray, FloatArray]:
        """Return coefficients and residuals; a bend, a jump or a rise downwards is none.

        A specimen that goes in takes no force away: without that a bend begins before the contact.
        """
        behind = np.maximum(self._way - place, 0.0)
        columns = np.column_stack([np.ones_like(behind), *family.columns(behind)])
        coefficients = np.linalg.lstsq(columns, self._force, rcond=None)[0]
        if columns.shape[1] > 2 and coefficients[-1] < 0.0:
            straight, residuals = self._solved(place, _STRAIGHT)
            return np.append(straight, 0.0), residuals
        if columns.shape[1] > 2 and coefficients[1] < 0.0:
            ends = np.linalg.lstsq(columns[:, [0, 2]], self._force, rcond=None)[0]
            coefficients = np.array([ends[0], 0.0, ends[1]])
        return coefficients, self._force - columns @ coefficients

    def _squares(self, place: float, family: _Family) -> float:
        residuals = self._solved(place, family)[1]
        return float(residuals @ residuals)


def _repeats(residuals: FloatArray) -> float:
    """Return by how much noise that is not white says less than its number of samples: (1 + r) / (1 − r)."""
    power = float(residuals @ residuals)
    alike = float(residuals[1:] @ residuals[:-1]) / power if power > 0.0 else 0.0
    return (1.0 + min(max(alike, 0.0), 0.95)) / (1.0 - min(max(alike, 0.0), 0.95))


def _reading(way: FloatArray, wire: FloatArray, fit: _Fit, step: float) -> ContactReading:
    """Return a wire at the contact: by a line before it and another behind it, which meet there."""
    before, behind = np.minimum(way - fit.place, 0.0), np.maximum(way - fit.place, 0.0)
    columns = np.column_stack((np.ones_like(way), before, behind))
    value, *slopes = np.linalg.lstsq(columns, wire, rcond=None)[0].tolist()
    residuals = wire - columns @ np.array([value, *slopes])
    scale = float(residuals @ residuals) / max(1, wire.size - 3) * _repeats(residuals)
    covariance = np.linalg.pinv(columns.T @ columns, hermitian=True) * scale
    own = float(np.hypot(np.sqrt(max(0.0, covariance[0, 0])), step / np.sqrt(12.0)))
    steepest = min(1.0, max(abs(slope) for slope in slopes))  # no wire moves faster than the piston
    return ContactReading(value, own, steepest * fit.u_place)
