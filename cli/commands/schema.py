"""``bufferstand schema``: the JSON Schema of a file that users write, or of the evaluation document."""

from __future__ import annotations

from typing import Any

import click
import orjson

from bufferstand.foundation import ExitStatus

NAMES = {
    "stand": "Stand file of bufferstand",
    "recording-stand": "Stand file without a controller, for record-only mode of bufferstand",
    "campaign": "Campaign file of bufferstand",
    "specimen": "Specimen file of bufferstand",
    "limit-set": "Limit set of bufferstand",
    "report": "Report file of bufferstand",
    "publication": "Publication file of bufferstand",
    "inspection": "Inspector's file of bufferstand",
    "mapping": "Mapping of a foreign record of bufferstand",
    "profile": "Register profile of bufferstand",
    "modbus-io": "Description of a Modbus device of bufferstand",
    "ascii-line": "Description of an amplifier that speaks lines, of bufferstand",
    "model": "Spring model of bufferstand",
    "train": "Train file of bufferstand",
    "evaluation": "Evaluation document of bufferstand",
}
"""Name → title."""


@click.command("schema", epilog="Example:  bufferstand schema campaign > campaign.schema.json")
@click.argument("name", metavar="NAME", type=click.Choice(list(NAMES)))
def command(name: str) -> int:
    """Print the JSON Schema of a file: stand, recording-stand, campaign, specimen, limit-set, report,
    publication, inspection, mapping, profile, modbus-io, ascii-line, model, train; or of the evaluation
    document: evaluation.

    With it an editor completes keys, shows what they mean and marks what is wrong (docs/schemas.md).
    """
    click.echo(orjson.dumps(schema_of(name), option=orjson.OPT_INDENT_2))
    return ExitStatus.DONE


def schema_of(name: str) -> dict[str, Any]:
    """Return the JSON Schema of one of :data:`NAMES`."""
    from bufferstand.foundation import json_schema

    return json_schema(described(name), NAMES[name])


def described(name: str) -> type:  # noqa: PLR0911, PLR0912 - each room is loaded when it is asked for
    """Return the schema, or the typed dictionary, of one of :data:`NAMES`."""
    match name:
        case "stand":
            from bufferstand.drivers.stand_file import StandFile

            return StandFile
        case "recording-stand":
            from bufferstand.drivers.stand_file import RecordingStand

            return RecordingStand
        case "campaign":
            from bufferstand.protocols.campaign_file import CampaignFile

            return CampaignFile
        case "specimen":
            from bufferstand.foundation.specimen import SpecimenFile

            return SpecimenFile
        case "limit-set":
            from bufferstand.evaluation.requirements import LimitSet

            return LimitSet
        case "report":
            from bufferstand.evaluation.report.source import ReportFields

            return ReportFields
        case "publication":
            from bufferstand.evaluation.publication import Publication

            return Publication
        case "inspection":
            from bufferstand.evaluation.facts import Inspection

            return Inspection
        case "mapping":
            from bufferstand.recording.foreign import MappingFile

            return MappingFile
        case "profile":
            from bufferstand.drivers.register_maps import ProfileFile

            return ProfileFile
        case "modbus-io":
            from bufferstand.drivers.acquisition.modbus_io import Description

            return Description
        case "ascii-line":
            from bufferstand.drivers.amplifiers.ascii_line import LineDescription

            return LineDescription
        case "model":
            from bufferstand.model import ModelFile

            return ModelFile
        case "train":
            from bufferstand.model.train import TrainFile

            return TrainFile
        case _:
            from bufferstand.evaluation.facts import EvaluationDocument

            return EvaluationDocument
