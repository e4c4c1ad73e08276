"""The way to the simulated controller without wires: it takes time, and faults strike what is on it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from bufferstand.drivers.modbus import EXCEPTION_TEXTS, HURRY_S
from bufferstand.drivers.simulated.inprocess.virtual_clock import VirtualClock
from bufferstand.drivers.simulated.machine import SimulatedDevice
from bufferstand.foundation import DeviceFault, WireLost

_LOSING = ("drop", "corrupt", "reorder", "delay", "request-drop", "request-corrupt")
"""Faults of frames after which the driver of a real controller asks once more."""


class InProcessLink:
    """What lies between the acquisition and a simulated device in virtual time.

    Parameters
    ----------
    device : SimulatedDevice
        Its faults strike, its latency is waited.
    clock : VirtualClock
        That moves the device.
    timeout_s : float
        Longest wait for a reply [s].
    """

    def __init__(self, device: SimulatedDevice, clock: VirtualClock, timeout_s: float) -> None:
        self._device = device
        self._clock = clock
        self._timeout_s = timeout_s
        self.events: list[str] = []
        """What a driver would say of the wire."""
        self._given_up = False

    @contextmanager
    def asking(self) -> Iterator[None]:
        """Do inside what a request does; the stand goes on while request and reply are on their way.

        Raises
        ------
        WireLost
            If a simulated fault keeps the reply away; DeviceFault if one refuses the request.
        """
        way_s = self._device.latency.way_s
        self._clock.sleep(way_s())
        self._reach()
        yield
        self._clock.sleep(way_s())

    def _reach(self) -> None:
        """Fail as a real link does: after its timeout, during which the stand goes on."""
        faults, now_s = self._device.faults, self._clock.now_s
        if faults.find("controller", "lost", now_s()):
            self._clock.sleep(HURRY_S if self._given_up else 2.0 * self._timeout_s)
            self._given_up = True
            raise WireLost(
                "the simulated controller does not answer: its link is lost (a simulated fault); "
                "look at the faults that were given"
            )
        if fault := faults.strikes("controller", "exception", now_s()):
            code = int(fault.number("code"))
            raise DeviceFault(
                f"the simulated controller refused with Modbus exception {code} "
                f"({EXCEPTION_TEXTS.get(code, 'unknown')}); look at the faults that were given"
            )
        for attempt in (1, 2):
            struck = next((kind for kind in _LOSING if self._loses(kind)), None)
            if struck is None:
                self._given_up = False
                return
            self._clock.sleep(self._timeout_s)
            further = "sent once more on a new connection" if attempt == 1 else "given up"
            self.events.append(f"no true reply ({struck}, a simulated fault); connection closed, {further}")
        raise WireLost("the simulated controller: no true reply, twice; look at the faults that were given")

    def _loses(self, kind: str) -> bool:
        """Return whether a fault of that kind keeps a reply from coming in time."""
        fault = self._device.faults.strikes("controller", kind, self._clock.now_s())
        if fault is not None and kind == "delay" and fault.number("delay_s") <= self._timeout_s:
            self._clock.sleep(fault.number("delay_s"))
            return False
        return fault is not None
