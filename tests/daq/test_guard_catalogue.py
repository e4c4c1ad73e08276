"""Every kind of guard keeps its contract (settings, facts, margin, docs, a trip); a new one is one file."""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from bufferstand.daq.guards.catalogue import GROUP, Kind, kinds
from bufferstand.daq.guards.guard import Guard
from bufferstand.daq.guards.kinds.agreement import AgreementGuard
from bufferstand.daq.guards.kinds.channel import ChannelGuard
from bufferstand.daq.guards.kinds.rate import SpeedGuard
from bufferstand.daq.guards.kinds.temperature import TemperatureGuard
from bufferstand.daq.guards.kinds.wiring import SignalsGuard
from bufferstand.daq.guards.margin import Margin, Peaks
from bufferstand.daq.guards.panel import GuardPanel, GuardSet
from bufferstand.daq.guards.sights import Computer
from bufferstand.daq.scaling import ScaledBlock, scale
from bufferstand.drivers.interfaces import MotionState, SampleBlock, StreamFacts
from bufferstand.foundation.channels.calibration import Calibration
from bufferstand.foundation.channels.channel import Channel, Plausibility
from bufferstand.foundation.errors import BadInput
from bufferstand.protocols.campaign_file.guard_table import GuardActions, GuardTable
from bufferstand.protocols.campaign_file.schema import CampaignFile
from bufferstand.recording.runfile.file import open_run
from tests.bounds.files import Files, base_campaign
from tests.daq.cases import HARMONIC, ListRecorder
from tests.daq.test_guard_table import STATUS, jumping, panel, reading, samples
from tests.daq.test_runner import Case
from tests.house.house_page import example_of, source_of
from tests.monitor.test_publisher import Connecting

DOCS = Path(__file__).parents[2] / "docs"
NO_GUARDS = {"`anew`", "`outage`", "any of a device", "`operator`"}
"""Rows of the docs' table that are no guard's: what says them is not asked in every pass."""
NOT_OF_GUARDS = {"guards.zero_force_max_kN"}
"""Keys of ``[guards]`` that the look before a start goes by."""


def everything() -> GuardPanel:
    """Return a panel that has a guard of every kind."""
    guards = panel().guards
    return GuardPanel(GuardSet(guards, SignalsGuard()), wall_s=0.0)


def pulling() -> ScaledBlock:
    """Return samples of a piston that begins to press, and of a force with the wrong sign."""
    told = np.linspace(0.0, 3.0, 400)
    values = dict.fromkeys(("command", "position", "stroke_1", "stroke_2", "stroke"), told)
    time_us = (1 + np.arange(400, dtype=np.int64)) * 1000
    return ScaledBlock("controller", 1, time_us, values | {"force": np.where(told > 1.5, -8.0, 0.0)}, 0, 0.4)


def at_its_end(watched: GuardPanel) -> None:
    ends = Plausibility(counts=(-5000, 60000))
    channel = Channel(
        name="force",
        quantity="force",
        unit="kN",
        calibration=Calibration(coefficients=(0.0, 0.001)),
        plausible=ends,
    )
    facts = StreamFacts("controller", "device", (channel,), 1000.0, "test")
    time_us = np.arange(100, dtype=np.int64) * 1000
    raw = SampleBlock("controller", 0, time_us, {"force": np.full(100, 60000)}, 0, 0.1)
    watched.observe(scale(raw, facts), 0.1, raw, facts)


def disagreeing(watched: GuardPanel) -> None:
    for second in range(40):
        for stream, name, value in (("controller", "force", 0.0), ("amplifier", "force_2", 9.0)):
            values = {name: np.array([value])}
            watched.observe(
                ScaledBlock(stream, second, np.array([second * 1_000_000]), values, 0, float(second)), 0.0
            )


def late(watched: GuardPanel) -> None:
    for tenth in range(110):
        watched.judge(replace(STATUS, heartbeat=tenth), tenth / 10, tenth / 10, age_s=0.5, up_to_date=False)


