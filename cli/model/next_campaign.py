"""The campaign of chosen steps, and which steps a stand may do, by every limit and guard as `plan` judges."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from bufferstand.cli.campaign import PreparedCampaign, prepare_campaign
from bufferstand.drivers.stand_file import StandFile
from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import parse_settings
from bufferstand.model.next_step import Loops, Piece, Rest, SharedErrors, SlowStroke, limit
from bufferstand.protocols.campaign_file import Campaign, CampaignFile


@dataclass
class Admission:
    """Which pieces the stand may do, one plan each; what was refused is kept with its reason.

    Attributes
    ----------
    path : Path
        Where the campaign is to lie: stand and specimen are named from there.
    stand, specimen : str
        As the campaign names them.
    ambient_C : float
        Temperature of the air [°C].
    """

    path: Path
    stand: str
    specimen: str
    ambient_C: float
    refused: dict[Piece, str] = field(default_factory=dict)

    def __call__(self, piece: Piece) -> bool:
        """Return whether a campaign of this piece alone keeps every limit and guard."""
        try:
            prepare_campaign(self.campaign([piece]))
        except BadInput as error:
            self.refused[piece] = error.problem
            return False
        return True

    def campaign(self, pieces: Sequence[Piece], why: Sequence[str] = ()) -> Campaign:
        """Return a campaign of pieces in a row."""
        return made_campaign(self.text(pieces, why), self.path)

    def text(self, pieces: Sequence[Piece], why: Sequence[str] = ()) -> str:
        """Return the text of that campaign's file; ``why`` has a comment for each piece, empty for none."""
        return campaign_text(pieces, why, stand=self.stand, specimen=self.specimen, ambient_C=self.ambient_C)

    def base(self) -> PreparedCampaign:
        """Return a campaign in which nothing moves: stand, specimen and limits, read once.

        Raises
        ------
        BadInput
            If a file cannot be read, or the stand cannot guard this specimen.
        """
        return prepare_campaign(self.campaign([Rest(1.0)]))


def admission(path: Path, stand: Path, specimen: Path, ambient_C: float) -> Admission:
    """Return who says which pieces may be run.

    Parameters
    ----------
    path : Path
        Where the campaign is to lie.
    stand, specimen : Path
        Files that it names.
    ambient_C : float
        Temperature of the air [°C].
    """
    return Admission(path, seen_from(path, stand, ""), seen_from(path, specimen, ""), ambient_C)


def seen_from(campaign: Path, file: Path | None, default: str) -> str:
    """Return a file's path relative to the campaign's folder, as campaigns name files."""
    if file is None:
        return default
    return Path(os.path.relpath(file.resolve(), campaign.resolve().parent)).as_posix()


def made_campaign(text: str, path: Path) -> Campaign:
    """Return the campaign of a text that is to lie at ``path``."""
    content = parse_settings(text, CampaignFile, path)
    digest = hashlib.sha256(text.encode("utf-8")).hexdigest()
    return Campaign(path, content, digest, (None,) * len(content.step), ((),) * len(content.step))


def campaign_text(
    pieces: Sequence[Piece], why: Sequence[str], *, stand: str, specimen: str, ambient_C: float
) -> str:
    """Return a campaign file of pieces in a row, as :class:`Admission` makes it."""
    head = [
        "# Steps that tell most for a minute of stand time (bufferstand model next). Let the specimen rest",
        "# until it is as warm as the air, run all in order without a break, and fit with --in-a-row.",
        "",
        "[campaign]",
        'id = "next-steps"',
        'title = "Steps that tell most of the spring model"',
        f"stand = {_text(stand)}",
        f"specimen = {_text(specimen)}",
        "",
        "[conditions]",
        f"ambient_C = {ambient_C:.1f}",
        "",
    ]
    comments = [*why, *[""] * (len(pieces) - len(why))]
    return "\n".join([*head, *(_step(one, said) for one, said in zip(pieces, comments, strict=True))])


def _step(piece: Piece, said: str) -> str:
    match piece:
        case Rest():
            lines = ['kind = "hold"', f"duration_s = {piece.duration_s:g}"]
        case SlowStroke():
            lines = [
                'kind = "static"',
                f"speed_mm_per_s = {piece.speed_mm_per_s:g}",
                f"stroke_limit_mm = {piece.stroke_mm:.1f}",
                f"cycles = {piece.cycles}",
            ]
        case Loops():
            lines = [
                'kind = "harmonic"',
                f"prestress_mm = {piece.prestress_mm:.1f}",
                f"amplitude_mm = {piece.amplitude_mm:.1f}",
                f"frequency_Hz = {piece.frequency_Hz:g}",
                f"cycles = {piece.cycles}",
            ]
    comment = [f"# {line}" for line in said.splitlines()]
    return "\n".join([*comment, "[[step]]", *lines, ""])


def _text(value: str) -> str:
    escaped = value.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def shared_errors_of(stand: StandFile) -> SharedErrors:
    """Return what the stand's file states of its channels' errors, as standard uncertainties.

    Limits are rectangles (JCGM 100, 4.3.7). The strokes of several draw wires count as their mean, each wire
    with an error of its own.
    """
    channels = [
        *((one.quantity, one.uncertainty) for one in stand.controller.channel),
        *((one.channel.quantity, one.channel.uncertainty) for one in stand.instruments),
    ]
    force = next((stated for quantity, stated in channels if quantity == "force"), None)
    wires = [stated for quantity, stated in channels if quantity == "stroke"]
    warmth = [one.channel().uncertainty for one in stand.temperature_sensors if one.role == "specimen"]
    delays = [(c.u_delay_s or 0.0) / len(wires) for c in wires]
    if force is not None:
        delays.append(force.u_delay_s or 0.0)
    return SharedErrors(
        force_share=0.01 * limit(None if force is None else force.accuracy_percent),
        force_zero_kN=limit(None if force is None else force.zero),
        reversibility_share=0.01 * limit(None if force is None else force.reversibility_percent),
        delay_s=math.hypot(*delays) if delays else 0.0,
        stroke_share=0.01 * math.hypot(*[limit(c.accuracy_percent) / len(wires) for c in wires], 0.0),
        sensor_C=max((limit(c.zero) for c in warmth), default=0.0),
    )
