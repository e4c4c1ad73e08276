"""Who may see and who may act: tokens, sessions, and what a request must look like to be one of our page's.

A browser runs pages of strangers beside ours. What they can make it send is told by ``Host`` (a name that
was bent to this machine, DNS rebinding) and ``Origin`` (a request from a foreign page), and they never get
our cookie (``SameSite=Strict``) nor read what we answer (no CORS header is ever sent).
"""

from __future__ import annotations

import hmac
import ipaddress
import secrets
import socket
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Rights = Literal["none", "view", "control"]
MOST_SESSIONS = 200
"""Sessions that are remembered; the oldest is forgotten for a new one, and has to show its token again."""


@dataclass(frozen=True)
class Tokens:
    """What opens the page: one word to look, another to act. An empty one opens nothing.

    ``free_view`` lets anyone look who reaches the address at all (loopback).
    """

    view: str = ""
    control: str = ""
    free_view: bool = False


def new_tokens(*, loopback: bool, view_only: bool = False) -> Tokens:
    """Return fresh tokens of 144 random bits: on loopback looking is free, acting never is."""
    return Tokens(
        "" if loopback else secrets.token_urlsafe(18),
        "" if view_only else secrets.token_urlsafe(18),
        free_view=loopback,
    )


def is_loopback(host: str) -> bool:
    """Return whether an address or name stays on this machine."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


class Access:
    """Judges requests.

    Parameters
    ----------
    tokens : Tokens
        What opens the page.
    loopback : bool
        Whether only this machine is served.
    names : sequence of str
        By which it is reached, too: the operator has given them.
    encrypted : bool
        Whether the pages are served by TLS.
    """

    def __init__(
        self, tokens: Tokens, *, loopback: bool, names: Sequence[str] = (), encrypted: bool = False
    ) -> None:
        self._tokens = tokens
        self.encrypted = encrypted
        self._loopback = loopback
        self._names = {"localhost", *names}
        if not loopback:
            own = socket.gethostname().lower()
            self._names |= {own, own.partition(".")[0], f"{own.partition('.')[0]}.local"}
        self._sessions: OrderedDict[str, Rights] = OrderedDict()

    def host_is_ours(self, host: str) -> bool:
        """Return whether a ``Host`` header names this machine and not a name that was bent to it.

        An address is never such a name; of names only ``localhost`` and, away from loopback, the machine's
        own are taken.
        """
        name, separator, port = host.strip().lower().rpartition(":")
        if not separator or port.endswith("]"):
            name = host.strip().lower()
        elif not port.isascii() or not port.isdigit():
            return False
        if name in self._names:
            return True
        try:
            address = ipaddress.ip_address(name[1:-1] if name.startswith("[") else name)
        except ValueError:
            return False
        return address.is_loopback or not self._loopback

    @property
    def scheme(self) -> str:
        """Get ``http`` or ``https``."""
        return "https" if self.encrypted else "http"

    def origin_is_ours(self, origin: str | None, host: str) -> bool:
        """Return whether a request comes from our own page: what its browser calls its origin."""
        return origin is not None and origin.lower() == f"{self.scheme}://{host.strip().lower()}"

    def admit(self, token: str) -> tuple[str, Rights] | None:
        """Return a new session and its rights for a token; None for a wrong one.

        Both comparisons are always made, and take the same time wherever the difference is.
        """
        given = token.encode()
        control = hmac.compare_digest(given, self._tokens.control.encode()) and bool(self._tokens.control)
        view = hmac.compare_digest(given, self._tokens.view.encode()) and bool(self._tokens.view)
        if not control and not view:
            return None
        session = secrets.token_urlsafe(24)
        self._sessions[session] = "control" if control else "view"
        while len(self._sessions) > MOST_SESSIONS:
            self._sessions.popitem(last=False)
        return session, self._sessions[session]

    def rights_of(self, session: str | None) -> Rights:
        """Return what a session (or none) may do."""
        known = self._sessions.get(session or "", "none")
        if known == "none" and self._tokens.free_view:
            return "view"
        return known

    @property
    def controllable(self) -> bool:
        """Return whether anybody can act at all."""
        return bool(self._tokens.control)