def paused(watched: GuardPanel) -> None:
    for at_s in (0.0, 1.5):
        watched.listen(at_s, at_s, Computer(1000.0 + at_s, at_s, guarded=True))


def off_by_far(watched: GuardPanel) -> None:
    for tenth in range(15):
        watched.judge(
            replace(STATUS, heartbeat=tenth, force_kN=300.0), tenth / 10, tenth / 10, sampled_kN=20.0
        )


def standing(watched: GuardPanel) -> None:
    for first, command in ((1, 3.0), (401, 6.5)):
        watched.observe(samples(first, at=0, command=command, force=50.0), 0.5)


def faulted(watched: GuardPanel) -> None:
    watched.judge(STATUS, 0.0, 0.0)
    watched.judge(replace(STATUS, heartbeat=2, state=MotionState.FAULT, fault_code=4), 0.1, 0.1)


def jumped(watched: GuardPanel) -> None:
    watched.observe(samples(), 0.5)
    watched.observe(jumping(samples(401), 500_000), 0.5)


def warming(watched: GuardPanel) -> None:
    for second in range(12):
        watched.observe(reading(20.0 + 0.5 * second, second, at_s=float(second)), 0.5)


PROVOKED: dict[str, tuple[str, Callable[[GuardPanel], object]]] = {
    "agreement": ("agreement", disagreeing),
    "channels": (
        "following error",
        lambda watched: watched.observe(samples(count=600, following_error=11.0), 0.5),
    ),
    "computer clock": ("pause", paused),
    "controller": ("controller", faulted),
    "device clock": ("clock", jumped),
    "disk_stop_s": (
        "recorder",
        lambda watched: watched.look_at_recorder(ListRecorder(failure=OSError("gone")), 0.0),
    ),
    "frozen": ("frozen force", standing),
    "heating": ("heating of temperature_1", warming),
    "lag": ("lag", late),
    "missed": (
        "missed cycles",
        lambda watched: watched.observe(replace(samples(lost=100), missed=100), 0.5),
    ),
    "plausibility": ("plausibility of force", at_its_end),
    "silences": ("silence of amplifier", lambda watched: watched.listen(6.0, 6.0)),
    "speeds": ("speed", lambda watched: watched.observe(samples(stroke=30.0), 0.5)),
    "status force": ("status force", off_by_far),
    "temperatures": ("temperature_1", lambda watched: watched.observe(reading(40.0, 1), 0.5)),
    "wiring": ("wiring of force", lambda watched: watched.observe(pulling(), 0.4)),
}
"""What makes a guard of each kind trip, and the name that its trip has."""


def docs_rows() -> dict[str, str]:
    """Return the first cells of the docs' table of guards, and their rows."""
    text = (DOCS / "guards-and-safe-stop.md").read_text("utf-8")
    table = text.split("## The guards", 1)[1].split("\n### ", 1)[0]
    rows = [row for row in table.splitlines() if row.startswith("| ") and not row.startswith("| guard |")]
    return {row.split(" | ")[0].removeprefix("| "): row for row in rows}


# --- the walk ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", kinds(), ids=lambda kind: kind.kind)
def test_every_kind_keeps_its_contract(kind: Kind) -> None:
    watched = everything()
    own = watched.guards.of(kind)
    assert own, "the panel of everything has none of it"
    assert len(kind.title) > 10
    assert (kind.kind in watched.guards.as_dict()) is (kind.facts_as != "none")
    margins = {margin.name for margin in watched.margins(0.5)}
    for guard in own:
        margin = guard.margin(guard.begin(0.0), watched)
        assert margin.name in margins
        assert margin.label
        assert margin.text
        assert margin.share is None or 0.0 <= margin.share < 1.0, "nothing has happened yet"
    assert kind.docs, "no row of the docs' table is named"
    assert set(kind.docs) <= docs_rows().keys()


