"""What judges a soak sees growth, and a small dose of both soaks works."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from benchmarks.common import NotHere
from benchmarks.common.processes import forget_peak, holds, peak_MB
from tests.soak.__main__ import main
from tests.soak.curves import Curves
from tests.soak.real import LIMITS as REAL
from tests.soak.virtual import LIMITS

CAMPAIGN = """
[campaign]
id = "short"
title = "One stroke, over and over"
stand = "{samples}/stand.toml"
specimen = "{samples}/specimens/category-a-elastomer.toml"

[conditions]
ambient_C = 21.0

[limits]
force_max_kN = 600.0
frequency_max_Hz = 2.55
temperature_stop_C = 40.0

[[step]]
kind = "harmonic"
name = "two cycles"
prestress_mm = 20.0
amplitude_mm = 5.0
frequency_Hz = 2.0
cycles = 2
"""
SAMPLES = Path(__file__).resolve().parents[2] / "sample_runs"


def looks(*values: float, name: str = "memory_MB") -> Curves:
    curves = Curves()
    for number, value in enumerate(values):
        curves.add(float(number), {name: value})
    return curves


def test_what_settles_in_the_first_quarter_is_flat() -> None:
    assert looks(50.0, 90.0, 100.0, 101.0, 99.0, 100.0, 101.0, 100.0).grown({"memory_MB": 1.05}) == []


def test_a_leak_is_seen_however_slow_its_looks_are() -> None:
    (said,) = looks(*(100.0 + look for look in range(40))).grown({"memory_MB": 1.05})
    assert said == "memory_MB grew from 114.5 to 134.5; at most 1.05 times as much is flat"


def test_one_handle_more_is_growth_and_none_of_what_never_was_is_not() -> None:
    assert looks(9, 9, 9, 9, 9, 9, 10, 10, name="handles").grown({"handles": 1.0})
    assert not looks(0, 0, 0, 0, name="temporary_files").grown({"temporary_files": 1.0})
    assert looks(0, 0, 0, 1, name="temporary_files").grown({"temporary_files": 1.0})


def test_every_look_is_at_the_same_quantities() -> None:
    curves = looks(1.0)
    with pytest.raises(ValueError, match=r"a look at \['handles'\], the first one was at \['memory_MB'\]"):
        curves.add(1.0, {"handles": 1.0})


def test_curves_are_kept_and_drawn(tmp_path: Path) -> None:
    curves = looks(1.0, 2.0, 3.0, 4.0)
    curves.save(tmp_path / "curves.json")
    curves.draw(tmp_path / "curves.png")
    assert Curves.load(tmp_path / "curves.json") == curves
    assert (tmp_path / "curves.png").read_bytes().startswith(b"\x89PNG")
    assert "| memory MB | 1 | 2 | 4 | 4 | 2.000 | 1.5 |" in curves.table({"memory_MB": 1.5})


def test_handles_threads_and_children_are_counted() -> None:
    before = holds(os.getpid())
    ends = os.pipe()
    go_on = threading.Event()
    thread = threading.Thread(target=go_on.wait)
    thread.start()
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    try:
        now = holds(os.getpid())
    finally:
        child.communicate(b"\n")
        go_on.set()
        thread.join()
        for end in ends:
            os.close(end)
    assert now["processes"] == before["processes"] + 1
    assert now["threads"] >= before["threads"] + 2
    assert now["handles"] >= before["handles"] + 3


def test_a_process_that_has_ended_holds_nothing() -> None:
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    assert holds(child.pid)["processes"] == 0.0


def test_the_greatest_memory_is_that_since_it_was_forgotten() -> None:
    forget_peak()
    before = peak_MB()
    held = bytearray(80 * 2**20)
    held[::4096] = b"x" * len(held[::4096])
    assert peak_MB() >= before + 70.0
    del held
    forget_peak()
    assert peak_MB() < before + 40.0


@pytest.mark.slow
def test_campaigns_in_one_process_leave_no_handle_and_no_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    campaign = tmp_path / "short.toml"
    campaign.write_text(CAMPAIGN.format(samples=SAMPLES), encoding="utf-8")
    kept = tmp_path / "curves.json"
    main(["virtual", "--hours", "0.02", "--campaign", str(campaign), "--curves", str(kept)])
    curves = Curves.load(kept)
    assert len(curves.at_h) >= 2, "the same process ran it again"
    # Memory settles over many campaigns: what a few of them leave says nothing.
    exact = {name: limit for name, limit in LIMITS.items() if not name.endswith("_MB")}
    assert curves.grown(exact) == []
    assert set(LIMITS) <= set(curves.values)
    assert "| handles |" in capsys.readouterr().out


@pytest.mark.slow
def test_a_campaign_by_the_commands_is_looked_at_with_its_page(tmp_path: Path) -> None:
    kept = tmp_path / "curves.json"
    try:
        main(["real", "--hours", "0.001", "--look-s", "2", "--curves", str(kept)])
    except NotHere as missing:
        pytest.skip(f"THE SOAK WITH A PAGE IS NOT TRIED: {missing}")
    curves = Curves.load(kept)
    assert set(REAL) <= set(curves.values)
    assert min(min(looks) for name, looks in curves.values.items() if name in REAL) > 0.0


@pytest.mark.long
def test_a_day_of_campaigns_leaves_nothing() -> None:
    assert main(["virtual"]) == 0
