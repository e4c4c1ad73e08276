"""Which runs a page is about: campaign folders and run files, by their paths from the desk's folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlencode

from starlette.datastructures import QueryParams

from bufferstand.daq.desk.commands import word_of
from bufferstand.daq.desk.folder import Folder
from bufferstand.foundation import BadInput
from bufferstand.recording.finding import run_files

MOST_PATHS = 60
MOST_RUNS = 300
"""Runs of one page: what is more is evaluated by ``bufferstand evaluate``."""
RUN_SUFFIX = ".h5"


@dataclass(frozen=True)
class Chosen:
    """What was chosen.

    Parameters
    ----------
    paths : tuple of str
        From the desk's folder, in their order.
    places : tuple of Path
        Where they lie.
    """

    paths: tuple[str, ...]
    places: tuple[Path, ...]

    @property
    def words(self) -> tuple[str, ...]:
        """Return them as words of a command line."""
        return tuple(map(word_of, self.paths))

    @property
    def named(self) -> dict[str, list[str]]:
        """Return them as a page sends them: run files, and folders."""
        runs = [path for path in self.paths if path.endswith(RUN_SUFFIX)]
        return {"run": runs, "folder": [path for path in self.paths if path not in runs]}

    @property
    def query(self) -> str:
        """Return them as the query of an address."""
        named = [("run" if path.endswith(RUN_SUFFIX) else "folder", path) for path in self.paths]
        return urlencode(named)

    def runs(self) -> list[Path]:
        """Return every run file; blocking.

        Raises
        ------
        BadInput
            If there is none, or there are more than :data:`MOST_RUNS`.
        """
        found = run_files(self.places)
        if len(found) > MOST_RUNS:
            raise BadInput(
                f"{len(found)} runs are more than the {MOST_RUNS} that a page shows",
                remedy="choose fewer of them in the archive, or use “bufferstand evaluate”",
            )
        return found


def chosen_of(folder: Folder, query: QueryParams | dict[str, object]) -> Chosen:
    """Return what a request is about.

    Parameters
    ----------
    folder : Folder
    query : mapping
        ``folder`` and ``run``, each a path from the desk's folder or several; of a page's JSON lists of them.

    Raises
    ------
    BadInput
        If something lies elsewhere or is not there, nothing is chosen, or too much.
    """
    named: list[str] = []
    for key in ("folder", "run"):
        given = query.getlist(key) if isinstance(query, QueryParams) else query.get(key, [])
        named += [one for one in given if isinstance(one, str)] if isinstance(given, list) else []
    paths = list(dict.fromkeys(named))
    if not paths:
        raise BadInput("no campaign and no run is chosen", remedy="choose one in the archive")
    if len(paths) > MOST_PATHS:
        raise BadInput(f"more than {MOST_PATHS} are chosen at once", remedy="choose fewer")
    places = tuple(folder.inside(path) for path in paths)
    for path, place in zip(paths, places, strict=True):
        if not place.is_dir() and place.suffix != RUN_SUFFIX:
            raise BadInput("this is no run file", file=path[:200])
    return Chosen(tuple(map(folder.name, places)), places)