@pytest.mark.parametrize("kind", kinds(), ids=lambda kind: kind.kind)
def test_every_kind_trips_by_what_it_watches(kind: Kind) -> None:
    name, provoke = PROVOKED[kind.kind]
    watched = everything()
    provoke(watched)
    trips = [trip for trip in watched.said() if trip.guard == name]
    assert trips, f"{kind.title}: not said"
    assert len(trips[0].reason) > 20
    alone = GuardPanel(GuardSet(one for one in watched.guards if type(one) is not kind), wall_s=0.0)
    if not kind.standing:
        provoke(alone)
        assert name not in {trip.guard for trip in alone.said()}, "another guard says it as well"


def test_every_row_of_the_docs_is_a_guards_or_says_why_not() -> None:
    named = {row for kind in kinds() for row in kind.docs}
    assert docs_rows().keys() - named == NO_GUARDS


def test_every_setting_of_guards_is_one_guards() -> None:
    named = [key for kind in kinds() if not isinstance(kind.settings, type) for key in kind.settings]
    for key in named:
        schema: Any = CampaignFile
        for part in key.split("."):
            schema = schema.model_fields[part].annotation
    assert len(named) == len(set(named))
    keys = {f"guards.{name}" for name in GuardTable.model_fields if name != "action"}
    keys |= {f"guards.action.{name}" for name in GuardActions.model_fields}
    assert keys - set(named) == NOT_OF_GUARDS


def test_every_setting_of_guards_stands_in_the_docs() -> None:
    pages = (DOCS / name for name in ("guards-and-safe-stop.md", "keys.md"))
    text = "\n".join(page.read_text("utf-8") for page in pages)
    keys = (GuardTable.model_fields.keys() | GuardActions.model_fields.keys()) - {"action"}
    assert {key for key in keys if f"`{key}`" not in text} == set()


def nothing(*_: object) -> tuple[()]:
    """Stand for a method that nobody calls."""
    return ()


WHOLE: dict[str, Any] = {
    "kind": "x",
    "title": "x",
    "settings": (),
    "facts_as": "none",
    "looks_at": (),
    "made_for": nothing,
    "look": nothing,
    "margin": nothing,
}


@pytest.mark.parametrize("left_out", WHOLE)
def test_a_kind_that_leaves_something_out_fails_at_import_by_name(left_out: str) -> None:
    type("Whole", (Guard,), dict(WHOLE))
    with pytest.raises(TypeError, match=rf"Lacking does not state its {left_out}"):
        type("Lacking", (Guard,), {name: value for name, value in WHOLE.items() if name != left_out})


def test_two_guards_of_one_name_are_refused() -> None:
    force = ChannelGuard("force", "force", 600.0, -10.0, "kN", "force")
    with pytest.raises(ValueError, match="more than one guard of the same name"):
        GuardSet(force, replace(force, upper=500.0))


# --- margins -----------------------------------------------------------------------------------------


def margin_of(watched: GuardPanel, name: str, wall_s: float = 0.5) -> Margin:
    (found,) = [margin for margin in watched.margins(wall_s) if margin.name == name]
    return found


@pytest.mark.parametrize(
    ("values", "share", "text"),
    [
        ([0.0, 300.0], 0.5, "300.0 of 600 kN, 300.0 left"),
        ([-40.0, 300.0], 0.8, "-40.0 of -50 kN, 10.0 left"),
        ([0.0, 612.0], 1.02, "612.0 of 600 kN, 0.0 left"),
    ],
)
def test_the_nearer_side_counts(values: list[float], share: float, text: str) -> None:
    guards = GuardSet(ChannelGuard("force", "force", 600.0, -50.0, "kN", "force"))
    watched = GuardPanel(guards, wall_s=0.0)
    watched.observe(
        ScaledBlock("controller", 1, np.array([1000, 2000]), {"force": np.array(values)}, 0, 0.0), 0.0
    )
    margin = margin_of(watched, "force")
    assert (margin.share, margin.text) == (pytest.approx(share), text)

    anew = Peaks().seen(30.0, 0.0, 500.0).seen(0.1, 0.0, 3.0)
    assert anew.span() == (0.0, 3.0), "another session: its clock begins anew"


