"""Live page and desk over TLS in real Chromium, which trusts a certificate of one's own by its key."""

from __future__ import annotations

import base64
import hashlib
import json
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import serialization

from bufferstand.daq.monitor.encryption import Certificate
from bufferstand.daq.monitor.process import Address, web_process
from tests.desk.served import laboratory
from tests.desk.tab import WIDE
from tests.desk.tab import Tab as DeskTab
from tests.monitor.browser import chromium
from tests.monitor.served import TOKENS, running
from tests.monitor.test_browser import Tab
from tests.monitor.test_encryption import desk, made


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> Certificate:
    return made(tmp_path_factory.mktemp("certificate"))


def trusting(certificate: Certificate) -> str:
    """Return the option by which Chromium takes this certificate, and no other one, for right."""
    key = x509.load_pem_x509_certificate(certificate.chain.read_bytes()).public_key()
    form = serialization.PublicFormat.SubjectPublicKeyInfo
    digest = hashlib.sha256(key.public_bytes(serialization.Encoding.DER, form)).digest()
    return f"--ignore-certificate-errors-spki-list={base64.b64encode(digest).decode()}"


def all_encrypted(tab: Any) -> bool:
    """Whether everything that a tab has asked for was encrypted, its stream of rows included."""
    schemes = {urlsplit(url).scheme for url in tab.requests}
    return schemes <= {"https", "wss", "data", "blob"} and "https" in schemes


def test_the_live_page_over_tls_shows_rows_spans_and_results_and_stops(
    tmp_path: Path, certificate: Certificate
) -> None:
    said: list[str] = []
    address = Address(port=0, certificate=certificate)
    with (
        running(tmp_path) as going,
        web_process(going.case.out, address, said.append, TOKENS, stays=True) as process,
    ):
        origin = f"https://127.0.0.1:{urlsplit(said[0].split()[-1]).port}"
        assert f"{origin}/#{TOKENS.control}" in " ".join(said)
        with (
            chromium(trusting(certificate)) as browser,
            Tab(browser, f"{origin}/#{TOKENS.control}", **WIDE) as it,
        ):
            it.drawn()
            assert any(url.startswith("wss://") for url in it.requests), "rows come by the stream"
            (cookie,) = it.context.cookies()
            assert cookie["secure"]
            assert cookie["httpOnly"]
            it.tab.select_option("#span", "whole")
            it.wait("document.getElementById('trace-said').textContent.includes('since the start')")
            it.tab.click("#write")
            it.tab.fill("#note-text", "encrypted")
            it.tab.click("#note-form button")
            it.wait("document.getElementById('notes').textContent.includes('encrypted')")
            it.tab.click("[data-after=cycle]")
            it.wait("document.getElementById('status').textContent === 'stopped'")
            process.end()
            it.wait("/^\\d+ runs?\\./.test(document.getElementById('evaluating').textContent)")
            it.tab.select_option("#span", "run")
            it.wait("document.getElementById('trace-said').textContent.includes('of the run')")
            assert it.complaints == []
            assert all_encrypted(it)
            it.tab.click("#close")


def test_a_browser_that_does_not_know_the_certificate_shows_nothing(
    tmp_path: Path, certificate: Certificate
) -> None:
    said: list[str] = []
    with web_process(tmp_path, Address(port=0, certificate=certificate), said.append, TOKENS):
        link = next(word for word in " ".join(said).split() if word.startswith("https://"))
        with chromium() as browser, pytest.raises(Exception, match="ERR_CERT"):
            browser.new_page().goto(link)


def test_the_desk_over_tls_starts_a_campaign_and_its_live_page_is_encrypted_too(
    tmp_path: Path, certificate: Certificate
) -> None:
    laboratory(tmp_path)
    (tmp_path / "checklist.toml").write_text('items = ["hall clear"]\n')
    words = ("--address", "127.0.0.1:0", *certificate.words())
    with desk(tmp_path, *words) as (port, token, _), chromium(trusting(certificate)) as browser:
        origin = f"https://127.0.0.1:{port}"
        with DeskTab(browser, f"{origin}/#{token}", **WIDE) as it:
            it.tab.on("websocket", lambda wire: it.requests.append(wire.url))
            it.go(f"{origin}/start?campaign=demo.toml")
            it.says("Peak force")
            it.tab.check("[name=tick]")
            it.tab.fill("#specimen", "A-105-E-01")
            it.tab.check("#simulate")
            it.tab.select_option("#speed", "2")
            it.tab.click("#start")
            it.wait("document.body !== null && Number(document.body.dataset.redraws) > 3")
            live = urlsplit(it.tab.url)
            assert live.scheme == "https"
            assert live.port != port
            it.tab.click("#desk-link")
            it.wait("location.pathname === '/campaign'")
            assert it.tab.url.startswith(f"{origin}/")
            it.wait("document.querySelector('[data-status]').dataset.status === 'running'")
            it.tab.click("[data-after=now]")
            it.wait("document.querySelector('[data-status]').dataset.status === 'stopped'")
            assert it.complaints == []
            assert all_encrypted(it)
            assert any(url.startswith(f"wss://127.0.0.1:{live.port}/") for url in it.requests)
    (record,) = tmp_path.glob("campaigns/*/campaign.json")
    assert json.loads(record.read_text())["stopped_by"] == "operator"
