"""A stand that its own controller moves, at the desk: served, checked, recorded, and found again."""

from __future__ import annotations

from pathlib import Path

from bufferstand.recording.runfile import open_run
from tests.desk.served import served
from tests.desk.tab import PHONE, WIDE, Tab
from tests.main_job.conftest import here
from tests.monitor.browser import chromium, demand_axe, faults


def test_it_is_served_checked_recorded_and_found(tmp_path: Path) -> None:
    assert here("init", tmp_path / "lab", "--yes", "--controller", "none").returncode == 0
    with chromium() as browser, served(tmp_path / "lab") as desk:
        with Tab(browser, desk.link, **WIDE) as it:
            it.go(f"{desk.origin}/check?stand=stand.toml")
            it.says("To record")
            assert it.tab.locator("#speed").count() == 0, "it moves by itself, in real time"
            it.tab.click("#twin-serve")
            it.has_said("The simulated stand can be asked.")
            it.tab.click("#check")
            it.has_said("The check found ")
            it.says("acquisition")
            it.tab.fill("#lasting", "")
            it.tab.click("#record")
            it.has_said("t was not said for how long")
            it.tab.fill("#lasting", "3s")
            it.tab.select_option("#recorded", index=1)
            it.tab.click("#record")
            it.has_said("Have the stand’s own controller run the test.")
            it.has_said("It is recorded: see Results or Archive.")
            (path,) = sorted((desk.folder / "recorded").glob("*.h5"))
            run = open_run(path)
            assert run.status == "complete"
            assert run.specimen["id"] == "A-0001"
            assert run.series("force").value.size > 1000
            it.go(f"{desk.origin}/archive")
            it.says(path.stem)
            it.go(f"{desk.origin}/check?stand=stand.toml")
            it.says("It is being served.")
            it.tab.click("#twin-end")
            it.has_said("The simulated stand has ended.")
            assert [one for one in it.complaints if "409" not in one] == [], "but the refusal"
        for options in (WIDE, PHONE):
            with Tab(browser, desk.link, bypass_csp=True, **options) as it:
                it.go(f"{desk.origin}/check?stand=stand.toml")
                it.says("To record")
                assert it.width() == options["viewport"]["width"]
                demand_axe()
                assert faults(it.tab) == []
