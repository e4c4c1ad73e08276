"""A campaign file with everything that it names, read and planned: the beginning of plan, run and demo."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from drivers.stand_file import StandFile, load_stand, wires_from
from foundation.errors import BadInput
from foundation.specimen import SpecimenFile, load_specimen
from model.file import load_model
from protocols.campaign import Campaign, load_campaign
from protocols.limits import StandLimits
from protocols.plan import Plan, make_plan
from protocols.prediction import ModelPredictor


@dataclass(frozen=True)
class Prepared:
    """A campaign, its stand, its specimen with the spring model and its path, and the plan made of them.

    ``stand_file`` is the one to record, ``wired`` the one to open: they differ in where the devices lie when
    the campaign goes on from a copy of its files.
    """

    campaign: Campaign
    stand_file: StandFile
    wired: StandFile
    specimen_file: SpecimenFile
    model_path: Path
    plan: Plan
    predictor: ModelPredictor


def prepare(path: Path, *, devices_from: Path | None = None) -> Prepared:
    """Read a campaign file and what it names, and plan it.

    Parameters
    ----------
    path : Path
        The campaign file.
    devices_from : Path, optional
        Folder that relative paths of devices start from; that of the stand file if not given.

    Raises
    ------
    BadInput
        If a file cannot be read or breaks its schema, or a step breaks a limit.
    """
    campaign = load_campaign(path)
    stand_file = load_stand(campaign.stand_path)
    specimen_file = load_specimen(campaign.specimen_path)
    specimen = specimen_file.specimen
    if specimen.model is None:
        raise BadInput(
            "the specimen names no spring model, from which forces and heat are planned",
            file=campaign.specimen_path,
            place="specimen.model",
            remedy="add one; sample_runs/models/category-a-elastomer.toml serves for a first estimate",
        )
    model_path = campaign.specimen_path.parent / specimen.model
    limits = stand_file.limits
    predictor = ModelPredictor(load_model(model_path))
    plan = make_plan(
        campaign,
        StandLimits(
            force_max_kN=limits.force_max_kN,
            stroke_max_mm=limits.stroke_max_mm,
            frequency_max_Hz=limits.frequency_max_Hz,
            speed_max_mm_per_s=limits.speed_max_mm_per_s,
        ),
        predictor,
        specimen,
    )
    wired = stand_file if devices_from is None else wires_from(stand_file, devices_from)
    return Prepared(campaign, stand_file, wired, specimen_file, model_path, plan, predictor)
