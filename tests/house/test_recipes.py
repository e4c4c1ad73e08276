"""What docs/house.md says of adding a limit set, a register map or a section, done with the files it names.

A quantity is added in tests/evaluation/test_catalogue.py, a guard in tests/daq/test_guard_catalogue.py.
"""

from __future__ import annotations

import importlib
import json
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner

from bufferstand.cli.main import bufferstand
from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.register_maps.profile import SHIPPED, load_profile
from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile, with_endpoints
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.report import build, sections
from bufferstand.evaluation.report.content.content import Content, Section, Sheet
from bufferstand.evaluation.report.source.reading import Given, read_source
from bufferstand.evaluation.report.writing import write_report
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import DeviceFault
from tests.contract.controller.backends import write_stand
from tests.house.house_page import ROOT, example_of, files_of, source_of

RUNS = ROOT / "sample_runs" / "runs"
RUN = RUNS / "005-harmonic-20mm-20mm-1.27Hz.h5"
SET, MAP, SECTION = "Add a limit set", "Add a register map", "Add a section to the report"


@pytest.mark.parametrize("heading", ["Add a quantity", "Add a guard", SET, SECTION, MAP])
def test_the_files_of_a_recipe_lie_in_folders_that_are_there(heading: str) -> None:
    for file in files_of(heading):
        place = ROOT / file
        if file.startswith("FOLDER/"):  # wherever its user likes
            continue
        assert place.parent.is_dir() if "NAME" in file else place.exists(), file


def test_code_has_one_file_of_source_and_a_test() -> None:
    for heading in ("Add a quantity", "Add a guard", SECTION):
        source, test, *pages = files_of(heading)
        assert source == source_of(heading, "NAME")
        assert test.startswith("tests/")
        assert all(page.startswith("docs/") for page in pages)


# --- a limit set: one file of settings --------------------------------------------------------------


def test_a_limit_set_is_one_file_that_evaluate_judges_by(tmp_path: Path) -> None:
    assert files_of(SET) == ["FOLDER/NAME.toml"]
    file = tmp_path / Path(source_of(SET, "our-buffers")).name
    file.write_text(example_of("add-a-limit-set.md", "toml"), encoding="utf-8")
    out = tmp_path / "evaluation.json"
    words = ["evaluate", RUN, "--limits", file, "--json", out, "--draws", 200]
    done = CliRunner().invoke(bufferstand, list(map(str, words)), catch_exceptions=False)
    assert done.exit_code == 0, done.output
    (entry,) = json.loads(out.read_text(encoding="utf-8"))["runs"]
    assert entry["limit_set"]["id"] == "our-buffers"
    assert [(row["id"], row["clause"], row["verdict"]) for row in entry["requirements"]] == [
        ("damping-at-1-3-hz", "4.2", "pass"),
        ("greatest-force", "4.3", "pass"),
    ]
    assert entry["verdict"] == "pass"
    assert "Test plan 7" in done.stdout


# --- a register map: one file of settings -----------------------------------------------------------


def _moved(line: re.Match[str]) -> str:
    """Return a register's place by our map: 1000 on, and those behind the force, of two words here, 1001."""
    address = int(line[1])
    return f"address = {address + 1000 + (111 <= address < 114)}"


def our_map() -> str:
    """Return a map with every register elsewhere, the other order of words and another scale of the force."""
    text = (SHIPPED / "polling.toml").read_text(encoding="utf-8")
    text = re.sub(r"^address = (\d+)$", _moved, text, flags=re.MULTILINE)
    for old, new in {'id = "bufferstand-polling"': 'id = "our-press"', '"little"': '"big"'}.items():
        assert old in text
        text = text.replace(old, new)
    example = example_of("add-a-register-map.md", "toml")
    (force,) = re.findall(r'\[\[register\]\]\nname = "force"\n.*', example, re.DOTALL)
    other, count = re.subn(
        r'\[\[register\]\]\nname = "force"\n.*?unit = "kN"\n', force, text, flags=re.DOTALL
    )
    assert count == 1
    return other


