"""A campaign on a specimen of which nothing is known: its first stroke counts, also on a later start."""

from __future__ import annotations

from pathlib import Path

from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.daq.campaign_folder.folder import load_record
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.specimen.file import load_specimen
from bufferstand.protocols.campaign_file.schema import load_campaign
from bufferstand.protocols.limits import StandLimits
from bufferstand.protocols.planning.plan import make_plan
from bufferstand.protocols.prediction.curve_predictor import UnknownSpecimenPredictor
from tests.daq.run_in_process import COARSE, facts_of

SAMPLES = Path(__file__).parents[2] / "sample_runs"
SLOW = '[[step]]\nkind = "static"\nspeed_mm_per_s = 10.0\nforce_limit_kN = 400.0\n'
FITS = (
    '[[step]]\nkind = "harmonic"\nprestress_mm = 50.0\namplitude_mm = 20.0\nfrequency_Hz = 0.5\ncycles = 2\n'
)
BEYOND = FITS.replace("20.0", "45.0")
HOLD = '[[step]]\nkind = "hold"\nstroke_mm = 20.0\nduration_s = 1.0\n'


def run(tmp_path: Path, steps: str) -> CampaignOutcome:
    (tmp_path / "specimen.toml").write_text(
        '[specimen]\nid = "X-1"\nmax_stroke_mm = 105.0\n', encoding="utf-8"
    )
    campaign_file = tmp_path / "campaign.toml"
    head = f'[campaign]\nid = "x"\nstand = "{SAMPLES / "stand.toml"}"\nspecimen = "specimen.toml"\n'
    campaign_file.write_text(head + steps, encoding="utf-8")
    campaign = load_campaign(campaign_file)
    stand_file = load_stand(campaign.stand_path)
    specimen = load_specimen(campaign.specimen_path).specimen
    predictor = UnknownSpecimenPredictor()
    plan = make_plan(campaign, StandLimits(**stand_file.limits.model_dump()), predictor, specimen)
    opened = open_in_process(stand_file)
    return run_campaign(
        plan,
        opened.stand,
        opened.clock,
        tmp_path / "out",
        facts_of(stand_file),
        predictor=predictor,
        settings=COARSE,
    )


def test_what_the_first_stroke_shows_lets_the_rest_run(tmp_path: Path) -> None:
    outcome = run(tmp_path, SLOW + FITS + HOLD)
    assert (outcome.status, outcome.exit_status) == ("complete", 0), outcome.reason
    assert len(outcome.runs) == 2


def test_a_step_beyond_what_it_shows_is_not_begun_now_nor_on_the_next_start(tmp_path: Path) -> None:
    """400 kN are reached at some 84 mm; 50 + 45 mm is beyond."""
    for attempt in range(2):
        outcome = run(tmp_path, SLOW + FITS + BEYOND)
        assert (outcome.status, outcome.exit_status) == ("stopped", 3), outcome.reason
        assert "the stroke of 95 mm is beyond 8" in outcome.reason
        assert (
            "by the curve that the first slow stroke has shown; nearest admissible: amplitude_mm = 3"
            in outcome.reason
        )
        assert outcome.safe_stop is not None
        assert outcome.safe_stop.safe
        assert len(outcome.runs) == (2 if attempt == 0 else 0)
        record = load_record(tmp_path / "out")
        assert record is not None
        assert [step.status for step in record.steps] == ["complete", "complete", "pending"]
