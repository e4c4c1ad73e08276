"""The archive: thousands of runs searched by the index, opened, compared and handed on as a table."""

from __future__ import annotations

import asyncio
import csv
import io
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bufferstand.daq.desk.chosen import RUN_SUFFIX
from bufferstand.daq.desk.results.run_page import run_facts
from bufferstand.daq.desk.shell import Desk, Tab, refusal
from bufferstand.foundation import BadInput
from bufferstand.recording.finding import RECORDED, RunFileFacts, indexed_runs, parse_query, recorded_facts

TAB = Tab("/archive", "Archive")
FRESH_S = 10.0
"""The folder is looked through again after so long, when somebody asks [s]."""
PAGE_ROWS = 100
SORTS = ("started_utc", "path", "specimen", "kind", "status", "step", "frequency_Hz", "amplitude_mm",
         "prestress_mm")  # fmt: skip
COLUMNS = ("path", "started_utc", "kind", "status", "specimen", "campaign", "operator", "step",
           "prestress_mm", "amplitude_mm", "frequency_Hz", "simulated", "sha256")  # fmt: skip
LONGEST = 2000
HINTS = ("kind", "status", "specimen", "campaign", "operator", "step")
"""What a search proposes the values of; they are found by words, as the path and the day are."""
HINTED = 12
"""So many values of each are proposed: those of the newest runs."""


@dataclass(frozen=True)
class Row:
    """A run with what is searched in it."""

    facts: dict[str, Any]
    text: str
    problem: str


