"""The study itself: ten thousand imperfect records by `pytest --long`."""

from __future__ import annotations

import pytest

from . import study

RECORDS, JOBS = 10_000, 2


@pytest.mark.long
def test_ten_thousand_imperfect_records() -> None:
    judgements = study.many(range(RECORDS), JOBS)
    false = [f"{j.number}: {f}" for j in judgements for f in j.findings if f[0] in study.FALSE]
    unnamed = [f"{j.number}: {f}" for j in judgements for f in j.findings if f[0] == "unnamed"]
    print(study.tables(judgements))
    assert not false
    assert not unnamed
    for name, (count, within, _) in study.coverage(judgements).items():
        slack = 2.0 * (100.0 * 0.95 * 0.05 / count) ** 0.5 * 10.0**0.5 if count else 0.0
        assert 93.0 - slack <= within <= 97.0 + slack, name