def test_a_peak_is_shown_for_ten_seconds_and_then_forgotten() -> None:
    peaks = Peaks().seen(0.5, 0.0, 500.0).seen(0.7, -3.0, 10.0).seen(9.9, 0.0, 10.0)
    assert peaks.span() == (-3.0, 500.0)
    assert peaks.seen(10.2, 0.0, 11.0).span() == (0.0, 11.0)
    assert Peaks().seen(30.0, 0.0, 500.0).seen(0.1, 0.0, 3.0).span() == (0.0, 3.0), (
        "another session: its clock begins anew"
    )
    assert Peaks().span() is None


def test_margins_of_temperature_and_silence() -> None:
    watched = panel()
    watched.observe(reading(35.0, 1), 9.0)
    watched.observe(reading(20.0, 1, "temperature_3"), 6.0)
    watched.observe(samples(), 9.5)
    found = {margin.name: margin for margin in watched.margins(10.0)}
    assert found["temperature_1"].share == pytest.approx(0.75), "15 K of 20 K above the air"
    assert "5.0 left, 1 s old" in found["temperature_1"].text
    assert found["temperature_3"].share == pytest.approx(0.8), "only its silence counts"
    assert found["silence controller"].share == pytest.approx(0.25)


def test_the_speed_of_a_sine_is_its_amplitude_times_its_circular_frequency() -> None:
    time_us = np.arange(0, 500_000, 1000)
    stroke = 20.0 * np.sin(2.0 * np.pi * 2.0 * time_us / 1e6)
    watched = GuardPanel(GuardSet(SpeedGuard("speed", "stroke", 1000.0, "mm/s", "stroke")), wall_s=0.0)
    watched.observe(ScaledBlock("controller", 1, time_us, {"stroke": stroke}, 0, 0.5), 0.5)
    assert margin_of(watched, "speed").share == pytest.approx(2.0 * np.pi * 2.0 * 20.0 / 1000.0, rel=0.02)


def test_the_difference_of_both_forces_is_shown_as_the_guard_has_it() -> None:
    watched = GuardPanel(GuardSet(AgreementGuard(6.0), panel().guards.of(TemperatureGuard)), wall_s=0.0)
    disagreeing(watched)
    assert margin_of(watched, "agreement").text == "mean difference -9.00 of 6 kN"


# --- a new guard is one file ---------------------------------------------------------------------------


def code_of_docs() -> str:
    """Return the guard that the docs' page shows."""
    return example_of("add-a-guard.md", "python")


@pytest.fixture
def anew(monkeypatch: pytest.MonkeyPatch) -> Iterator[pytest.MonkeyPatch]:
    """Look for kinds anew, and once more when what was put there is gone."""
    before = set(sys.modules)
    kinds.cache_clear()
    yield monkeypatch
    monkeypatch.undo()
    for name in set(sys.modules) - before:
        if name.endswith("kinds.force_rate") or name.startswith("our_"):
            del sys.modules[name]
    kinds.cache_clear()


