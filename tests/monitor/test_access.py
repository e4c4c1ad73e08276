"""Who is let in: hosts, origins, tokens, sessions."""

from __future__ import annotations

import socket

import pytest

from bufferstand.daq.monitor.access import MOST_SESSIONS, Access, Tokens, is_loopback, new_tokens
from bufferstand.daq.monitor.actions import who_asks

HERE = Access(Tokens("", "control", free_view=True), loopback=True)


@pytest.fixture
def away(monkeypatch: pytest.MonkeyPatch) -> Access:
    monkeypatch.setattr(socket, "gethostname", lambda: "Lab-PC.example.org")
    return Access(Tokens("view", "control"), loopback=False)


@pytest.mark.parametrize(
    ("host", "here", "there"),
    [
        ("127.0.0.1:8420", True, True),
        ("127.0.0.1", True, True),
        ("localhost:9000", True, True),
        ("LOCALHOST", True, True),
        ("[::1]:8420", True, True),
        ("[::1]", True, True),
        ("192.168.1.5:8420", False, True),
        ("[fe80::1]:8420", False, True),
        ("lab-pc:8420", False, True),
        ("lab-pc.local:8420", False, True),
        ("lab-pc.example.org", False, True),
        ("evil.example", False, False),
        ("127.0.0.1.evil.example", False, False),
        ("localhost.evil.example", False, False),
        ("evil.example:8420", False, False),
        ("127.0.0.1:http", False, False),
        ("127.0.0.1:8420:1", False, False),
        ("2130706433", False, False),
        ("", False, False),
        (":8420", False, False),
        ("lab-pc@evil", False, False),
    ],
)
def test_hosts(host: str, here: bool, there: bool, away: Access) -> None:
    assert (HERE.host_is_ours(host), away.host_is_ours(host)) == (here, there)


@pytest.mark.parametrize(
    ("origin", "ours"),
    [
        ("http://127.0.0.1:8420", True),
        ("HTTP://127.0.0.1:8420", True),
        ("https://127.0.0.1:8420", False),
        ("http://127.0.0.1:8421", False),
        ("http://127.0.0.1", False),
        ("http://127.0.0.1:8420.evil.example", False),
        ("null", False),
        ("", False),
        (None, False),
    ],
)
def test_origins(origin: str | None, ours: bool) -> None:
    assert HERE.origin_is_ours(origin, "127.0.0.1:8420") is ours


def test_tokens_give_what_they_are_for_and_empty_ones_nothing(away: Access) -> None:
    for access, token, rights in (
        (away, "view", "view"),
        (away, "control", "control"),
        (HERE, "control", "control"),
    ):
        admitted = access.admit(token)
        assert admitted is not None
        session, given = admitted
        assert (given, access.rights_of(session)) == (rights, rights)
    for wrong in ("", "View", "contro", "control ", "é"):
        assert away.admit(wrong) is None
        assert HERE.admit(wrong) is None
    assert Access(new_tokens(loopback=True, view_only=True), loopback=True).admit("") is None
    assert away.rights_of(None) == away.rights_of("made up") == "none"
    assert HERE.rights_of(None) == "view"


def test_tokens_are_fresh_and_long() -> None:
    tokens = [new_tokens(loopback=False) for _ in range(50)]
    words = {word for one in tokens for word in (one.view, one.control)}
    assert len(words) == 100
    assert min(map(len, words)) >= 24
    assert not tokens[0].free_view
    assert new_tokens(loopback=True).view == ""


def test_sessions_are_bounded(away: Access) -> None:
    first = away.admit("control")
    assert first is not None
    for _ in range(MOST_SESSIONS):
        away.admit("view")
    assert away.rights_of(first[0]) == "none"


@pytest.mark.parametrize(
    ("name", "address", "who"),
    [
        ("", "127.0.0.1", "monitor: someone at this computer"),
        ("  Ada \n L.\x00\x1b[31m ", "192.168.1.7", "monitor: Ada L. [31m at 192.168.1.7"),
        ("\u202eadA", "::1", "monitor: adA at this computer"),
        ("x" * 500, "10.0.0.1", f"monitor: {'x' * 40} at 10.0.0.1"),
    ],
)
def test_who_asks(name: str, address: str, who: str) -> None:
    assert who_asks(name, address) == who


def test_loopback() -> None:
    assert [is_loopback(host) for host in ("127.0.0.1", "127.8.8.8", "::1", "[::1]", "localhost")] == [
        True
    ] * 5
    assert [is_loopback(host) for host in ("0.0.0.0", "192.168.1.5", "::", "localhost.x", "")] == [False] * 5
