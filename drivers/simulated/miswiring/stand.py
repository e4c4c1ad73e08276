"""All that is wired wrong at one simulated stand, between its transducers and those who read them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers.instruments import SensorEntry
from bufferstand.drivers.simulated.faults import nearest
from bufferstand.drivers.simulated.miswiring.settings import (
    Miswired,
    MiswiredForce,
    MiswiredSignal,
    MiswiredStroke,
)
from bufferstand.drivers.simulated.miswiring.signal import WrongForce, WrongSignal
from bufferstand.drivers.simulated.miswiring.thermometer import MisplacedThermometer
from bufferstand.drivers.simulated.transducers import Converters
from bufferstand.drivers.stand_file import StandFile
from bufferstand.foundation import BadInput
from bufferstand.foundation.channels import STROKE_CHANNELS

FloatArray = NDArray[np.float64]


class MiswiredStand:
    """What is wrong; nothing costs time where nothing is.

    Parameters
    ----------
    stand_file : StandFile
    facts : Miswired
    period_s : float
        Of the controller's samples [s].
    columns : sequence of str
        Channels that are sampled together, in their order; the force is the first.

    Raises
    ------
    BadInput
        If the stand has no such draw wire, amplifier or thermometer.
    """

    def __init__(
        self, stand_file: StandFile, facts: Miswired, period_s: float, columns: Sequence[str]
    ) -> None:
        wired: dict[str, MiswiredSignal] = {
            "force": facts.force,
            **{name: getattr(facts, name) for name in (*STROKE_CHANNELS, "position")},
        }
        wrong = {name: wire for name, wire in wired.items() if wire != type(wire)()}
        _demand_channels(stand_file, wrong, columns)
        _demand_possible(stand_file, facts)
        self._columns = tuple(columns)
        self._signals = {self._columns.index(name): WrongSignal(wire) for name, wire in wrong.items()}
        self._amplifier = WrongSignal(facts.amplifier) if facts.amplifier.model_fields_set else None
        self._thermometers = facts.thermometer
        acts = facts.force.controller_too and 0 in self._signals
        self.acted_on = WrongForce(facts.force, period_s) if acts else None
        """What the controller makes of the force that it acts on, where that is wrong."""
        self.force_reads = facts.force.reads if acts else None

    def samples(self, time_s: FloatArray, counts: FloatArray, converters: Converters) -> None:
        """Spoil a slice of samples in place.

        Parameters
        ----------
        time_s : NDArray, shape (n,)
            Stand time [s].
        counts : NDArray, shape (n, channels)
            What the converters made of the transducers' signals.
        converters : Converters
            By which a value is counts again.
        """
        if not self._signals:
            return
        right = converters.values(counts)
        for column, signal in self._signals.items():
            facts, own = signal.facts, right[:, column]
            reads = facts.reads if isinstance(facts, MiswiredForce | MiswiredStroke) else None
            if reads is not None:
                own = np.where(time_s >= facts.from_s, right[:, self._columns.index(reads)], own)
            counts[:, column] = converters.counts_of(column, signal.arrive(time_s, own))

    def second_force(self, time_s: FloatArray, counts: FloatArray, converters: Converters) -> FloatArray:
        """Return what arrives of the amplifier's values, counts of shape (n,) each, at times [s]."""
        if self._amplifier is None:
            return counts
        right = converters.values(counts[:, np.newaxis])[:, 0]
        return converters.counts_of(0, self._amplifier.arrive(time_s, right))

    def place_of(self, sensor: SensorEntry) -> MisplacedThermometer | None:
        """Return where a thermometer sits in truth, None where it sits right."""
        facts = self._thermometers.get(sensor.name)
        return None if facts is None else MisplacedThermometer(sensor.role, facts)


def _demand_channels(stand_file: StandFile, wrong: Mapping[str, MiswiredSignal], have: Sequence[str]) -> None:
    """See that the channels that shall be wrong, and those that they shall read, are sampled."""
    for name, wire in wrong.items():
        reads = wire.reads if isinstance(wire, MiswiredForce | MiswiredStroke) else None
        for one in (name, reads):
            if one is not None and one not in have:
                raise BadInput(
                    f"the stand has no channel “{one}”{nearest(one, have)}",
                    file=stand_file.path,
                    place=f"simulation.miswired.{name}",
                    remedy=f"it has {', '.join(have)}",
                )


def _demand_possible(stand_file: StandFile, facts: Miswired) -> None:
    """See that what shall be wrong is there."""
    if facts.amplifier.model_fields_set and not stand_file.amplifier:
        raise BadInput(
            "the stand has no amplifier that could be wired wrong",
            file=stand_file.path,
            place="simulation.miswired.amplifier",
            remedy="leave it out, or add the table [amplifier]",
        )
    have = [sensor.name for sensor in stand_file.temperature_sensors]
    for name in facts.thermometer:
        if name not in have:
            raise BadInput(
                f"the stand has no thermometer “{name}”{nearest(name, have)}",
                file=stand_file.path,
                place=f"simulation.miswired.thermometer.{name}",
                remedy=f"it has {', '.join(have) or 'none'}",
            )
