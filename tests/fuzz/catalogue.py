"""Every target of fuzzing, by name."""

from __future__ import annotations

from collections.abc import Mapping

from tests.fuzz.target import Target
from tests.fuzz.targets.pages import PAGES
from tests.fuzz.targets.records import RECORDS
from tests.fuzz.targets.settings import SETTINGS
from tests.fuzz.targets.wires import WIRES

TARGETS: Mapping[str, Target] = {one.name: one for one in (*SETTINGS, *RECORDS, *WIRES, *PAGES)}