class RunList:
    """The runs below a folder, as the index has them; kept, and looked through anew when it is old.

    Parameters
    ----------
    root : Path
    read : callable
        Returns the runs below a folder; blocking.
    wall_s : callable
        Time of the wall [s].
    """

    def __init__(
        self,
        root: Path,
        read: Callable[[Path], Sequence[RunFileFacts]] = indexed_runs,
        wall_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._root = root
        self._read = read
        self._wall_s = wall_s
        self._rows: list[Row] | None = None
        self._read_s = 0.0
        self._lock = threading.Lock()
        self._renewing = False

    def rows(self) -> list[Row]:
        """Return every run; the first call reads, later ones have the list renewed beside them."""
        with self._lock:
            if self._rows is None:
                self._renew()
            elif self._wall_s() - self._read_s > FRESH_S and not self._renewing:
                self._renewing = True
                threading.Thread(target=self._renew_beside, name="archive", daemon=True).start()
            return self._rows or []

    @property
    def renewing(self) -> bool:
        """Get whether it is being looked through anew: what it has may be old until then."""
        return self._renewing

    def _renew_beside(self) -> None:
        try:
            self._renew()
        finally:
            self._renewing = False

    def _renew(self) -> None:
        try:
            found = self._read(self._root)
        except BadInput:  # no run yet
            found = []
        self._rows = [self._row(one) for one in found]
        self._read_s = self._wall_s()

    def _row(self, run: RunFileFacts) -> Row:
        facts = recorded_facts(run)
        try:
            facts["path"] = run.path.relative_to(self._root).as_posix()
        except ValueError:
            facts["path"] = str(run.path)
        text = " ".join(str(facts[name]) for name in COLUMNS[:8] if facts.get(name) is not None)
        return Row(facts, text.casefold(), run.problem or "")


def found_in(rows: Sequence[Row], words: str, where: str, sort: str, *, down: bool) -> list[Row]:
    """Return the runs that match, in order.

    Parameters
    ----------
    rows : sequence of Row
    words : str
        Each of them must be somewhere in what is on record of a run.
    where : str
        An expression, as of ``bufferstand runs --where``; empty for all.
    sort : str
        Name of a fact.
    down : bool
        The greatest, or newest, first.

    Raises
    ------
    BadInput
        If the expression is none, or there is no such fact to sort by.
    """
    if sort not in SORTS:
        raise BadInput(f"the runs are sorted by one of: {', '.join(SORTS)}")
    query = parse_query(where[:LONGEST], RECORDED) if where.strip() else None
    wanted = words.casefold().split()
    found = [
        row
        for row in rows
        if all(word in row.text for word in wanted) and (query is None or query.matches(row.facts))
    ]
    known = [row for row in found if row.facts.get(sort) not in (None, "")]
    known.sort(key=lambda row: (row.facts[sort], row.facts["path"]), reverse=down)
    return known + [row for row in found if row.facts.get(sort) in (None, "")]


def hints_of(rows: Sequence[Row]) -> dict[str, list[str]]:
    """Return values that can be searched for, by what they are of: those of the newest runs first."""
    newest = sorted(rows, key=lambda row: str(row.facts.get("started_utc") or ""), reverse=True)
    return {
        name: list(dict.fromkeys(str(row.facts[name]) for row in newest if row.facts.get(name)))[:HINTED]
        for name in HINTS
    }


class Archive:
    """Its routes.

    Parameters
    ----------
    desk : Desk
    """

    tab = TAB

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._list = RunList(desk.folder.root)
        self._reading: asyncio.Task[None] | None = None

    def routes(self) -> list[Route]:
        """Return its routes."""
        return [
            self._desk.look("/archive", self.page),
            self._desk.look("/archive/runs", self.search),
            self._desk.look("/archive/hints", self.hints),
            self._desk.look("/archive/table", self.table),
            self._desk.look("/archive/run", self.run),
        ]

    async def page(self, request: Request) -> Response:
        """Show the page; its runs are asked for by it, and read meanwhile."""
        self._reading = asyncio.create_task(asyncio.to_thread(self._read_ahead))
        return self._desk.page(
            request, "archive.html", title="Archive", fields=sorted(RECORDED), command=self._command("")
        )

    def _command(self, where: str) -> str:
        return self._desk.commands.shown("runs", ".", *(("--where", where) if where.strip() else ()))

    async def _found(self, request: Request) -> tuple[list[Row], int]:
        asked = request.query_params
        rows = await asyncio.to_thread(self._list.rows)
        sort, down = asked.get("sort", "started_utc"), asked.get("down", "1") != "0"
        words, where = asked.get("words", "")[:LONGEST], asked.get("where", "")
        return await asyncio.to_thread(found_in, rows, words, where, sort, down=down), len(rows)

    def _read_ahead(self) -> None:
        """Read the list, and open a run that nobody has asked for yet: what reads them takes long to load."""
        rows = self._list.rows()
        with suppress(BadInput, OSError):
            if rows:
                run_facts(self._desk.folder.inside(rows[0].facts["path"], RUN_SUFFIX))

    async def search(self, request: Request) -> Response:
        """Give a page of the runs that match."""
        try:
            found, whole = await self._found(request)
            first = max(0, int(request.query_params.get("first", "0")))
        except BadInput as error:
            return refusal(409, str(error))
        except ValueError:
            return refusal(400, "a number is expected")
        return JSONResponse(
            {
                "rows": [
                    {name: row.facts.get(name) for name in COLUMNS} | {"problem": row.problem}
                    for row in found[first : first + PAGE_ROWS]
                ],
                "first": first,
                "found": len(found),
                "all": whole,
                "renewing": self._list.renewing,
                "command": self._command(request.query_params.get("where", "")),
            }
        )

    async def hints(self, request: Request) -> Response:  # noqa: ARG002 - its signature
        """Give what can be typed into the search."""
        rows = await asyncio.to_thread(self._list.rows)
        return JSONResponse(await asyncio.to_thread(hints_of, rows))

    async def table(self, request: Request) -> Response:
        """Give all runs that match as CSV."""
        found, _ = await self._found(request)
        out = io.StringIO()
        writer = csv.writer(out)
        writer.writerow(COLUMNS)
        writer.writerows([[_cell(row.facts.get(name)) for name in COLUMNS] for row in found])
        headers = {"Content-Disposition": 'attachment; filename="runs.csv"'}
        return Response(out.getvalue(), media_type="text/csv", headers=headers)

    async def run(self, request: Request) -> Response:
        """Show what is on record of one run."""
        path = self._desk.folder.inside(request.query_params.get("path", ""), RUN_SUFFIX)
        facts = await asyncio.to_thread(run_facts, path)
        name = self._desk.folder.name(path)
        return self._desk.page(
            request,
            "archive-run.html",
            title=f"Run {facts['id']}",
            run=facts,
            name=name,
            curve=facts.pop("curve"),
            verify=self._desk.commands.shown("verify", name),
        )


def _cell(value: Any) -> Any:
    """Return a cell that no spreadsheet takes for a formula."""
    if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r")):
        return f"'{value}"
    return "" if value is None else value
