"""Settings files: every kind of TOML that users write, and what else reads TOML."""

from __future__ import annotations

import tomllib
from pathlib import Path

from bufferstand.cli.campaign.preparation import prepare
from bufferstand.drivers.acquisition.modbus_io.description import load_description
from bufferstand.drivers.amplifiers.ascii_line.description import load_line_description
from bufferstand.drivers.register_maps.amplifier_map import load_amplifier_map
from bufferstand.drivers.register_maps.profile import load_profile
from bufferstand.drivers.simulated.faults.file import load_faults
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.recording_stand import load_recording_stand
from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.evaluation.publication.fields import read_publication
from bufferstand.evaluation.report.source.fields import read_fields
from bufferstand.evaluation.requirements.inspection import load_inspection
from bufferstand.evaluation.requirements.limit_set import load_limit_set
from bufferstand.foundation.settings import load_settings
from bufferstand.foundation.specimen.file import load_specimen
from bufferstand.model.file import load_model
from bufferstand.model.train.file import load_train
from bufferstand.protocols.campaign_file.schema import load_campaign
from bufferstand.recording.foreign.mapping import load_mapping
from tests.cli.test_settings_messages import FILES
from tests.fuzz.mutators import of_text
from tests.fuzz.target import Target
from tests.fuzz.targets.from_files import ROOT, SAMPLES, contents, of_file
from tests.record_only.bench import labjack, stand_text

HERE = Path(__file__).parent.parent / "samples"
SETS = ROOT / "evaluation" / "validation" / "sets"
MAPS = ROOT / "drivers" / "register_maps"
IO = ROOT / "drivers" / "acquisition" / "modbus_io" / "descriptions"
LINES = ROOT / "drivers" / "amplifiers" / "ascii_line" / "descriptions"
ITEMS = tuple(
    one["id"] for one in tomllib.loads((SAMPLES / "ring-spring-checklist.toml").read_text("utf-8"))["item"]
)
BESIDE = (SAMPLES / "stand.toml", SAMPLES / "specimens", SAMPLES / "models")


def _recording_stands(folder: Path) -> list[bytes]:
    del folder
    return [stand_text(labjack(), inputs=number).encode() for number in (3, 5)]


def _kinds(_: Path) -> list[bytes]:
    return [text.encode() for schema, text in FILES.values() if schema is StandFile]


def _publication(path: Path) -> object:
    return read_publication(path.parent, path)


def _profiles(_: Path) -> list[bytes]:
    return [path.read_bytes() for path in sorted((MAPS / "profiles").glob("*.toml"))]


_CAMPAIGNS = ("demo", "en15551", "fig9", "paper", "paper-full")
_PLANNED = ("demo", "en15551", "fig9", "paper")

SETTINGS = (
    Target(
        "stand",
        "stand files",
        of_file("s.toml", contents(SAMPLES / "stand.toml"), load_stand, of_text),
    ),
    Target(
        "stand-kinds",
        "stand files with each kind of amplifier and sensor",
        of_file("s.toml", _kinds, lambda path: load_settings(path, StandFile), of_text),
    ),
    Target(
        "recording-stand",
        "stand files without a controller",
        of_file("s.toml", _recording_stands, load_recording_stand, of_text),
    ),
    Target(
        "campaign",
        "campaign files",
        of_file("c.toml", contents(*(SAMPLES / f"{one}.toml" for one in _CAMPAIGNS)), load_campaign, of_text),
    ),
    Target(
        "plan",
        "campaign files, planned with stand and specimen",
        of_file(
            "c.toml",
            contents(*(SAMPLES / f"{one}.toml" for one in _PLANNED)),
            prepare,
            of_text,
            beside=BESIDE,
        ),
        dose=4,
        cpu_s=30.0,
    ),
    Target(
        "specimen",
        "specimen files",
        of_file(
            "s.toml",
            contents(
                *sorted((SAMPLES / "specimens").glob("*.toml")),
                *sorted(SETS.glob("static/*/record.toml"))[:4],
            ),
            load_specimen,
            of_text,
        ),
    ),
    Target(
        "limit-set",
        "limit sets",
        of_file(
            "l.toml",
            contents(*sorted((ROOT / "evaluation" / "requirements" / "limit_sets").glob("*.toml"))),
            load_limit_set,
            of_text,
        ),
    ),
    Target(
        "report-fields",
        "report.toml",
        of_file("r.toml", contents(HERE / "report.toml"), read_fields, of_text),
    ),
    Target(
        "publication",
        "publication.toml",
        of_file("p.toml", contents(HERE / "publication.toml"), _publication, of_text),
    ),
    Target(
        "inspection",
        "an inspector's files",
        of_file(
            "i.toml",
            contents(SAMPLES / "ring-spring-checklist.toml"),
            lambda path: load_inspection(path, ITEMS),
            of_text,
        ),
    ),
    Target(
        "mapping",
        "mappings of foreign records",
        of_file("m.toml", contents(*sorted(SETS.glob("*/*/mapping.toml"))), load_mapping, of_text),
    ),
    Target(
        "profile",
        "register profiles",
        of_file("p.toml", _profiles, lambda path: load_profile(path.name, path.parent), of_text),
    ),
    Target(
        "amplifier-map",
        "register maps of amplifiers",
        of_file(
            "m.toml",
            contents(*(MAPS / "amplifier_maps").glob("*.toml")),
            lambda path: load_amplifier_map(path.name, path.parent),
            of_text,
        ),
    ),
    Target(
        "modbus-io",
        "descriptions of Modbus devices",
        of_file(
            "d.toml",
            contents(*sorted(IO.glob("*.toml"))),
            lambda path: load_description(path.name, path.parent),
            of_text,
        ),
    ),
    Target(
        "ascii-line",
        "descriptions of amplifiers that speak lines",
        of_file(
            "d.toml",
            contents(*sorted(LINES.glob("*.toml"))),
            lambda path: load_line_description(path.name, path.parent),
            of_text,
        ),
    ),
    Target(
        "model",
        "spring models",
        of_file("m.toml", contents(*sorted((SAMPLES / "models").glob("*.toml"))), load_model, of_text),
    ),
    Target(
        "train",
        "train files",
        of_file(
            "trains/t.toml",
            contents(*sorted((SAMPLES / "trains").glob("*.toml"))),
            load_train,
            of_text,
            beside=(SAMPLES / "models", SAMPLES / "specimens"),
        ),
    ),
    Target(
        "faults",
        "files of simulated faults",
        of_file("f.toml", contents(HERE / "faults.toml"), load_faults, of_text),
    ),
)
"""Every kind of TOML."""
