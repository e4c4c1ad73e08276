"""The differences from the beginning of a campaign, in words, before and now.

Of its files every setting that has another value; of the controller who answers; of the software its version.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from bufferstand.daq.campaign_folder.inputs import FileEdit
from bufferstand.drivers import Identity
from bufferstand.foundation.settings import NotToml, toml_content

SERIAL = "the controller’s serial number"
_CONTROLLER = (
    ("serial", SERIAL),
    ("device", "the controller’s register profile"),
    ("profile", "edition and hash of the register profile, and the firmware’s edition of it"),
    ("sample_rate_Hz", "the controller’s sample rate [Hz]"),
)
"""Facts of an identity, and what they are called. Its address is no fact of the controller."""
_NAMES = ("name", "rom", "id")
"""Keys by which the tables of a list are distinguished."""
_LONG = 80


@dataclass(frozen=True)
class StartChange:
    """One thing that is another than it was: what, and its values in words."""

    what: str
    before: str
    now: str

    def text(self) -> str:
        """Return e.g. ``stand.toml: controller.watchdog_s: 2.0 → 10.0``."""
        return f"{self.what}: {self.before} → {self.now}"

    def as_dict(self) -> dict[str, str]:
        """Return it as JSON-ready data."""
        return asdict(self)


def controller_changes(before: Mapping[str, Any], now: Identity) -> tuple[StartChange, ...]:
    """Return what differs between the controller of an earlier start and the one that answers now."""
    is_now = asdict(now)
    return tuple(
        StartChange(words, _shown(before[key]), _shown(is_now[key]))
        for key, words in _CONTROLLER
        if before.get(key) not in (None, "") and before[key] != is_now[key]
    )


def software_changes(before: str, now: str) -> tuple[StartChange, ...]:
    """Return whether the software is of another version; nothing where the earlier one is not known."""
    return (StartChange("bufferstand’s version", before, now),) if before and before != now else ()


def file_changes(edits: Sequence[FileEdit]) -> tuple[StartChange, ...]:
    """Return every setting that has another value in edited files; of a file that is no TOML, that it is one.

    Comments and layout are none; a list of tables is gone through by the names of its tables.
    """
    return tuple(change for edit in edits for change in _of_file(edit))


def _of_file(edit: FileEdit) -> Iterator[StartChange]:
    try:
        was, is_now = (dict(_flat(toml_content(text or ""))) for text in (edit.before, edit.now))
    except NotToml:
        yield StartChange(edit.place, "as taken", "edited")
        return
    for key in dict.fromkeys([*was, *is_now]):
        if was.get(key) != is_now.get(key):
            yield StartChange(f"{edit.place}: {key}", _shown(was.get(key)), _shown(is_now.get(key)))


def _flat(content: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """Yield each value of a document with its place, e.g. ``controller.channel[force].delay_s``."""
    if isinstance(content, Mapping):
        for key, value in content.items():
            yield from _flat(value, f"{place}.{key}" if place else str(key))
    elif isinstance(content, list) and content and all(isinstance(one, Mapping) for one in content):
        for number, table in enumerate(content, start=1):
            name = next((table[key] for key in _NAMES if key in table), number)
            yield from _flat(table, f"{place}[{name}]")
    else:
        yield place, content


def _shown(value: Any) -> str:
    if value is None:
        return "not given"
    if isinstance(value, bool):
        return str(value).lower()
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= _LONG else f"{text[: _LONG - 1]}…"
