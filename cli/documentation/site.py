"""The documentation as a site on this computer: rendered from the pages as they are asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fnmatch import fnmatch
from html import escape
from importlib.metadata import version
from pathlib import Path
from posixpath import dirname, join, normpath
from typing import Any
from urllib.parse import urlsplit

from markdown_it import MarkdownIt
from markdown_it.token import Token
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from bufferstand.cli.documentation.pages import FIRST, Page, anchor_of, documentation_folder, read_pages
from bufferstand.cli.documentation.search import Hit, find

_RULES = {
    "Content-Security-Policy": "default-src 'none'; style-src 'self'; img-src 'self'; form-action 'self'; "
    "base-uri 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}
_MOST_HITS = 40
_MOST_LETTERS = 200
_FRAME = """<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title} · bufferstand</title><link rel="stylesheet" href="/static/documentation.css"></head>
<body><a class="skip" href="#content">To the text</a>
<header><a class="home" href="/">bufferstand</a> <span>{version}</span>
<form action="/search" role="search">
<input type="search" name="q" value="{query}" aria-label="Search the documentation" placeholder="Search">
<button>Search</button></form></header>
<div class="sheet"><main id="content">{body}</main>
<nav aria-label="Pages">{navigation}</nav></div></body></html>"""


def documentation_site(folder: Path | None = None) -> Starlette:
    """Return the application that serves the pages, with a search; it writes nothing.

    Parameters
    ----------
    folder : Path, optional
        Where the pages lie; None: those of this installation.

    Raises
    ------
    BadInput
        If this installation has none.
    """
    folder = folder or documentation_folder()
    site = _Site(read_pages(folder))
    return Starlette(
        routes=[
            Route("/", lambda _: RedirectResponse(f"/{FIRST}.html")),
            Route("/search", site.search),
            Mount("/static", StaticFiles(directory=Path(__file__).parent / "static")),
            Mount("/pictures", StaticFiles(directory=folder / "pictures")),
            Route("/{name:path}.html", site.page),
            Route("/{name:path}", site.nothing),
        ]
    )


class _Site:
    """Renders pages and what a search finds."""

    def __init__(self, pages: Mapping[str, Page]) -> None:
        self._pages = pages
        self._markdown = MarkdownIt("commonmark", {"html": False}).enable("table")
        self._navigation = self._links_to_pages()

    async def page(self, request: Request) -> Response:
        """Answer with a page."""
        page = self._pages.get(request.path_params["name"])
        return await self.nothing(request) if page is None else self._answer(page.title, self._rendered(page))

    async def nothing(self, request: Request) -> Response:
        """Answer that there is no such page, and what there is of these words."""
        words = request.path_params["name"].removesuffix(".html").replace("/", " ").replace("-", " ")
        body = f"<h1>There is no such page</h1>{self._found(words[:_MOST_LETTERS])}"
        return self._answer("No such page", body, status=404)

    async def search(self, request: Request) -> Response:
        """Answer with what a search finds."""
        query = request.query_params.get("q", "")[:_MOST_LETTERS]
        return self._answer("Search", f"<h1>Search</h1>{self._found(query)}", query=query)

    def _found(self, query: str) -> str:
        hits = find(self._pages.values(), query)
        if not hits:
            return f"<p>Nothing found for “{escape(query)}”.</p>"
        listed = "".join(map(_as_item, hits[:_MOST_HITS]))
        number = f"{len(hits)} sections" if len(hits) > 1 else "1 section"
        more = f" The first {_MOST_HITS}:" if len(hits) > _MOST_HITS else ""
        return f"<p>{number} with “{escape(query)}”.{more}</p><ol class='hits'>{listed}</ol>"

    def _answer(self, title: str, body: str, *, query: str = "", status: int = 200) -> Response:
        text = _FRAME.format(
            title=escape(title),
            version=escape(version("bufferstand")),
            query=escape(query),
            body=body,
            navigation=self._navigation,
        )
        return HTMLResponse(text, status, headers=_RULES)

    def _rendered(self, page: Page) -> str:
        tokens = self._markdown.parse(page.body)
        used: dict[str, int] = {}
        for number, token in enumerate(tokens):
            if token.type == "heading_open":
                anchor = anchor_of(_words_of(tokens[number + 1]))
                used[anchor] = used.get(anchor, -1) + 1
                token.attrSet("id", anchor if not used[anchor] else f"{anchor}-{used[anchor]}")
            for link in _links_in(token):
                self._set_link(link, page)
        html = str(self._markdown.renderer.render(tokens, self._markdown.options, {}))
        return html.replace("<table>", '<div class="wide"><table>').replace("</table>", "</table></div>")

    def _set_link(self, link: Token, page: Page) -> None:
        """Lead a link to the site's own page; what lies outside of the pages stays as text."""
        name = "src" if link.type == "image" else "href"
        target = urlsplit(str(link.attrs.get(name, "")))
        if target.scheme or target.netloc or not target.path:
            return
        there = normpath(join(dirname(page.name), target.path))
        if there.removesuffix(".md") in self._pages:
            there = f"{there.removesuffix('.md')}.html"
        elif not there.startswith("pictures/"):
            link.attrs = {"title": f"{there.lstrip('./')}, in the source tree"}
            return
        link.attrs[name] = f"/{there}" + (f"#{target.fragment}" if target.fragment else "")

    def _links_to_pages(self) -> str:
        parts = []
        for caption, names in self._pages[FIRST].listed.items():
            listed = [one for name in names for one in self._pages if fnmatch(one, name)]
            links = "".join(
                f'<li><a href="/{name}.html">{escape(self._pages[name].title)}</a></li>' for name in listed
            )
            parts.append(f"<h2>{escape(caption)}</h2><ul>{links}</ul>")
        return "".join(parts)


def _as_item(hit: Hit) -> str:
    place = f"/{hit.page.name}.html#{hit.section.anchor}"
    beside = "" if hit.section.heading == hit.page.title else f" · {escape(hit.section.heading)}"
    return (
        f'<li><a href="{escape(place)}">{escape(hit.page.title)}{beside}</a>'
        f"<br><small>{escape(hit.excerpt)}</small></li>"
    )


def _links_in(token: Token) -> Iterator[Token]:
    for child in token.children or ():
        if child.type in ("link_open", "image"):
            yield child


def _words_of(inline: Token) -> str:
    """Return the text of a heading without its marks."""
    children: Any = inline.children or ()
    return "".join(child.content for child in children if child.type in ("text", "code_inline"))
