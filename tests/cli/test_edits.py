"""Files of a campaign that were edited since they were taken: seen, shown, taken or kept, and recorded."""

from __future__ import annotations

import json
import math
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.cli.campaign import edits
from bufferstand.cli.campaign.edits import Choice, ResumedCampaign, going_on
from bufferstand.cli.campaign.preparation import prepare
from bufferstand.daq.campaign_folder.folder import CampaignFolder, CampaignRecord, load_record
from bufferstand.daq.campaign_folder.inputs import edits_between
from bufferstand.daq.campaign_folder.run_metadata import CampaignMetadata
from bufferstand.daq.campaign_folder.start_records import begin, left_to_do
from bufferstand.daq.guards import unguarded_at
from bufferstand.drivers.register_maps.profile import SHIPPED
from bufferstand.foundation.errors import BadInput

SAMPLES = Path(__file__).parents[2] / "sample_runs"
FACTS = CampaignMetadata(stand={}, watchdog_s=2.0, started_here=True)
STEP = """
[[step]]
kind = "harmonic"
name = "{name}"
prestress_mm = 20.0
amplitude_mm = {amplitude}
frequency_Hz = 1.0
cycles = 3
"""
HEAD = """[campaign]
id = "edited"
stand = "stand.toml"
specimen = "specimens/category-a-elastomer.toml"
[limits]
temperature_stop_C = 40.0
"""


class Lab:
    """A campaign of two steps, begun in a folder; the first is complete if it is said so."""

    def __init__(self, folder: Path, *, done: bool = True) -> None:
        shutil.copytree(SAMPLES / "specimens", folder / "lab/specimens")
        shutil.copytree(SAMPLES / "models", folder / "lab/models")
        shutil.copy(SAMPLES / "stand.toml", folder / "lab/stand.toml")
        self.campaign, self.out = folder / "lab/edited.toml", folder / "out"
        self.campaign.write_text(
            HEAD + STEP.format(name="one", amplitude=5) + STEP.format(name="two", amplitude=6)
        )
        self.start(ResumedCampaign(prepare(self.campaign)))
        if done:
            (self.out / "runs/one.h5").touch()
            record = self.record
            first = replace(record.steps[0], status="complete", cycles_done=3, runs=("runs/one.h5",))
            CampaignFolder(self.out).save(record.with_step(first))

    @property
    def record(self) -> CampaignRecord:
        record = load_record(self.out)
        assert record is not None
        return record

    def edit(self, old: str, new: str, file: str = "lab/edited.toml") -> None:
        path = self.out.parent / file
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))

    def add_step(self, file: str = "lab/edited.toml") -> None:
        with (self.out.parent / file).open("a") as stream:
            stream.write(STEP.format(name="three", amplitude=7))

    def resume(self, choice: Choice | None = None) -> ResumedCampaign:
        return going_on(self.out, self.record, choice)

    def start(self, going: ResumedCampaign) -> CampaignRecord:
        return begin(going.prepared.plan, CampaignFolder(self.out), replace(FACTS, edits=going.edits))

    def left(self, going: ResumedCampaign) -> list[str]:
        return [step.name for step, _ in left_to_do(going.prepared.plan, self.record, self.out)]


