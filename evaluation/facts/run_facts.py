"""What is known of a run besides its samples, and the options of its evaluation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Literal

from bufferstand.evaluation.facts.channel_identity import ChannelIdentity
from bufferstand.evaluation.facts.choices import DRAWS, DecisionRule, ForceCell
from bufferstand.evaluation.facts.inspection import Inspection
from bufferstand.evaluation.facts.moving_mass import MovingMass
from bufferstand.evaluation.facts.shared_errors import MeasuringChain
from bufferstand.foundation import Kind, Purpose
from bufferstand.foundation.channels import ChannelUncertainty
from bufferstand.recording.runfile import RunEvent


@dataclass(frozen=True)
class GuardDoubt:
    """What a guard of the stand said of a device while a run was recorded.

    Attributes
    ----------
    guard : str
        Its name.
    time_s : float or None
        When, on the run's time; None where that is not on record.
    text : str
        What it said.
    channel : str
        Which channel it doubts; empty where it names none that is recorded.
    wiring : bool
        Whether it doubts that the channel measures what it should, and not only one reading of it.
    value : float or None
        What it saw, in ``unit``.
    unit : str
    """

    guard: str
    time_s: float | None
    text: str
    channel: str = ""
    wiring: bool = False
    value: float | None = None
    unit: str = ""


@dataclass(frozen=True)
class RunFacts:
    """What is known of a run besides its samples.

    ``force_uncertainty`` is None, and ``stroke_uncertainty`` empty, when the record states no uncertainty
    (imports): no uncertainty can be given then. ``stroke_uncertainty`` has one entry a draw wire.
    """

    id: str
    kind: Kind
    path: str = ""
    sha256: str | None = None
    samples_sha256: str | None = None
    """Hash of the samples alone, whatever is stated about them; None where there are none."""
    specimen: Mapping[str, Any] = field(default_factory=dict)
    started: datetime | None = None
    status: str = "complete"
    step: Mapping[str, Any] = field(default_factory=dict)
    force_uncertainty: ChannelUncertainty | None = None
    stroke_uncertainty: tuple[ChannelUncertainty, ...] = ()
    force_identity: ChannelIdentity | None = None
    """Whose errors those of the force channel are; None: nothing is known but what it states."""
    stroke_identities: tuple[ChannelIdentity, ...] = ()
    """One entry a draw wire, as ``stroke_uncertainty``; empty: nothing is known."""
    simulated: bool | None = None
    """Whether it was made on a simulated stand; None where the record does not tell (an import)."""
    stand: str = ""
    """Id of the stand; empty where the record names none."""
    force_limit_kN: float | None = None
    """Largest force of the stand, as its file states it [kN]; None where the record names no stand."""
    stroke_limit_mm: float | None = None
    """Largest stroke of the stand, as its file states it [mm]."""
    machine_stiffness_kN_per_mm: float | None = None
    """Of frame, load cell and fixture, as the stand file states it."""
    guard_doubts: tuple[GuardDoubt, ...] = ()
    """What guards of the stand said of its devices while it was recorded."""
    speed_uncertainty: ChannelUncertainty | None = None
    """Of a measured speed channel, where there is one and it states any."""
    force_delay_s: float = 0.0
    """``delay_s`` of the force channel, as applied [s]."""
    moving_mass_kg: float | None = None
    """Mass between load cell and specimen that the stand file states [kg]; None: no inertia correction."""
    moving_mass_accuracy_percent: float | None = None
    force_cell: ForceCell | None = None
    proof_load: str | None = None
    """Which proof load a proof run applied (F1 …)."""
    impact_speed_km_h: float | None = None
    """Speed of the impact, as the laboratory states it [km/h]."""
    impact_mass_t: float | None = None
    """Mass of the wagon that ran up, as the laboratory states it [t]."""
    campaign: str | None = None
    """Id of the campaign that it is of."""
    purpose: Purpose | None = None
    """What the campaign says that it is for, or ``[test]`` of an import."""
    stroke_events: tuple[RunEvent, ...] = ()
    """What was told the piston of a sine while it ran, and what became of it (events of kind ``stroke``)."""
    zero: Mapping[str, Any] | None = None
    """How stroke 0 was set to first contact, as the run's document says; None where it does not."""
    problems: tuple[str, ...] = ()
    """What was wrong with the record before it was evaluated; joins the run's warnings."""

    @property
    def chain(self) -> MeasuringChain | None:
        """The channels and whose errors theirs are; None where the record states no uncertainty."""
        if self.force_uncertainty is None or not self.stroke_uncertainty:
            return None
        return MeasuringChain(
            self.force_uncertainty,
            self.stroke_uncertainty,
            self.force_identity,
            self.stroke_identities,
            self.stand,
        )

    @property
    def moving_mass(self) -> MovingMass:
        """The moving mass as the stand file states it."""
        return MovingMass(self.moving_mass_kg, self.moving_mass_accuracy_percent, self.force_cell)


@dataclass(frozen=True)
class Options:
    """How to evaluate: decision rule, Monte Carlo draws and seed, reading of the preload, moving mass.

    No ``draws`` (0): figures only, neither Monte Carlo nor budgets, and no uncertainty of anything.
    ``moving_mass_kg`` is that between load cell and specimen, known to ``moving_mass_accuracy_percent``, and
    ``force_cell`` says on which side of it the cell is; None: what the stand file states, if any.
    ``preload_reading`` None: as the limit set reads it. ``inspections`` are what inspectors wrote down.
    """

    decision_rule: DecisionRule = "simple"
    draws: int = DRAWS
    seed: int = 20260115
    preload_reading: Literal["extrapolated", "at-0.5mm"] | None = None
    moving_mass_kg: float | None = None
    moving_mass_accuracy_percent: float | None = None
    force_cell: ForceCell | None = None
    inspections: tuple[Inspection, ...] = ()

    @property
    def moving_mass(self) -> MovingMass:
        """The moving mass as the options state it."""
        return MovingMass(self.moving_mass_kg, self.moving_mass_accuracy_percent, self.force_cell)


EVENT = "stroke"


def not_whole(status: str) -> str:
    """Return the warning of a run that did not end as planned."""
    return f"the run is not whole: its status is {status}"
