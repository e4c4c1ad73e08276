"""The public records, where they are (``BUFFERSTAND_PUBLIC_RECORDS``): evaluated, or refused for a reason."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
import pytest

from tests.public_records.independent import area_between
from tests.public_records.sources import every_record
from tests.public_records.study import evaluate

ROOT = os.environ.get("BUFFERSTAND_PUBLIC_RECORDS", "")
RECORDS = list(every_record(Path(ROOT))) if ROOT else []
NOT_HERE = "PUBLIC RECORDS NOT HERE: docs/public-records.md says how to get them"


def test_the_independent_area_is_that_of_an_ellipse() -> None:
    time_s = np.arange(4001) / 1000.0
    stroke, force = -10.0 * np.cos(np.pi * time_s), 50.0 * np.sin(np.pi * time_s)
    assert area_between(time_s, stroke, force, 0.3, 2.3) == pytest.approx(500.0 * np.pi, rel=1e-5)


@pytest.mark.long
@pytest.mark.skipif(not RECORDS, reason=NOT_HERE)
def test_each_is_evaluated_or_refused_for_a_reason() -> None:
    results = [evaluate(record) for record in RECORDS]
    assert all(result.text for result in results)
    compared = {r.record.name: r.worst for r in results if r.worst is not None}
    assert {name: worst for name, worst in compared.items() if worst > 0.005} == {}
    # 17 have no cycle that can be evaluated, and say why: pulled and held, or a handful of samples a cycle.
    assert sum(1 for r in results if not r.complete) <= 17


@pytest.mark.long
@pytest.mark.skipif(not RECORDS, reason=NOT_HERE)
def test_friction_that_rings_and_chatters_is_not_taken_for_a_fault_of_the_amplifier() -> None:
    warnings = [
        (r.record.name, text) for r in (evaluate(record) for record in RECORDS) for text in r.warnings
    ]
    # The timber of trial2 cracks: its force falls by 4.6 kN from one sample to the next, and stays there. The
    # digitised damper leaps at its end, which its owner's script cuts off.
    leaps = {"test/trial2.csv", "examples/02 Basic Usage/2.4 Seismic Damper 2/Hys1.csv"}
    assert {name for name, text in warnings if text.startswith("force jumps by")} <= leaps
    assert len({name for name, text in warnings if re.match(r"(force|stroke): a? ?spike", text)}) <= 2
    assert not [text for _, text in warnings if "wrong sign" in text or "wrong unit" in text]
