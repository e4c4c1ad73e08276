"""Each law is seen to fail in a world that breaks it, and to be kept in one that does not."""

from __future__ import annotations

import copy
import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bufferstand.daq.motions.safe_stop import SafeStop, SafeStopReport
from bufferstand.daq.operator.stop_request import StopLevel
from tests.worlds.apart import Result, live
from tests.worlds.computer import VirtualRecorder
from tests.worlds.laws import LAWS
from tests.worlds.life import Life, Lived
from tests.worlds.troubles import Trouble
from tests.worlds.world import World, draw

STEP = """
[[step]]
kind = "harmonic"
prestress_mm = 12.0
amplitude_mm = 5.0
frequency_Hz = 1.0
cycles = 3
"""
CLEAN = replace(
    draw(1),
    touch=False,
    tight=None,
    specimen="category-a-elastomer",
    steps=(STEP,),
    troubles=(),
    reports=True,
)
"""A world of one short step, in which nothing goes wrong."""
KILLED = replace(CLEAN, troubles=(Trouble("kill", "anywhere", 0, "motion", 1.5),), reports=False)
Alteration = Callable[[Lived], None]


# --- what is altered in what was lived ----------------------------------------------------------------


def _loses_the_file(lived: Lived) -> None:
    lived.runs.clear()


def _alters_a_count(lived: Lived) -> None:
    kept = lived.evidence[0].given["controller"][3][2]
    kept["force"] = kept["force"] + 1


def _spoils_a_file(lived: Lived) -> None:
    (path,) = (lived.out / "runs").glob("*.h5")
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content)


def _pushes_too_far(lived: Lived) -> None:
    lived.truth["force_kN"] = np.linspace(0.0, 700.0, lived.truth["force_kN"].size)


def _loads_after_the_end(lived: Lived) -> None:
    lived.truth["force_kN"][-500:] = 5.0
    lived.starts[-1].ended_s = lived.marks[-1][0] - 1.0


def _lets_the_second_in(lived: Lived) -> None:
    lived.starts[0].second = "it was let"


def _touches_a_complete_step(lived: Lived) -> None:
    again = copy.deepcopy(lived.starts[0])
    for step in again.complete.values():
        step["runs"] = [*step["runs"], "runs/001_part-2.h5"]
    lived.starts.append(again)


def _tells_of_more_energy(lived: Lived) -> None:
    assert lived.document is not None
    for cycle in lived.document["runs"][0]["cycles"]:
        cycle["absorbed_energy_J"] = 1.2 * (cycle["absorbed_energy_J"] or 0.0)


def _cannot_evaluate(lived: Lived) -> None:
    lived.evaluation_error = "ValueError('…')"


def _reports_another(lived: Lived) -> None:
    assert lived.report
    lived.report = lived.report.replace("A-105-E-01", "another")


def _stops_for_nothing(lived: Lived) -> None:
    lived.starts[0].status, lived.starts[0].reason = 3, "stopped by the operator: nobody"


def _names_another_cause(lived: Lived) -> None:
    lived.starts[0].struck.append((Trouble("disk", "full", 0, "", 1.0), "motion", 1.0))
    lived.starts[0].status, lived.starts[0].reason = 4, "temperature_1 has given no true reading"


def _has_a_bug(lived: Lived) -> None:
    trouble = Trouble("memory", "append", 0, "", 1.0)
    lived.starts[0].struck.append((trouble, "motion", 1.0))
    lived.starts[0].status, lived.starts[0].reason = 4, "internal error: MemoryError"
    lived.starts[0].error = "KeyError('force')"


ALTERATIONS: Mapping[str, tuple[Alteration, str]] = {
    one.__name__: (one, law)
    for one, law in (
        (_loses_the_file, "nothing_acknowledged_is_lost"),
        (_alters_a_count, "nothing_is_altered"),
        (_spoils_a_file, "every_file_is_whole"),
        (_pushes_too_far, "force_stays_explained"),
        (_loads_after_the_end, "every_end_comes_to_rest"),
        (_lets_the_second_in, "a_second_program_is_refused"),
        (_touches_a_complete_step, "resume_repeats_nothing"),
        (_tells_of_more_energy, "the_evaluation_tells_the_truth"),
        (_cannot_evaluate, "the_evaluation_tells_the_truth"),
        (_reports_another, "a_report_comes_out"),
        (_stops_for_nothing, "the_last_start_completes"),
        (_stops_for_nothing, "a_stop_names_its_cause"),
        (_names_another_cause, "a_stop_names_its_cause"),
        (_has_a_bug, "a_stop_names_its_cause"),
    )
}


