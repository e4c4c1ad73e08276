"""How the stand was reached, and so whether it is a simulated one, whatever its name is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bufferstand.drivers import Identity, Stand
from bufferstand.recording.runfile import HOW_KEY, KEY

STARTED = "started by the program for the campaign (--simulate)"
OWN_WORD = "the controller says so itself"
WAITS = "a served simulated stand, which waits for its reader"
REAL = "reached by the stand file’s addresses; nothing there says that it is simulated"


@dataclass(frozen=True)
class StandOrigin:
    """Whether a stand is a simulated one, or partly so, and how that is known in words."""

    simulated: bool
    by: str

    def document(self) -> dict[str, Any]:
        """Return it for the run file's table ``run``, and for ``campaign.json``."""
        return {KEY: self.simulated, HOW_KEY: self.by}


def how_reached(stand: Stand, *, started_here: bool, waits: bool) -> StandOrigin:
    """Return whether a stand that is connected is simulated; its controller is asked, nothing is written.

    A stand of which only a sensor is known to be simulated counts as simulated: what it measures was not
    measured on a specimen. Over their wires amplifiers and thermometers cannot say what they are.

    Parameters
    ----------
    stand : Stand
        Connected.
    started_here : bool
        Whether this program has started it.
    waits : bool
        Whether it is served on this computer and waits for its reader, as only a simulated one can.

    Raises
    ------
    DeviceFault
        If the controller's wire fails.
    """
    if started_here:
        return StandOrigin(simulated=True, by=STARTED)
    if stand.controller.says_simulated():
        return StandOrigin(simulated=True, by=OWN_WORD)
    if waits:
        return StandOrigin(simulated=True, by=WAITS)
    if names := [sensor.facts.name for sensor in stand.sensors if sensor.facts.simulated]:
        return StandOrigin(simulated=True, by=f"simulated are: {', '.join(names)}")
    return StandOrigin(simulated=False, by=REAL)


def mixing(reached: StandOrigin, began_simulated: bool | None) -> str:
    """Return why a stand is not the kind of stand on which the campaign's runs were made; empty if it is.

    Parameters
    ----------
    reached : Reached
        The stand that answers.
    began_simulated : bool or None
        What the campaign's runs were made on; None where there is none yet, or nobody knows.
    """
    if began_simulated is None or began_simulated == reached.simulated:
        return ""
    if reached.simulated:
        what, then = f"a simulated stand answers ({reached.by})", "a real one"
    else:
        what, then = f"a real stand answers ({reached.by})", "a simulated one"
    return (
        f"{what}, and this campaign was begun on {then}: real and simulated runs never come into one folder, "
        "so nothing was written to the controller. Look at the addresses in the stand file, or begin a "
        "campaign of its own with bufferstand run … --out another folder"
    )


def another(identity: Identity, before: Mapping[str, Any], accepted_serial: str, *, simulated: bool) -> str:
    """Return why a controller is not the one that the campaign was run with; empty if it is, or was accepted.

    A simulated controller has no serial number that stands for a device.

    Parameters
    ----------
    identity : Identity
        Who answers.
    before : mapping
        Who answered at the start before; empty where nobody knows.
    accepted_serial : str
        Serial number with which somebody has agreed to go on.
    simulated : bool
        Whether the stand is a simulated one.
    """
    was = before.get("serial")
    if simulated or not was or identity.serial in (was, accepted_serial):
        return ""
    return (
        f"the controller that answers has the serial number {identity.serial}, and the one of this campaign "
        f"has {was}: nothing was written to it. See which controller moves the stand; to go on with this one "
        f"resume with --accept-controller {identity.serial}"
    )
