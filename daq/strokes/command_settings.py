"""How strokes are commanded in a campaign, and who is informed of the result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from bufferstand.daq.strokes.correction_steps import StrokeBounds
from bufferstand.daq.strokes.knowledge import StrokeKnowledge
from bufferstand.protocols.campaign_file import StrokeTable


class StrokeMessages(Protocol):
    """Who puts a fact into the run, and who shows a line that must not be missed."""

    def event(self, kind: str, text: str, **data: object) -> None:
        """Put an event into the run under way."""
        ...

    def message(self, text: str) -> None:
        """Show a line."""
        ...

    def warn(self, text: str) -> None:
        """Show a line that stays as a warning of the step."""
        ...


class NoMessages:
    """Says nothing."""

    def event(self, kind: str, text: str, **data: object) -> None:
        """Drop an event."""

    def message(self, text: str) -> None:
        """Drop a line."""

    def warn(self, text: str) -> None:
        """Drop a warning."""


@dataclass(frozen=True)
class StrokeCommandSettings:
    """By what strokes are commanded in a campaign.

    Parameters
    ----------
    table : StrokeTable
        ``[stroke]`` of the campaign.
    knowledge : StrokeKnowledge
        What frame and actuator take.
    bounds : Bounds
        What a command must keep.
    delays_s : mapping of str to float
        Delay of each channel of the controller.
    """

    table: StrokeTable
    knowledge: StrokeKnowledge
    bounds: StrokeBounds
    delays_s: Mapping[str, float]


class WarnOnce:
    """Says each warning once, in the run and aloud.

    Parameters
    ----------
    voice : Voice
    """

    def __init__(self, voice: StrokeMessages) -> None:
        self._voice = voice
        self._said: set[str] = set()

    def __call__(self, text: str) -> None:
        """Say a text that was not said before."""
        if text not in self._said:
            self._said.add(text)
            self._voice.event("stroke", text)
            self._voice.warn(f"WARNING: {text}")
