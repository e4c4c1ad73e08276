"""Reading a stand file: its schema, the profile that it names, and the bounds that hang on several keys."""

from __future__ import annotations

from pathlib import Path

from bufferstand.drivers.register_maps import Profile
from bufferstand.drivers.stand_file.bounds import demand_stand_bounds
from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import load_settings, place_of, read_text


def load_stand(path: Path) -> StandFile:
    """Read and check a stand file and the profile that it names.

    Raises
    ------
    BadInput
        If it cannot be read, breaks the schema, names a profile that is not there or does not fit, or has a
        setting outside its bounds.
    """
    stand_file = load_settings(path, StandFile)
    stand_file._path = path
    _demand_same_channels(stand_file, stand_file.profile(), read_text(path))
    try:
        demand_stand_bounds(stand_file, stand_file.profile(), read_text(path))
    except BadInput as error:
        if error.file is not None:
            raise
        raise error.of_file(path) from None
    return stand_file


def _demand_same_channels(stand_file: StandFile, profile: Profile, text: str) -> None:
    """See that the stand file describes each channel that the profile samples, and no other."""
    described = [channel.name for channel in stand_file.controller.channel]
    if unknown := [name for name in profile.sampled if name not in described]:
        names = ", ".join(unknown)
        raise BadInput(
            f"profile “{stand_file.controller.profile}” samples {names}, which the stand file "
            "does not describe",
            file=stand_file.path,
            place=place_of(("controller", "profile"), text),
            remedy=f"add a [[controller.channel]] of {names}, or name a profile that does not sample it",
        )
    for number, name in enumerate(described):
        if name in profile.sampled:
            continue
        where, example = (
            ("ring.sample", f"“{name}:i16”") if profile.poll is None else ("poll.reads", f"“{name}”")
        )
        raise BadInput(
            f"profile “{stand_file.controller.profile}” does not sample “{name}”; it samples "
            + ", ".join(profile.sampled),
            file=stand_file.path,
            place=place_of(("controller", "channel", number, "name"), text),
            remedy=f"leave the channel out, or name a profile whose {where} has it, e.g. {example}",
        )
