"""Reads and plans a campaign file with everything that it names: the beginning of plan, run and demo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from bufferstand.daq.guards import (
    demand_consent,
    demand_own_tables,
    demand_thermometers,
    unguarded,
    watching_of,
)
from bufferstand.drivers.controllers import leeway_of
from bufferstand.drivers.stand_file import StandFile, load_stand, wires_from
from bufferstand.foundation.settings import demand_named
from bufferstand.foundation.specimen import SpecimenFile, load_specimen
from bufferstand.model import load_model
from bufferstand.protocols import StandLimits
from bufferstand.protocols.campaign_file import Campaign, demand_bounds, load_campaign
from bufferstand.protocols.planning import Plan, demand_heat_is_seen, make_plan
from bufferstand.protocols.prediction import (
    CurvePredictor,
    ModelPredictor,
    Predictor,
    UnknownSpecimenPredictor,
)

BOTH = "{specimen} has a spring model and a [catalogue]: the model is taken, the catalogue's points are not"
"""What is said of a specimen of which two things are known."""


@dataclass(frozen=True)
class PreparedCampaign:
    """A campaign, its stand, its specimen with the spring model and its path, and the plan made of them.

    ``stand_file`` is the one to record, ``wired`` the one to open: they differ in where the devices lie when
    the campaign goes on from a copy of its files. ``stand_home`` is where the stand file itself lies, or lay:
    its zero is stored beside it, not beside a copy.
    """

    campaign: Campaign
    stand_file: StandFile
    wired: StandFile
    specimen_file: SpecimenFile
    model_path: Path | None
    plan: Plan
    predictor: Predictor
    stand_home: Path


def prepare(
    path: Path,
    *,
    devices_from: Path | None = None,
    over: Sequence[Mapping[str, Any]] = (),
    rounds: int = 1,
) -> PreparedCampaign:
    """Read a campaign file and what it names, and plan it.

    Parameters
    ----------
    path : Path
        The campaign file.
    devices_from : Path, optional
        Folder that relative paths of devices start from; that of the stand file if not given.
    over : sequence of mapping
        Steps that are complete, as data of an earlier plan: no stricter limit refuses them any more.
    rounds : int
        So many times over.

    Raises
    ------
    BadInput
        If a file cannot be read or breaks its schema, a setting lies outside its bounds, a step breaks a
        limit, or a specimen that heat destroys has no temperature stop and no consent.
    """
    return prepare_campaign(load_campaign(path).in_rounds(rounds), devices_from=devices_from, over=over)


def prepare_campaign(
    campaign: Campaign, *, devices_from: Path | None = None, over: Sequence[Mapping[str, Any]] = ()
) -> PreparedCampaign:
    """Plan a campaign that was read, or made; parameters and errors as :func:`prepare`."""
    path = campaign.path
    stand_file = load_stand(demand_named(campaign.stand_path, path, ("campaign", "stand")))
    of_specimen = demand_named(campaign.specimen_path, path, ("campaign", "specimen"))
    specimen_file = load_specimen(of_specimen)
    specimen = specimen_file.specimen
    model_path = None
    if specimen.model is not None:
        named = of_specimen.parent / specimen.model
        model_path = demand_named(named, of_specimen, ("specimen", "model"))
    limits = stand_file.limits
    predictor = _predictor(specimen_file, model_path)
    of_stand = StandLimits(
        force_max_kN=limits.force_max_kN,
        stroke_max_mm=limits.stroke_max_mm,
        frequency_max_Hz=limits.frequency_max_Hz,
        speed_max_mm_per_s=limits.speed_max_mm_per_s,
        machine_stiffness_kN_per_mm=limits.machine_stiffness_kN_per_mm,
        force_speed=limits.force_speed,
    )
    demand_own_tables(campaign.content.guards, campaign.path)
    demand_bounds(campaign, of_stand, specimen, watching_of(stand_file))
    demand_consent(campaign, specimen, stand_file)
    plan = make_plan(campaign, of_stand, predictor, specimen, over=over)
    demand_heat_is_seen(plan)
    demand_thermometers(plan, stand_file, {str(step["plan_hash"]) for step in over})
    plan = replace(plan, not_guarded=unguarded(plan, stand_file, predictor))
    if model_path is not None and specimen_file.catalogue is not None:
        plan = replace(plan, notes=(BOTH.format(specimen=campaign.specimen_path.name), *plan.notes))
    wired = stand_file if devices_from is None else wires_from(stand_file, devices_from)
    stand_home = stand_file.path if devices_from is None else devices_from / stand_file.path.name
    return PreparedCampaign(
        campaign, stand_file, wired, specimen_file, model_path, plan, predictor, stand_home
    )


def _predictor(specimen_file: SpecimenFile, model_path: Path | None) -> Predictor:
    """Return what is known of a specimen: its spring model, else its catalogue's curve, else nothing."""
    if model_path is not None:
        return ModelPredictor(load_model(model_path))
    if specimen_file.catalogue is not None:
        return CurvePredictor.of_catalogue(specimen_file.catalogue)
    return UnknownSpecimenPredictor()


def outage_leeway(prepared: PreparedCampaign) -> tuple[float, str]:
    """Return how long an outage of the controller's wire is ridden out [s], and what is said of it."""
    controller = prepared.stand_file.controller
    silence_s = prepared.campaign.content.guards.controller_silence_s
    leeway = leeway_of(controller, prepared.stand_file.profile(), silence_s)
    return leeway.longest_s(controller.timeout_s), leeway.sentence(controller.timeout_s)