def _broken_by_each(lived: Lived) -> Result:
    """Judge the world as it was, and after each alteration of a copy of it; the file is spoilt last."""
    found = [f"clean: {law.__name__}: {text}" for law in LAWS for text in law(lived)]
    order = sorted(ALTERATIONS, key=lambda name: name == "_spoils_a_file")
    for name in order:
        alter, _ = ALTERATIONS[name]
        changed = replace(
            lived,
            starts=copy.deepcopy(lived.starts),
            evidence=copy.deepcopy(lived.evidence),
            truth={key: values.copy() for key, values in lived.truth.items()},
            document=copy.deepcopy(lived.document),
            runs=dict(lived.runs),
        )
        alter(changed)
        found += [f"{name}: {law.__name__}" for law in LAWS for _ in law(changed)]
    return Result(lived.world.seed, found)


@pytest.fixture(scope="module")
def breaches() -> list[str]:
    return live(CLEAN, judge=_broken_by_each).broken


def test_a_world_without_trouble_keeps_every_law(breaches: list[str]) -> None:
    assert [text for text in breaches if text.startswith("clean")] == []


@pytest.mark.parametrize("name", ALTERATIONS)
def test_each_law_is_broken_by_what_breaks_it(breaches: list[str], name: str) -> None:
    assert f"{name}: {ALTERATIONS[name][1]}" in breaches


# --- what is broken in the program itself -------------------------------------------------------------


def _laws(result: Result) -> set[str]:
    return {text.partition(":")[0] for text in result.broken}


def drops_a_row(_: Life) -> None:
    """Let the recorder leave out one sample in the midst of a run."""
    real, blocks = VirtualRecorder._hand_over, iter(range(1_000_000))

    def hand_over(recorder: VirtualRecorder, item: Any) -> None:
        stream = getattr(item, "stream", "")
        if stream == "controller" and next(blocks) == 20:
            short = {name: values[:-1] for name, values in item.counts.items()}
            item = replace(item, time_us=item.time_us[:-1], counts=short)
        real(recorder, item)

    VirtualRecorder._hand_over = hand_over  # type: ignore[method-assign, assignment]


def _says_it_is_safe(stop: SafeStop, does: Callable[[Any], object]) -> None:
    def stops(own: Any, *_: Any) -> SafeStopReport:
        does(own)
        return SafeStopReport(True, "commands", None, 0.0, 0.0, "nobody", 0.0, (), "safe stop: force 0.0 kN")

    stop._stop = stops  # type: ignore[method-assign, assignment]


def leaves_the_valve_on(_: Life) -> None:
    """Let the safe stop do nothing, and say that it has."""
    _says_it_is_safe(SafeStop, lambda _: None)  # type: ignore[arg-type]


def cuts_the_load(life: Life) -> None:
    """Let the safe stop switch the valve off at once, and let it come amid the sine."""
    _says_it_is_safe(SafeStop, lambda own: own._controller.disable())  # type: ignore[arg-type]
    life.opened.clock.listen(
        lambda _: life.request.ask(StopLevel.NOW, "nobody") if life._true_force_kN() > 20.0 else None
    )


def loses_what_was_synced(life: Life) -> None:
    """Let a kill take most of the journal with it."""
    let_go = life.death.let_go

    def loses() -> None:
        let_go()
        for path in (life.lived.out / "runs").glob("*.journal"):
            os.truncate(path, 30_000)

    life.death.let_go = loses  # type: ignore[method-assign]


@pytest.mark.parametrize(
    ("world", "sabotage", "laws"),
    [
        (CLEAN, drops_a_row, {"nothing_acknowledged_is_lost", "nothing_is_altered"}),
        (CLEAN, leaves_the_valve_on, {"every_end_comes_to_rest"}),
        (CLEAN, cuts_the_load, {"valve_never_cuts_a_load", "a_stop_names_its_cause"}),
        (KILLED, loses_what_was_synced, {"nothing_acknowledged_is_lost"}),
    ],
)
def test_a_program_that_is_broken_breaks_the_law(
    world: World, sabotage: Callable[[Life], object], laws: set[str]
) -> None:
    assert laws <= _laws(live(replace(world, reports=False), sabotage=sabotage))


def test_a_program_that_is_killed_and_resumed_keeps_every_law() -> None:
    found = live(KILLED)
    assert found.broken == []
    assert found.starts == ["killed at anywhere", "0: "]
    assert found.acknowledged > 1000


def test_a_world_that_ends_without_a_word_is_a_failure() -> None:
    assert live(CLEAN, sabotage=lambda _: os._exit(1)).broken == [
        "the world’s process ended, or hung, without a word"
    ]


def test_a_traceback_in_a_world_is_a_failure() -> None:
    (text,) = live(CLEAN, sabotage=lambda _: np.zeros(0)[1]).broken
    assert "IndexError" in text
