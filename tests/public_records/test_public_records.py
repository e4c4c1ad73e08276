"""The public records, where they are (``BUFFERSTAND_PUBLIC_RECORDS``): evaluated, or refused for a reason."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from tests.public_records.independent import area_between
from tests.public_records.sources import every_record
from tests.public_records.study import evaluate

ROOT = os.environ.get("BUFFERSTAND_PUBLIC_RECORDS", "")
RECORDS = every_record(Path(ROOT)) if ROOT else []


def test_the_independent_area_is_that_of_an_ellipse() -> None:
    time_s = np.arange(4001) / 1000.0
    stroke, force = -10.0 * np.cos(np.pi * time_s), 50.0 * np.sin(np.pi * time_s)
    assert area_between(time_s, stroke, force, 0.3, 2.3) == pytest.approx(500.0 * np.pi, rel=1e-5)


@pytest.mark.long
@pytest.mark.skipif(
    not RECORDS, reason="PUBLIC RECORDS NOT HERE: docs/public-records.md says how to get them"
)
def test_each_is_evaluated_or_refused_for_a_reason() -> None:
    results = [evaluate(record) for record in RECORDS]
    assert all(result.text for result in results)
    compared = {r.record.name: r.worst for r in results if r.worst is not None}
    assert {name: worst for name, worst in compared.items() if worst > 0.005} == {}
    assert sum(1 for r in results if r.complete) >= 0.9 * len(results)