def test_a_register_map_is_one_file_that_a_stand_is_served_and_read_by(tmp_path: Path) -> None:
    assert files_of(MAP) == ["FOLDER/NAME.toml"]
    file = tmp_path / Path(source_of(MAP, "our-press")).name
    file.write_text(our_map(), encoding="utf-8")
    path = write_stand(tmp_path, {'profile = "ring"': f'profile = "{file.name}"'})
    stand, clock = load_stand(path), WallClock(2.0)
    assert (stand.profile().facts.id, stand.profile().facts.word_order) == ("our-press", "big")
    with start_process(path, directory=tmp_path / "run", speed=2.0) as process:
        served = with_endpoints(stand, process.served.endpoints())
        controller = build_controller(served, clock)
        try:
            controller.connect()
            status = controller.status()
            assert "our-press" in controller.facts.device
            assert status.force_kN == pytest.approx(0.0, abs=1.0)
            refuses_the_shipped_map(served)
        finally:
            controller.close()


def refuses_the_shipped_map(served: StandFile) -> None:
    """Show that what is served is the map of our own: by another one the driver finds no controller."""
    settings = served.controller.model_copy(update={"profile": "polling"})
    other = build_controller(served.model_copy(update={"controller": settings}), WallClock(2.0))
    assert load_profile("polling").facts.id != served.profile().facts.id
    try:
        with pytest.raises(DeviceFault):
            other.connect()
    finally:
        other.close()


# --- a section of the report: one file of source ----------------------------------------------------


@pytest.fixture
def beside(tmp_path: Path) -> Iterator[Callable[[str], None]]:
    """Put a file beside the sections, in a folder of its own, and begin anew with the report; undo it."""
    folder, name = tmp_path / "sections", Path(source_of(SECTION, "power"))
    folder.mkdir()
    assert (ROOT / name.parent).samefile(sections.__path__[0]), "the page names another folder"

    def put(text: str) -> None:
        (folder / name.name).write_text(text, encoding="utf-8")
        importlib.reload(build)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sections, "__path__", [*sections.__path__, str(folder)])
        yield put
    sys.modules.pop(f"{sections.__name__}.{name.stem}", None)
    importlib.reload(build)


def power() -> str:
    return example_of("add-a-report-section.md", "python")


def test_a_section_of_the_report_is_one_file(tmp_path: Path, beside: Callable[[str], None]) -> None:
    shipped = build.SECTIONS
    beside(power())
    (html,) = write_report(RUN, tmp_path / "out", formats=("html",))
    text = html.read_text(encoding="utf-8")
    order = re.findall(r'<section id="([\w-]+)"', text)
    assert order[order.index("runs") + 1] == "power"
    (shown,) = re.findall(r'<section id="power">.*?</section>', text, re.DOTALL)
    assert "Power turned into heat" in shown
    absorbed_J, frequency_Hz = 496.9, 1.2732
    (watts,) = (float(cell) for cell in re.findall(r"<td[^>]*>(\d{3}(?:\.\d+)?)</td>", shown))
    assert watts == pytest.approx(absorbed_J * frequency_Hz, rel=2e-3)
    assert [one.__name__ for one in build.SECTIONS if one.__name__ != "power_section"] == [
        one.__name__ for one in shipped
    ]


def test_a_section_that_has_nothing_to_say_is_not_there(beside: Callable[[str], None]) -> None:
    beside(power())
    static = read_source(RUNS / "001-static-5mm_s.h5", None, Given(options=Options(draws=100)))
    assert "power" not in [section.id for section in build.build_content(static).sections]


@pytest.mark.parametrize(
    ("old", "new", "error", "said"),
    [
        ('"runs_section"', '"circles_section"', ValueError, "nothing is made by “circles_section”"),
        ("SECTION = ", "CHAPTER = ", TypeError, "power_section has no SECTION that is an AddedSection"),
    ],
)
def test_a_section_that_cannot_be_placed_is_refused_at_import_by_name(
    beside: Callable[[str], None], old: str, new: str, error: type[Exception], said: str
) -> None:
    assert old in power()
    with pytest.raises(error, match=said):
        beside(power().replace(old, new))


def test_two_sections_of_one_anchor_are_refused() -> None:
    one, other = (Section("power", title, ()) for title in ("Power", "Power of the drive"))
    with pytest.raises(ValueError, match="section “Power”: its anchor “power” is another's, too"):
        Content("", "", (), (), Sheet("", ()), (one, other), "", "")
