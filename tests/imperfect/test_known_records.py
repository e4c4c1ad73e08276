"""Records of earlier studies that had a falsehood, each with what was wrong; they always run."""

from __future__ import annotations

import pytest

from . import study

KNOWN = [
    pytest.param(700558, None, id="a wire slips where the stroke has blanks: forces at wrong places failed"),
    pytest.param(700534, None, id="a wire slips as fast as the motion in a log by event: not named"),
    pytest.param(1100134, None, id="a wire slips on a way in, logged at a fifth of the rate: not named"),
    pytest.param(1100244, None, id="a stroke freezes, and comes back without a jump: a dwell failed"),
    pytest.param(1100245, None, id="a wire slips beside three error codes, which are larger: not named"),
    pytest.param(671346, None, id="a late force shows first contact too high: a residual stroke passed"),
    pytest.param(671434, None, id="hum folded to 2.8 Hz, no accuracy stated: a preload failed"),
    pytest.param(1100061, None, id="a zero that is off in a stroke written in metres: not named"),
    pytest.param(1100358, None, id="a force freezes over five samples of 35 a cycle: not named"),
    pytest.param(1100405, None, id="four cycles amid coloured noise: a drift that is none"),
    pytest.param(1100432, None, id="a damper's ends with rounded stamps and steps: a drift that is none"),
    pytest.param(1100437, None, id="a force zero that was off before the motion began: a jump that is none"),
    pytest.param(1100487, None, id="coloured noise of the stroke at a hold: 33 strokes of one"),
    pytest.param(1400060, None, id="two spikes in a row on either side of the stroke: two strokes of one"),
    pytest.param(1400626, None, id="newtons in a proof load of seven samples: passed"),
    pytest.param(1500099, None, id="a force jumps in a log by event, taken for a gap: a stroke failed"),
    pytest.param(1063052, "zero-off", id="noise hides a preload and a zero that is 2 mm off: forces passed"),
]


@pytest.mark.parametrize(("number", "only"), KNOWN)
def test_a_record_that_had_a_false_verdict_has_none_any_more(number: int, only: str | None) -> None:
    judgement = study.one(number, only)
    assert judgement.kinds, "the record has no fault any more: the generator draws another one"
    assert judgement.falsehoods == []
