"""Who the desk lets in, and to what: as the monitor; nothing moves for whoever is not at this computer."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.desk.served import Served, laboratory, served


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(laboratory(tmp_path_factory.mktemp("laboratory"))) as it:
        yield it


def test_looking_is_free_on_this_computer_and_says_that_it_is_no_more(desk: Served) -> None:
    desk.cookie = ""
    status, headers, text = desk.request("GET", "/")
    assert status == 200
    assert "may only look on" in text
    assert "default-src 'none'; script-src 'self'" in headers["content-security-policy"]
    assert headers["x-frame-options"] == "DENY"
    assert desk.token not in text


def test_a_foreign_host_is_served_nothing(desk: Served) -> None:
    for host in ("evil.example", f"evil.example:{desk.port}", ""):
        assert desk.request("GET", "/", Host=host)[0] in (400, 421)


def test_a_wrong_token_opens_nothing(desk: Served) -> None:
    desk.cookie = ""
    status, said = desk.post("/session", {"token": "x" * 24})
    assert status == 403
    assert "opens nothing" in said["problem"]


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "", "https://127.0.0.1"])
def test_a_foreign_page_cannot_even_show_the_token(desk: Served, origin: str) -> None:
    assert desk.request("POST", "/session", {"token": desk.token}, Origin=origin)[0] == 403


def test_a_form_of_another_page_is_no_request_of_ours(desk: Served) -> None:
    sent = desk.request("POST", "/session", b"token=1", Content_Type="application/x-www-form-urlencoded")
    assert sent[0] == 415
    assert desk.request("POST", "/session", b"[1")[0] == 400
    assert desk.request("POST", "/session", b"{" + b" " * 600_000 + b"}")[0] == 413


@pytest.mark.parametrize("name", ["../shell.py", "%2e%2e/shell.py", "frame.html", "desk.py", ""])
def test_no_other_file_is_served_as_one_of_the_page(desk: Served, name: str) -> None:
    assert desk.request("GET", f"/static/{name}")[0] == 404


def test_it_ends_when_it_is_told_to(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        assert "None found" in it.request("GET", "/")[2]
    assert it.process.returncode == 0
