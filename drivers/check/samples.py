"""The samples of a controller during a check: rate, losses, missed cycles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from bufferstand.drivers.check.clock import LEAST_PAIRS
from bufferstand.drivers.check.rows import CheckRow, rate_row
from bufferstand.drivers.check.verdict import Verdict
from bufferstand.drivers.delivery_rate import LEFT_OUT_SHARE, Delivery, PollDelivery
from bufferstand.drivers.interfaces import Controller, SampleBlock
from bufferstand.foundation import MISSED_CYCLES_MAX_PER_MIN, Clock

RATE_TOLERANCE = 0.02
"""Share by which the rate of a ring may differ from that stated."""
SURE = 2.0
"""A rate of missed cycles is sure to be over the limit by so many standard deviations of counting."""
POLL_S = 0.01
"""From one look to the next [s]."""
_BLOCKS_AT_ONCE = 50
_LEAST_SAMPLES = 100
_MINUTE_S = 60.0


@dataclass
class WatchedSamples:
    """What came of a controller while it was watched; counted from when the ring's history was read."""

    newest: SampleBlock | None
    samples: int = 0
    """Samples that came, or should have: those that are lost among them."""
    lost: int = 0
    missed: int = 0
    """Those of ``lost`` that the controller never took."""
    missed_at: list[tuple[int, int]] = field(default_factory=list)
    """Time stamp [µs] behind each hole of missed cycles, and how many were missed there."""
    since_s: float | None = None
    late_s: tuple[float, float] = (0.0, 0.0)
    """By how much what was received at the beginning and the end may be older than its reception [s]."""
    host_s: list[float] = field(default_factory=list)
    trip_s: list[float] = field(default_factory=list)
    tick_us: list[int] = field(default_factory=list)

    @property
    def span_s(self) -> float:
        """Time over which samples were counted [s]."""
        if self.since_s is None or self.newest is None:
            return 0.0
        return self.newest.received_s - self.since_s


def watch(
    controller: Controller, clock: Clock, newest: SampleBlock | None, watch_s: float, *, samples: bool = True
) -> WatchedSamples:
    """Read samples and clock of a controller for a while, and at least :data:`LEAST_PAIRS` times.

    Parameters
    ----------
    controller : Controller
        Connected.
    clock : Clock
        Stand and wall time.
    newest : SampleBlock or None
        The last block that was read before.
    watch_s : float
        For so long [s of wall time].
    samples : bool
        Whether samples are read, too: what is read is acknowledged.
    """
    seen = WatchedSamples(newest)
    end_s, rounds = clock.wall_s() + watch_s, 0
    while clock.wall_s() < end_s or rounds < LEAST_PAIRS:
        rounds += 1
        asked_s = clock.wall_s()
        status = controller.status()
        answered_s = clock.wall_s()
        if status.tick_us is not None:
            seen.host_s.append(0.5 * (asked_s + answered_s))
            seen.trip_s.append(answered_s - asked_s)
            seen.tick_us.append(status.tick_us)
        if samples:
            _read_blocks(controller, clock, seen)
        clock.sleep(POLL_S)
    return seen


def _read_blocks(controller: Controller, clock: Clock, seen: WatchedSamples) -> None:
    """Read until there are no more samples, or for a number of blocks."""
    ahead_s: float | None = None  # a block that has more behind it may have asked for that already
    for _ in range(_BLOCKS_AT_ONCE):
        request_s = clock.now_s()
        block = controller.read_block()
        if block is not None:
            seen.newest = block
            late_s = block.received_s - (request_s if ahead_s is None else ahead_s)
            seen.late_s = (late_s if seen.since_s is None else seen.late_s[0], late_s)
            ahead_s = request_s if block.more else None
            if seen.since_s is not None:
                seen.samples += len(block.time_us) + block.lost
                seen.lost += block.lost
                seen.missed += block.missed
                if block.missed:
                    seen.missed_at.append((int(block.time_us[0]), block.missed))
        if block is None or not block.more:
            if seen.since_s is None and seen.newest is not None:
                seen.since_s = seen.newest.received_s
            return


def sample_rate_row(seen: WatchedSamples, stated_Hz: float, *, polled: bool) -> CheckRow:
    """Return how many samples a second come; of a ring with a long history that may not be known yet."""
    span_s = seen.span_s
    if span_s * stated_Hz < _LEAST_SAMPLES:
        remark = "its ring held more than could be read meanwhile; watch it longer (--watch)"
        if polled:
            remark = "too few polls to tell; watch it longer (--watch)"
        return CheckRow("controller", "sample rate", "—", Verdict.NOTE, remark)
    doubt = sum(seen.late_s) / span_s  # a busy computer receives late what was made in time
    if polled:
        return _poll_rate_row(seen, stated_Hz, doubt)
    rate_Hz, lost = seen.samples / span_s, seen.lost - seen.missed
    return rate_row("controller", "sample rate", rate_Hz, stated_Hz, lost, tolerance=RATE_TOLERANCE + doubt)