def test_unedited_files_are_not_asked_about(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lab = Lab(tmp_path)
    going = lab.resume()
    assert lab.left(going) == ["two"]
    assert capsys.readouterr().err == ""
    record = lab.start(going)
    assert [sorted(start) for start in record.starts] == [
        ["arming", "at_utc", "simulate", "simulated", "software", "speed"]
    ] * 2
    assert not (lab.out / "inputs-before").exists()


@pytest.mark.parametrize("edited", [False, True])
def test_the_stored_zero_of_the_stand_is_sought_beside_the_stand_file_not_its_copy(
    tmp_path: Path, edited: bool
) -> None:
    lab = Lab(tmp_path)
    if edited:
        lab.add_step()
    for choice in ("take", "keep"):
        assert lab.resume(choice).prepared.stand_home == (tmp_path / "lab/stand.toml")


def test_a_step_that_was_added_is_taken_shown_and_recorded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lab = Lab(tmp_path)
    was = lab.campaign.read_text()
    lab.add_step()
    going = lab.resume("take")
    told = capsys.readouterr().err
    assert '+name = "three"' in told
    assert "steps: 1 of 3 complete and not repeated; 2 to do\n  new: “three”" in told
    assert lab.left(going) == ["two", "three"]
    record = lab.start(going)
    edited = record.starts[-1]["edits"]
    assert edited["how"] == "--take-edits"
    (file,) = edited["files"]
    assert file["file"] == "edited.toml"
    assert '+name = "three"' in file["diff"]
    assert (lab.out / edited["kept"] / "edited.toml").read_text() == was
    assert (lab.out / "inputs/edited.toml").read_text() == lab.campaign.read_text()
    assert lab.left(lab.resume()) == ["two", "three"], "and it is not asked again"


def test_kept_files_go_on_as_they_were_taken(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    lab.add_step()
    assert lab.left(lab.resume("keep")) == ["two"]


def test_what_a_rehearsal_faster_than_the_wall_did_not_guard_is_no_edit_of_a_limit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lab = Lab(tmp_path)
    stand_file = lab.resume("take").prepared.stand_file
    beside = unguarded_at(10.0, stand_file)
    assert beside
    record = lab.record
    plan = {**record.plan, "not_guarded": [*record.plan["not_guarded"], *beside]}
    CampaignFolder(lab.out).save(replace(record, plan=plan))
    lab.add_step()
    capsys.readouterr()
    assert lab.left(lab.resume("keep")) == ["two"]
    assert "limit:" not in capsys.readouterr().err


def test_without_a_terminal_and_an_option_it_is_refused_with_a_summary(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    lab.add_step()
    lab.edit("port = 15020", "port = 15021", "lab/stand.toml")
    with pytest.raises(BadInput) as refused:
        lab.resume()
    assert "edited.toml (+8 −0 lines), stand.toml (+1 −1 lines)" in str(refused.value)
    assert "--take-edits" in refused.value.remedy
    assert "--keep" in refused.value.remedy


def test_a_changed_step_is_another_and_a_dropped_one_keeps_its_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lab = Lab(tmp_path)
    lab.edit("amplitude_mm = 5", "amplitude_mm = 8")
    going = lab.resume("take")
    assert lab.left(going) == ["one", "two"]
    said = (
        "changed: “one” (amplitude_mm 5 → 8): it was complete, and is run AGAIN as another step; the runs of"
    )
    assert said in capsys.readouterr().err
    lab.start(going)
    assert (lab.out / "runs/one.h5").exists()


@pytest.mark.parametrize(
    ("old", "new", "file"),
    [
        ("temperature_stop_C = 40.0", "temperature_stop_C = 38.0", "lab/edited.toml"),
        ("[limits]", "[limits]\nforce_max_kN = 590.0", "lab/edited.toml"),
        ("year = 2026", "year = 2025", "lab/specimens/category-a-elastomer.toml"),
        ("force_max_kN = 600.0", "force_max_kN = 580.0", "lab/stand.toml"),
    ],
)
def test_limits_and_facts_of_the_same_specimen_make_no_other_test(
    tmp_path: Path, old: str, new: str, file: str
) -> None:
    lab = Lab(tmp_path)
    hash_before = lab.record.steps[0].plan_hash
    lab.edit(old, new, file)
    going = lab.resume("take")
    assert lab.left(going) == ["two"]
    first = lab.start(going).steps[0]
    assert first.status == "complete"
    assert first.plan_hash != hash_before
    assert first.runs == ("runs/one.h5",)
    assert lab.left(lab.resume()) == ["two"]


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("temperature_stop_C = 40.0", "temperature_stop_C = 38.0", "temperature_stop_C 40 → 38"),
        ("[limits]", "[guards]\nlag_stop_s = 5.0\n[limits]", "guards.lag_stop_s 10 → 5"),
        ("[limits]", "[limits]\nstroke_max_mm = 90.0", "stroke_max_mm 105 → 90"),
    ],
)
def test_a_stricter_limit_is_never_left_out(tmp_path: Path, old: str, new: str, named: str) -> None:
    lab = Lab(tmp_path)
    lab.edit(old, new)
    with pytest.raises(BadInput, match="made stricter is not left out") as refused:
        lab.resume("keep")
    assert named in str(refused.value)


def test_a_looser_limit_is_called_so_and_may_be_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lab = Lab(tmp_path)
    lab.edit("temperature_stop_C = 40.0", "temperature_stop_C = 45.0")
    going = lab.resume("keep")
    assert "limit: temperature_stop_C 40 → 45 (LOOSER)" in capsys.readouterr().err
    assert going.prepared.campaign.limits.temperature_stop_C == 40.0


def test_an_answer_that_would_be_refused_is_not_offered(tmp_path: Path) -> None:
    """Without a terminal: what is looser is refused at once, and what is stricter can only be taken."""
    lab = Lab(tmp_path)
    lab.edit("temperature_stop_C = 40.0", "temperature_stop_C = 45.0")
    for choice in (None, "take"):
        with pytest.raises(BadInput, match="made looser, which never counts") as refused:
            lab.resume(choice)  # type: ignore[arg-type]
        assert "--take-edits" not in refused.value.message()
        assert "--keep" in refused.value.remedy
    lab.edit("temperature_stop_C = 45.0", "temperature_stop_C = 38.0")
    with pytest.raises(BadInput, match="were edited since they were taken") as refused:
        lab.resume()
    assert "--take-edits" in refused.value.remedy
    assert "--keep" not in refused.value.message()
    lab.edit("[limits]", "[guards]\ntilt_max_mm = 6.0\n[limits]")
    for choice in (None, "take", "keep"):
        with pytest.raises(BadInput) as refused:
            lab.resume(choice)  # type: ignore[arg-type]
        assert "undo" in refused.value.remedy
        assert ("--take-edits" in refused.value.remedy) == (choice == "keep")


def test_at_a_terminal_what_cannot_be_kept_is_not_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[str] = []

    def answer(question: str) -> str:
        asked.append(question)
        return "keep" if len(asked) == 1 else "take"

    monkeypatch.setattr(edits, "is_terminal", lambda stream: True)  # noqa: ARG005 - any stream
    monkeypatch.setattr(edits, "typed_line", answer)
    lab = Lab(tmp_path)
    lab.edit("temperature_stop_C = 40.0", "temperature_stop_C = 38.0")
    with pytest.raises(BadInput, match="take was not answered"):
        lab.resume()
    assert lab.resume().edits["how"] == "typed"
    assert asked == ["Type take to go on with the edits: "] * 2
    assert "made stricter is not left out: temperature_stop_C 40 → 38" in capsys.readouterr().err


def test_a_profile_of_ones_own_is_held_against_the_one_that_it_replaces(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lab = Lab(tmp_path)
    text = (SHIPPED / "ring.toml").read_text()
    places = ("ring", "own.toml", "other.toml")
    for number in (1, 2):
        was, now = places[number - 1 : number + 1]
        (tmp_path / "lab" / now).write_text(text.replace('edition = "3"', f'edition = "{3 + number}"'))
        lab.edit(f'profile = "{was}"', f'profile = "{now}"', "lab/stand.toml")
        lab.start(lab.resume("take"))
        shown = capsys.readouterr().err
        replaced = "profile “ring”" if was == "ring" else was
        assert [line for line in shown.splitlines() if line.startswith("changed: ")] == [
            f"changed: stand.toml: controller.profile: {was} → {now}",
            f"changed: {now} in place of {replaced}: profile.edition: {2 + number} → {3 + number}",
        ]
        assert len(shown.splitlines()) < 40


def test_copies_that_were_edited_count_as_edits_and_are_kept_aside(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    lab.add_step("out/inputs/edited.toml")
    edited = (lab.out / "inputs/edited.toml").read_text()
    with pytest.raises(BadInput, match="were edited since they were taken"):
        lab.resume()
    assert lab.left(lab.resume("take")) == ["two", "three"]
    assert lab.left(lab.resume("keep")) == ["two"]
    assert (lab.out / "inputs/edited.toml").read_text() == lab.record.inputs["edited.toml"]
    (aside,) = lab.out.glob("inputs-before/*/edited.toml")
    assert aside.read_text() == edited


def test_two_different_edits_are_not_guessed_between(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    lab.add_step("out/inputs/edited.toml")
    lab.edit("amplitude_mm = 6", "amplitude_mm = 9")
    with pytest.raises(BadInput, match="were edited, differently"):
        lab.resume("take")
    assert lab.left(lab.resume("keep")) == ["two"]


@pytest.mark.parametrize("lost", ["lab", "lab/edited.toml", "lab/specimens"])
def test_without_the_originals_the_copies_serve(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], lost: str
) -> None:
    lab = Lab(tmp_path)
    (tmp_path / lost).rename(tmp_path / "gone")
    assert lab.left(lab.resume()) == ["two"]
    assert "it goes by their copies in" in capsys.readouterr().err


def test_lost_copies_are_written_anew(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    shutil.rmtree(lab.out / "inputs")
    assert lab.left(lab.resume()) == ["two"]
    assert (lab.out / "inputs/edited.toml").exists()


def test_a_folder_of_an_earlier_version_goes_by_its_copies(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    path = lab.out / "campaign.json"
    content = json.loads(path.read_text())
    for key in ("inputs", "originals", "starts"):
        del content[key]
    path.write_text(json.dumps(content))
    lab.add_step()
    assert lab.left(lab.resume()) == ["two"]


def test_another_specimen_is_another_campaign(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    lab.edit('id = "A-105-E-01"', 'id = "B-7"', "lab/specimens/category-a-elastomer.toml")
    with pytest.raises(
        BadInput, match="name specimen “B-7” now, and what is recorded here is of “A-105-E-01”"
    ):
        lab.resume("take")


def test_a_mistake_in_an_edit_is_named_in_the_file_that_was_edited(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    lab.edit("amplitude_mm = 6", "amplitud_mm = 6")
    with pytest.raises(BadInput, match=r"lab/edited\.toml: line .*amplitud_mm.*did you mean “amplitude_mm”"):
        lab.resume("take")


def test_where_nothing_was_recorded_the_present_files_are_taken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lab = Lab(tmp_path, done=False)
    assert lab.record.recorded_nothing(lab.out)
    lab.edit("port = 15020", "port = 15021", "lab/stand.toml")
    going = lab.resume()
    assert "nothing was recorded yet" in capsys.readouterr().err
    assert going.prepared.wired.controller.port == 15021
    assert lab.start(going).starts[-1]["edits"]["how"] == "nothing was recorded"


def test_a_stand_file_named_by_an_absolute_path_is_watched_and_cannot_be_left_out(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    shutil.copy(lab.campaign.parent / "stand.toml", tmp_path / "elsewhere.toml")
    lab.edit('"models/', f'"{SAMPLES}/models/', "elsewhere.toml")
    lab.edit('stand = "stand.toml"', f'stand = "{tmp_path}/elsewhere.toml"')
    lab.start(lab.resume("take"))
    lab.edit("port = 15020", "port = 15021", "elsewhere.toml")
    with pytest.raises(BadInput, match=r"elsewhere\.toml"):
        lab.resume()
    with pytest.raises(BadInput, match="named by an absolute path"):
        lab.resume("keep")
    assert lab.resume("take").prepared.wired.controller.port == 15021


def test_what_is_refused_without_a_terminal_says_whether_the_files_or_their_copies_were_edited(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lab = Lab(tmp_path)
    lab.add_step("out/inputs/edited.toml")
    with pytest.raises(BadInput, match=r"the campaign's copies in .*/out/inputs were edited since"):
        lab.resume()
    assert f"the campaign's copies in {lab.out / 'inputs'} were edited" in capsys.readouterr().err
    lab.add_step()
    with pytest.raises(BadInput, match=r"the campaign's files in .*/lab were edited since"):
        lab.resume()


def test_a_step_knows_the_hashes_that_it_had_before_limits_were_edited(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    hashes = [lab.record.steps[0].plan_hash]
    for before_C, now_C in ((40.0, 38.0), (38.0, 37.0)):
        lab.edit(f"temperature_stop_C = {before_C}", f"temperature_stop_C = {now_C}")
        hashes.insert(0, lab.start(lab.resume("take")).steps[0].plan_hash)
    assert len(set(hashes)) == 3
    assert lab.record.steps[0].hashes == tuple(hashes)
    assert set(hashes) <= lab.record.hashes


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("amplitude_mm = 5", "amplitude_mm = 5.0   # half the range"),
        ("[limits]\n", "# what it may do\n\n[limits]\n"),
        ("temperature_stop_C = 40.0", "temperature_stop_C = 4.0e1"),
    ],
)
def test_comments_and_layout_are_no_edit_but_are_taken_and_recorded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str
) -> None:
    lab = Lab(tmp_path)
    lab.edit(old, new)
    going = lab.resume()
    assert "nothing changes, and nothing is asked" in capsys.readouterr().err
    assert lab.left(going) == ["two"]
    edited = lab.start(going).starts[-1]["edits"]
    assert edited["how"] == "no change in meaning"
    assert edited["files"][0]["diff"]
    assert lab.left(lab.resume()) == ["two"]
    assert capsys.readouterr().err == ""


def test_another_way_to_write_the_rate_is_the_same_step(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    lab.edit("frequency_Hz = 1.0", f"peak_speed_mm_per_s = {2.0 * math.pi * 5.0!r}")
    assert lab.left(lab.resume("take"))[0] != "one", "5 mm at that speed is 1 Hz; the other is another"


def test_a_ramp_s_speed_and_a_limit_do_not_repeat_what_is_complete(tmp_path: Path) -> None:
    """Motions hang on them, what was asked for does not."""
    lab = Lab(tmp_path)
    lab.edit("[limits]", "[motion]\nramp_speed_mm_per_s = 15.0\n[limits]\nspeed_max_mm_per_s = 700.0")
    going = lab.resume("take")
    assert lab.left(going) == ["two"]
    assert lab.start(going).steps[0].runs == ("runs/one.h5",)


def test_a_limit_that_what_is_complete_would_break_stops_only_what_is_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lab = Lab(tmp_path)
    lab.edit("amplitude_mm = 6", "amplitude_mm = 2")
    lab.edit("[limits]", "[limits]\nstroke_max_mm = 23.0")  # 20 + 5 mm were done
    going = lab.resume("take")
    assert lab.left(going) == ["two"]
    assert any("“one” is complete, under other limits" in note for note in going.prepared.plan.notes)
    assert "limit: stroke_max_mm 105 → 23 (stricter)" in capsys.readouterr().err
    lab.edit("amplitude_mm = 2", "amplitude_mm = 4")
    with pytest.raises(BadInput, match=r"stroke 20 . 4 = 24 mm is above stroke_max_mm = 23"):
        lab.resume("take")


@pytest.mark.dose(5)
@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[limits]", "[guards.action]\nagreement = 'stop'\n[limits]", "agreement note → stop (stricter)"),
        ("[limits]", "[guards.action]\nforce = 'stop'\n[limits]", "force emergency → stop (LOOSER)"),
        ("[limits]", "[guards]\ntilt_max_mm = 8.0\n[limits]", "guards.tilt_max_mm 5 → 8 (LOOSER)"),
        ("[limits]", "[zero]\ntouch = false\n[limits]", "zero.touch true → false (LOOSER)"),
        ("[limits]\n", "[limits]\non_temperature_stop = 'skip'\n", "stop stop → skip (LOOSER)"),
        ("[limits]\n", "[limits]\nspeed_max_mm_per_s = 600.0\n", "speed_max_mm_per_s 800 → 600 (stricter)"),
        (
            'name = "two"',
            'name = "two"\ntemperature_stop_C = 45.0',
            "“two”: temperature_stop_C 40 → 45 (LOOSER)",
        ),
        (
            'name = "two"',
            'name = "two"\nstart_temperature_C = [15.0, 30.0]',
            "“two”: start_temperature_C any → 15 … 30 (stricter)",
        ),
    ],
)
def test_an_edit_of_a_limit_is_judged_by_what_it_means(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, said: str
) -> None:
    lab = Lab(tmp_path)
    lab.edit(old, new)
    if said.endswith("(stricter)"):
        with pytest.raises(BadInput, match="made stricter is not left out"):
            lab.resume("keep")
    else:
        lab.resume("keep")
    assert said in capsys.readouterr().err


def test_a_softer_machine_is_no_limit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lab = Lab(tmp_path)
    lab.edit("machine_stiffness_kN_per_mm = 150.0", "machine_stiffness_kN_per_mm = 120.0", "lab/stand.toml")
    assert lab.left(lab.resume("keep")) == ["two"]
    assert "limit:" not in capsys.readouterr().err


TEXTS = st.dictionaries(st.sampled_from(["a.toml", "b/c.toml", "d.toml"]), st.text("ab=\n", max_size=20))


@given(TEXTS, TEXTS)
def test_edits_are_what_differs_and_nothing_else(before: dict[str, str], now: dict[str, str]) -> None:
    edits = {edit.place: edit for edit in edits_between(before, now)}
    for place in before.keys() | now.keys():
        if place in edits:
            assert (edits[place].before, edits[place].now) == (before.get(place), now.get(place))
            assert before.get(place) != now.get(place)
        else:
            assert before[place] == now[place]
    assert edits_between(now, now) == ()


def without(stand: str, name: str) -> str:
    """Return a stand file's text without the tables that begin with, or are called by, a name."""
    tables = re.split(r"(?m)^(?=\[)", stand)
    kept = (one for one in tables if f"[{name}" not in one and f'name = "{name}"' not in one)
    return "".join(kept)


@pytest.mark.dose(4)
@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("watchdog_s = 2.0", "watchdog_s = 1.5", "controller.watchdog_s 2 → 1.5 (stricter)"),
        ("watchdog_s = 2.0", "watchdog_s = 10.0", "controller.watchdog_s 2 → 10 (LOOSER)"),
        ('role = "specimen"', 'role = "ambient"', "thermometers on the specimen {n} → {fewer} (LOOSER)"),
        ("amplifier", "", "not guarded: – → no second force (LOOSER)"),
        ("temperature_1", "", "thermometers on the specimen {n} → {fewer} (LOOSER)"),
        ("temperature_3", "", "thermometers in the air 1 → 0 (LOOSER)"),
        ('"ring"', '"polling"', "not guarded: – → no sample ring (LOOSER)"),
    ],
)
def test_guards_of_the_stand_file_are_limits_too_and_a_looser_one_never_counts(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    lab = Lab(tmp_path)
    stand = lab.campaign.with_name("stand.toml")
    sensors = stand.read_text().count('role = "specimen"')
    text = stand.read_text()
    stand.write_text(text.replace(old, new, 1) if new else without(text, old))
    told = said.format(n=sensors, fewer=sensors - 1)
    refused, taken = ("keep", "take") if told.endswith("(stricter)") else ("take", "keep")
    with pytest.raises(BadInput) as why:
        lab.resume(refused)  # type: ignore[arg-type]
    assert told in str(why.value)
    assert lab.left(lab.resume(taken)) == ["two"]  # type: ignore[arg-type]
