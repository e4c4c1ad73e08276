"""What guards are made for: a stand, its limits, and what a campaign says of its guards."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

from bufferstand.daq.guards.trips import Action
from bufferstand.drivers import OwnClock, Stand, StreamFacts
from bufferstand.foundation.settings import Settings
from bufferstand.protocols import Envelope, TestLimits
from bufferstand.protocols.campaign_file import GuardTable

if TYPE_CHECKING:  # the spring model's libraries take seconds: the monitor, which shows guards, needs none
    from bufferstand.protocols.planning import Plan
    from bufferstand.protocols.prediction import Predictor

SettingsT = TypeVar("SettingsT", bound=Settings)

CONTROLLER_STREAM = "controller"
"""Name of the controller's stream (spec of the run file)."""
FORCE_2_STREAM = "amplifier"
"""Name of the stream of the second way to the force."""
ACTIONS = {
    "note": Action.NOTE,
    "finish-cycle": Action.STOP_AFTER_CYCLE,
    "stop": Action.STOP,
    "emergency": Action.EMERGENCY,
}
"""What a campaign file calls each action."""


@dataclass(frozen=True)
class Site:
    """What guards are made for.

    Parameters
    ----------
    limits : TestLimits
        ``[limits]`` of the campaign: thresholds of temperature and following error.
    envelope : Envelope
        The narrowest limits: trips of force and stroke.
    stand : Stand
        Its channels and sensors.
    ambient : collection of str
        Streams that do not touch the specimen: their silence is noted, their value stops nothing.
    table : GuardTable
        ``[guards]`` of the campaign.
    stand_tilt_mm : float or None
        The tilt that the stand file allows.
    plan : Plan or None
        What will be done; None for motions by hand.
    predictor : Predictor or None
        What the plan expects of the specimen.
    speed : float
        Seconds of the stand in one of the wall.
    """

    limits: TestLimits
    envelope: Envelope
    stand: Stand
    ambient: Collection[str] = ()
    table: GuardTable = field(default_factory=GuardTable)
    stand_tilt_mm: float | None = None
    plan: Plan | None = None
    predictor: Predictor | None = None
    speed: float = 1.0

    def does(self, name: str) -> Action:
        """Return what ``[guards.action]`` says that a trip leads to."""
        return ACTIONS[getattr(self.table.action, name)]

    @property
    def sensors(self) -> Mapping[str, StreamFacts]:
        """Return what each sensor's stream is made of, by its name."""
        return {sensor.facts.name: sensor.facts for sensor in self.stand.sensors}

    @property
    def acquisition(self) -> Mapping[str, StreamFacts]:
        """Return the streams of devices with a clock of their own: figures may be made of them."""
        return {one.facts.name: one.facts for one in self.stand.sensors if isinstance(one, OwnClock)}

    @property
    def thermometers(self) -> Mapping[str, StreamFacts]:
        """Return the temperature streams."""
        return {
            name: facts for name, facts in self.sensors.items() if facts.channels[0].quantity == "temperature"
        }

    def own_table(self, kind: str, schema: type[SettingsT]) -> SettingsT | None:
        """Return ``[guards.KIND]`` of a guard that brings its own settings; None where it is not written."""
        content = self.table.own.get(kind)
        return None if content is None else schema.model_validate(content)