def _poll_rate_row(seen: WatchedSamples, stated_Hz: float, doubt: float) -> CheckRow:
    """Return in how many periods there was a sample: the computer makes this rate, and leaves some out."""
    rows, periods = seen.samples - seen.lost, seen.span_s * stated_Hz
    rate_Hz, left_out = rows / seen.span_s, max(1.0 - rows / periods, 0.0)
    text = f"{rate_Hz:.4g} Hz of {stated_Hz:.4g}"
    figures = {"rate_Hz": rate_Hz, "lost": float(seen.lost), "without_sample": max(periods - rows, 0.0)}
    row = CheckRow("controller", "sample rate", text, figures=figures)
    if left_out <= RATE_TOLERANCE + doubt and not seen.lost:
        return row
    remark = (
        f"{100.0 * left_out:.0f} % of the periods have no sample: polls came too late, or their reads too "
        "far apart; line or computer are busy"
    )
    if left_out <= LEFT_OUT_SHARE + doubt:
        return replace(row, verdict=Verdict.NOTE, remark=remark)
    remark = f"{remark}; state a lower rate_Hz in [poll], or read all channels in one read"
    return replace(row, verdict=Verdict.FAULT, remark=remark)


def missed_row(seen: WatchedSamples) -> CheckRow | None:
    """Return how many cycles the controller missed, judged as a campaign's guard does; None if none.

    The guard stops where a minute has more than ``[guards] missed_cycles_max_per_min``. What was seen for
    a shorter time is a fault where it is sure to come to that: holes are counted as independent events.
    """
    if not seen.missed:
        return None
    span_s = max(seen.span_s, 1e-9)
    a_minute = seen.missed * _MINUTE_S / span_s
    cycles = "cycle" if seen.missed == 1 else "cycles"
    text = f"{seen.missed} {cycles} in {span_s:.1f} s, {a_minute:.0f} a minute"
    figures = {"missed": float(seen.missed), "missed_per_min": a_minute}
    what = "its clock went on without a sample: these are counted gaps"
    most = MISSED_CYCLES_MAX_PER_MIN
    rule = f"a campaign stops at more than {most} a minute ([guards] missed_cycles_max_per_min)"
    sure = a_minute * (1.0 - SURE / math.sqrt(len(seen.missed_at))) > most
    if _most_in_a_minute(seen.missed_at) > most or sure:
        remark = f"{what}; {rule}: look at the load of its loop"
        return CheckRow("controller", "missed cycles", text, Verdict.FAULT, remark, figures=figures)
    longer = ", watch it for a minute (--watch 60)" if a_minute > most else ""
    remark = f"{what}; {rule}{longer}"
    return CheckRow("controller", "missed cycles", text, Verdict.NOTE, remark, figures=figures)


def _most_in_a_minute(missed_at: Sequence[tuple[int, int]]) -> int:
    """Return the greatest number of cycles that were missed within a minute of the controller's clock."""
    most = within = oldest = 0
    for at_us, cycles in missed_at:
        within += cycles
        while at_us - missed_at[oldest][0] >= _MINUTE_S * 1e6:
            within -= missed_at[oldest][1]
            oldest += 1
        most = max(most, within)
    return most


def delivery_row(delivery: Delivery | PollDelivery) -> CheckRow:
    """Return whether the reader can keep up with the controller, or with the rate that it polls at."""
    if isinstance(delivery, PollDelivery):
        figures = {
            "poll_ms": delivery.poll_s * 1e3,
            "reads_per_poll": float(delivery.reads),
            "most_Hz": delivery.most_Hz,
        }
    else:
        figures = {
            "block_round_trip_ms": delivery.round_trip_s * 1e3,
            "samples_per_block": float(delivery.samples_per_block),
            "most_Hz": delivery.most_Hz,
            "longest_round_trip_ms": delivery.longest_trip_s * 1e3,
        }
    verdict = Verdict.FAULT if not delivery.keeps_up else Verdict.NOTE if delivery.remark else Verdict.OK
    value, _, remark = delivery.text.partition("; ")
    return CheckRow("controller", "keeping up", value, verdict, remark, figures=figures)
