"""Passes of the loop: read, judge, show, and take what the operator asks for; how long to go on with them."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import wait as wait_for
from pathlib import Path

from bufferstand.daq.acquisition import NOT_CAUGHT_UP, Acquisition, catch_up
from bufferstand.daq.campaign.display import CampaignDisplay
from bufferstand.daq.motions import MotionRunner
from bufferstand.daq.operator import StopRequest, Watcher, add_note
from bufferstand.foundation import Clock, DeviceFault

DOUBT_S = 0.8
"""What a judge of the wiring has begun to doubt it knows within this: a jump of one force lasts 0.25 s until
it is one, is said by three looks of 0.1 s, and the other force comes some tenths later [s of stand time]."""
AFTER_STOP_S = 1.0
"""So long a run goes on after its safe stop [s of stand time]."""


class LoopPasses:
    """Makes passes of the acquisition, each with its showing and the operator's notes.

    Parameters
    ----------
    clock : Clock
        The stand's time.
    showing : Showing
        Who shows trips, notes and the present state.
    request : StopRequest
        The operator's wishes and notes.
    notes : Path
        The campaign's folder, where the operator's notes go.
    watcher : Watcher, optional
        Who sees every pass (the live monitor).
    """

    def __init__(
        self,
        clock: Clock,
        showing: CampaignDisplay,
        request: StopRequest,
        notes: Path,
        watcher: Watcher | None,
    ) -> None:
        self._clock = clock
        self._showing = showing
        self._request = request
        self._notes = notes
        self._watcher = watcher
        self._served: tuple[Acquisition, MotionRunner] | None = None
        self.run_id = ""
        """Of the run that is being recorded; empty if none is."""

    def serve(self, acquisition: Acquisition, driver: MotionRunner) -> None:
        """Make the passes of this acquisition from now on; the driver is shown beside it."""
        self._served = acquisition, driver

    def tick(self) -> None:
        """Make one pass.

        Raises
        ------
        DeviceFault
            If a device fails.
        """
        acquisition, driver = self._need()
        for trip in acquisition.tick():
            self._showing.trip(trip)
        for text in acquisition.log.unrecorded():
            self._showing.message(f"note: {text}")
        self.take_notes()
        self._showing.offer(acquisition, driver)
        if self._watcher is not None:
            self._watcher.look(acquisition)

    def take_notes(self) -> None:
        """Put what the operator asked for and wrote into the run, notes into the campaign's folder, too."""
        for wish in self._request.take_wishes():
            self._showing.stop_asked = wish
            self._showing.message(f"operator: {wish}")
            self._say(wish)
        for by, text in self._request.take_findings():
            self._showing.message(f"{by}: {text}")
            if self._served is not None:
                self._served[0].log.say(by, text)
        for text in self._request.take_notes():
            self._showing.message(f"operator: {text}")
            self._say(text)
            try:
                add_note(self._notes, text, step=self._showing.step_index, run=self.run_id)
            except OSError as error:
                self._showing.message(f"the note could not be written: {error.strerror}")

    def watch_rest(self, span_s: float = AFTER_STOP_S) -> None:
        """Go on for a moment [s of stand time] after a safe stop: a run is to show that the force is gone."""
        acquisition, _ = self._need()
        until_s = self._clock.now_s() + span_s
        while self._clock.now_s() < until_s:
            trip = acquisition.panel.trip
            if trip is not None and trip.device_fault:
                return
            self.tick()
            acquisition.rest()

    def hear_doubts(self) -> None:
        """Let a judge of the wiring that has begun to doubt come to its end before a run does.

        What lasts is told by some looks in a row, and a motion can end between two of them.
        """
        acquisition, _ = self._need()
        until_s = self._clock.now_s() + DOUBT_S
        while acquisition.panel.trip is None and acquisition.panel.look_once_more(self._clock.now_s()):
            if self._clock.now_s() >= until_s:
                return
            self.tick()
            acquisition.rest()

    def catch_up(self, *, stopped: bool = False) -> None:
        """Make passes until all is read that was sampled before now (:func:`catch_up`).

        A trip ends it at once, unless the stand is ``stopped`` already and the wire is whole.

        Raises
        ------
        DeviceFault
            If the controller gives no newer sample; where the stand is stopped already it is only said.
        """
        acquisition, _ = self._need()

        def ended() -> bool:
            trip = acquisition.panel.trip
            return trip is not None and (trip.device_fault or not stopped)

        if not catch_up(acquisition, self.tick, ended):
            if not stopped:
                raise DeviceFault(NOT_CAUGHT_UP)
            self._showing.warn(NOT_CAUGHT_UP)

    def meanwhile(self, work: Callable[[], object]) -> BaseException | None:
        """Do something lengthy in a thread while the passes go on; return what it raised."""
        with ThreadPoolExecutor(1) as pool:
            doing = pool.submit(work)
            while not doing.done():
                self._tick_safely()
                wait_for([doing], timeout=0.02)
        return doing.exception()

    def _tick_safely(self) -> None:
        try:
            self.tick()
        except Exception as error:  # noqa: BLE001 - sealing must come to its end; the next pass says it again
            self._showing.warn(repr(error))

    def _say(self, text: str) -> None:
        if self._served is not None:
            self._served[0].log.say("operator", text)

    def _need(self) -> tuple[Acquisition, MotionRunner]:
        if self._served is None:
            raise RuntimeError("the session is not open")
        return self._served
