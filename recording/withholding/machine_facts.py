"""What a metadata document says of the machine: addresses, ports, paths and login names."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from ipaddress import IPv4Address
from pathlib import PurePosixPath, PureWindowsPath
from typing import Any

WITHHELD = "(withheld)"
"""What stands in a text in place of what was taken out."""
RECORD_KEY = "withheld"
"""Key of the document's table that says what was taken out, and of which file."""

_DEVICES = ("controller", "amplifier", "temperature", "sensor")
"""Tables of a stand file whose keys say where a device is reached."""
_REACHED_BY = frozenset(
    ("host", "port", "tcp_port", "serial", "root", "address", "path", "folder", "url", "socket")
)
_NOT_LOOKED_INTO = ("channel", "sensor")
"""In them ``serial`` and ``address`` are those of a transducer: facts of the measurement."""
_DECIDED_BY = ("arming", "edits", "changes")
"""Tables that say who decided something, by the name of the login."""
_FILES = {
    "campaign": ("file", "stand", "specimen"),
    "specimen": ("model",),
    "original": ("file", "specimen_file"),
}
"""Keys that name a file; its name is kept, its folders are not."""
_HASHES = ("datasets", "content_sha256", "sealed_from")
_SHORTEST = 3
"""Letters of a host or login that is looked for in texts; a shorter one would be found in words."""

_PATH = re.compile(r"(?<![\w.:/\\])(?:~|/[\w.+~@-]+)(?:/[\w.+~@-]*)+|(?<!\w)[A-Za-z]:\\\S+|\\\\[\w.-]+\\\S+")
_URL = re.compile(r"\b(?:socket|tcp|rfc2217|telnet|ssh|smb|file)://\S+")
_IPV4 = re.compile(r"(?<![\w.])(\d{1,3}(?:\.\d{1,3}){3})(?![\w.]*\d)(:\d+)?")
_IPV6 = re.compile(r"\[[0-9A-Fa-f]*:[0-9A-Fa-f:.]+(?:%\w+)?\](?::\d+)?")


def without_machine(
    document: Mapping[str, Any],
) -> tuple[dict[str, Any], list[str], Callable[[str], str]]:
    """Return a metadata document without what it says of the machine.

    Taken out are: where devices are reached (address, port, serial line, folder), who had logged in when
    something was decided, the diffs of edited files, folders of files, and in every text these values,
    absolute paths and addresses of networks.

    Parameters
    ----------
    document : mapping
        The metadata document of a run (docs/run-file.md).

    Returns
    -------
    (dict, list of str, callable)
        The document; the keys that were taken out or changed, sorted; and what does the same to a text or
        the data of an event.
    """
    search = _Search()
    kept = {key: value for key, value in document.items() if key not in _HASHES}
    if isinstance(stand := kept.get("stand"), Mapping):
        kept["stand"] = _stand(stand, search)
    for key in _DECIDED_BY:
        if key in kept:
            kept[key] = search.take(kept[key], key, {"by", "files"}, logins=True)
    for table, names in _FILES.items():
        if isinstance(entry := kept.get(table), Mapping):
            kept[table] = {
                name: search.file_name(value, f"{table}.{name}") if name in names else value
                for name, value in entry.items()
            }
    run = kept.get("run")
    if isinstance(run, Mapping) and run.get("operator") in search.logins:
        kept["run"] = {**run, "operator": WITHHELD}
        search.found.add("run.operator")
    kept = {key: search.cleaned(value, key) for key, value in kept.items()}
    if "sealed_from" in document:
        kept["sealed_from"] = document["sealed_from"]
    return kept, sorted(search.found), search.text_of_event


def _stand(stand: Mapping[str, Any], search: _Search) -> dict[str, Any]:
    taken = {
        key: search.take(value, f"stand.{key}", _REACHED_BY) if key in _DEVICES else value
        for key, value in stand.items()
    }
    if "identity" in taken:
        taken["identity"] = search.take(taken["identity"], "stand.identity", {"address"})
    for path in (("controller", "profile"), ("simulation", "model")):
        entry = taken.get(path[0])
        if isinstance(entry, Mapping) and path[1] in entry:
            name = search.file_name(entry[path[1]], f"stand.{'.'.join(path)}")
            taken[path[0]] = {**entry, path[1]: name}
    return taken


class _Search:
    """Takes facts out, and remembers their values and keys."""

    def __init__(self) -> None:
        self.found: set[str] = set()
        self.logins: set[str] = set()
        self._places: set[str] = set()

    def take(self, value: Any, path: str, keys: frozenset[str] | set[str], *, logins: bool = False) -> Any:
        """Return a value without those keys, at any depth but in channels."""
        if isinstance(value, Mapping):
            kept = {}
            for key, inner in value.items():
                here = f"{path}.{key}"
                if key in keys:
                    self.found.add(here)
                    if isinstance(inner, str) and inner:
                        (self.logins if logins and key == "by" else self._places).add(inner)
                elif key in _NOT_LOOKED_INTO:
                    kept[key] = inner
                else:
                    kept[key] = self.take(inner, here, keys, logins=logins)
            return kept
        if isinstance(value, list | tuple):
            return [self.take(inner, f"{path}[]", keys, logins=logins) for inner in value]
        return value

    def file_name(self, value: Any, path: str) -> Any:
        """Return the name of a file without its folders."""
        if not isinstance(value, str):
            return value
        name = PureWindowsPath(value).name if "\\" in value else PurePosixPath(value).name
        if name != value:
            self.found.add(path)
        return name

    def cleaned(self, value: Any, path: str) -> Any:
        """Return a value whose texts say nothing of the machine any more."""
        if isinstance(value, str):
            text = self._text(value, everywhere=False)
            if text != value:
                self.found.add(path)
            return text
        if isinstance(value, Mapping):
            return {key: self.cleaned(inner, f"{path}.{key}") for key, inner in value.items()}
        if isinstance(value, list | tuple):
            return [self.cleaned(inner, f"{path}[]") for inner in value]
        return value

    def text_of_event(self, text: str) -> str:
        """Return the text of an event; logins and every address are taken out of it, too."""
        return self._text(text, everywhere=True)

    def _text(self, text: str, *, everywhere: bool) -> str:
        for value in sorted(self._places | (self.logins if everywhere else set()), key=len, reverse=True):
            if len(value) >= _SHORTEST:
                text = re.sub(rf"(?<!\w){re.escape(value)}(?!\w)(?::\d+)?", WITHHELD, text)
        for pattern in (_URL, _PATH, _IPV6):
            text = pattern.sub(WITHHELD, text)
        return _IPV4.sub(lambda found: _address(found, everywhere=everywhere), text)


def _address(found: re.Match[str], *, everywhere: bool) -> str:
    """Return what stands for four numbers with dots: they may be a clause (“7.8.2.1”), not an address."""
    try:
        address = IPv4Address(found[1])
    except ValueError:
        return found[0]
    return WITHHELD if everywhere or found[2] or address.is_private else found[0]