def beside(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Put the guard beside the others, in a folder of its own."""
    file = Path(source_of("Add a guard", "force_rate"))
    (folder / file.name).write_text(code_of_docs(), "utf-8")
    package: ModuleType = importlib.import_module(".".join(("bufferstand", *file.parent.parts)))
    patch.setattr(package, "__path__", [*package.__path__, str(folder)])


def installed(folder: Path, patch: pytest.MonkeyPatch, code: str | None = None) -> None:
    """Put the guard into a package of a laboratory's own, as an installer leaves it."""
    (folder / "our_guards.py").write_text(code_of_docs() if code is None else code, "utf-8")
    facts = folder / "our_guards-1.0.dist-info"
    facts.mkdir()
    (facts / "METADATA").write_text("Metadata-Version: 2.1\nName: our-guards\nVersion: 1.0\n", "utf-8")
    (facts / "entry_points.txt").write_text(f"[{GROUP}]\nforce_rate = our_guards:ForceRateGuard\n", "utf-8")
    patch.syspath_prepend(folder)
    importlib.invalidate_caches()


@pytest.mark.parametrize("put", [beside, installed])
def test_a_new_guard_stops_a_campaign_is_on_the_page_and_in_the_run_file(
    tmp_path: Path, anew: pytest.MonkeyPatch, put: Callable[[Path, pytest.MonkeyPatch], None]
) -> None:
    folder = tmp_path / "ours"
    folder.mkdir()
    put(folder, anew)
    case = Case(tmp_path, HARMONIC, limits="\n[guards.force_rate]\nmost_kN_per_s = 50.0")
    case.shown = shown = Connecting(case.out, 1, True)
    outcome = case.run()
    shown.read()
    assert (outcome.status, outcome.exit_status) == ("stopped", 3)
    assert re.fullmatch(r"the force changes by \d+ kN/s, faster than 50", outcome.reason)
    run = open_run(outcome.runs[0])
    assert run.metadata["limits"]["guards"]["force_rate"] == {"most_kN_per_s": 50.0}
    (trip,) = [event for event in run.events if event.kind == "trip"]
    assert (trip.data["guard"], trip.data["unit"]) == ("force rate", "kN/s")
    margins = [one for packet in shown.packets for one in packet.get("margins", [])]
    ours = [margin for margin in margins if margin["name"] == "force rate"]
    assert ours
    assert ours[-1].keys() == {"name", "label", "text", "share", "action"}
    assert ours[-1]["action"] == "stop"


def test_a_guard_that_nobody_asks_for_stays_out_of_the_way(tmp_path: Path, anew: pytest.MonkeyPatch) -> None:
    installed(tmp_path, anew)
    outcome = Case(tmp_path / "case").run()
    assert outcome.status == "complete", outcome.reason


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"force_rate": {"most_kN_per_s": "many"}}, r"line \d+: guards\.force_rate\.most_kN_per_s"),
        ({"force_rate": {"most_kN": 3.0}}, r"guards\.force_rate.*most_kN"),
        ({"force_rates": {}}, r"no guard is called “force_rates”; did you mean “force_rate”\?"),
        ({"pressure": {}}, r"no guard is called “pressure”; remove it, or install the package"),
    ],
)
def test_a_table_that_no_guard_takes_is_refused_with_its_line(
    tmp_path: Path, anew: pytest.MonkeyPatch, table: dict[str, Any], said: str
) -> None:
    installed(tmp_path, anew)
    with pytest.raises(BadInput, match=said):
        Files(tmp_path).prepare(campaign=base_campaign() | {"guards": table})


def test_its_own_table_is_taken(tmp_path: Path, anew: pytest.MonkeyPatch) -> None:
    installed(tmp_path, anew)
    prepared = Files(tmp_path).prepare(
        campaign=base_campaign() | {"guards": {"force_rate": {"most_kN_per_s": 400.0}, "lag_stop_s": 5.0}}
    )
    table = prepared.campaign.content.guards
    assert (table.lag_stop_s, dict(table.own)) == (5.0, {"force_rate": {"most_kN_per_s": 400.0}})


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("raise OSError('gone')", r"guard “force_rate” of our-guards cannot be loaded: OSError\('gone'\)"),
        ("ForceRateGuard = 3", "guard “force_rate” of our-guards is no kind of guard"),
    ],
)
def test_a_package_whose_guard_cannot_be_had_refuses_every_start(
    tmp_path: Path, anew: pytest.MonkeyPatch, code: str, said: str
) -> None:
    installed(tmp_path, anew, code)
    with pytest.raises(BadInput, match=said):
        Files(tmp_path).prepare()


def test_a_table_cannot_have_the_name_of_a_key(tmp_path: Path, anew: pytest.MonkeyPatch) -> None:
    installed(tmp_path, anew, code_of_docs().replace('"force_rate"', '"lag_stop_s"'))
    with pytest.raises(TypeError, match="has a key lag_stop_s already"):
        kinds()
