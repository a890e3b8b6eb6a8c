# SPDX-License-Identifier: MIT
"""HTTPS of ecdaq-web: with a certificate made here, by Python's TLS client."""

from __future__ import annotations

import http.client
import json
import os
import shutil
import ssl
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from ecdaq import BIN, CONFIG, Fake, json_of
from web_bench import Web, free_port
from web_client import RejectedError, WebSocket
from web_client import http as plain_http
from web_session import WebCommand

LED = "piccolo0.led"
MakeWeb = Callable[..., Web]


@pytest.fixture
def certificate(tmp_path: Path) -> Path:
    """A folder with web.pem and web.key, for 127.0.0.1."""
    if not shutil.which("openssl"):
        pytest.skip("no openssl here: it makes the certificate")
    folder = tmp_path / "tls"
    folder.mkdir()
    for name in ("web", "other"):
        subprocess.run(
            ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256",
             "-nodes", "-days", "2", "-subj", "/CN=ecdaq", "-addext", "subjectAltName=IP:127.0.0.1",
             "-keyout", folder / f"{name}.key", "-out", folder / f"{name}.pem"],
            check=True, capture_output=True,
        )  # fmt: skip
    return folder


def settings(folder: Path, key: str = "web") -> dict[str, str]:
    return {
        "web.certificate": str(folder / "web.pem"),
        "web.key": str(folder / f"{key}.key"),
    }


def ask(
    web: Web, folder: Path, method: str, path: str, body: str | None = None, **headers: str
) -> tuple[int, str, str]:
    """Status, text and cookie of the answer to a client that verifies the certificate."""
    context = ssl.create_default_context(cafile=str(folder / "web.pem"))
    connection = http.client.HTTPSConnection("127.0.0.1", web.port, timeout=20, context=context)
    own = {"Origin": f"https://127.0.0.1:{web.port}"} | headers
    connection.request(method, path, body=body, headers=own)
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    return answer.status, text, answer.headers.get("Set-Cookie", "")


def test_log_in_and_commands_work_on_any_address_with_a_secure_cookie(
    daemon: Fake, make_web: MakeWeb, web_command: WebCommand, certificate: Path
) -> None:
    web = make_web(**settings(certificate), web_listen="0.0.0.0")
    status, text, _ = ask(web, certificate, "GET", "/")
    assert (status, "<title>ecdaq</title>" in text) == (200, True)
    token = web_command.token("operator")
    wrong = {"Origin": f"http://127.0.0.1:{web.port}"}
    assert ask(web, certificate, "POST", "/login", token, **wrong)[0] == 403
    status, text, cookie = ask(web, certificate, "POST", "/login", token)
    assert status == 200
    assert set(cookie.split("; ")[1:]) == {"Path=/", "HttpOnly", "SameSite=Strict", "Secure"}
    body = "\n".join([json.loads(text)["secret"], "set", LED, "1"])
    fields = {"Cookie": cookie.split("; ")[0]}
    status, text, _ = ask(web, certificate, "POST", "/command", body, **fields)
    assert (status, json.loads(text)["raw"]) == (200, {LED: 1})
    assert json_of(daemon("watch", LED, "--count", "1", "--json"))["values"] == {LED: 1}


def test_without_tls_its_port_has_one_line_and_nothing_else(
    make_web: MakeWeb, web_command: WebCommand, certificate: Path
) -> None:
    web = make_web(**settings(certificate))
    token = web_command.token("operator")
    for request in ("GET /", "GET /metrics", "GET /recordings/a.mcap", "POST /login"):
        body = token if request.startswith("POST") else ""
        fields = {"Origin": f"http://127.0.0.1:{web.port}", "Content-Length": str(len(body))}
        status, headers, text = plain_http(web.port, request, body=body, **fields)
        assert (status, text.decode()) == (403, "this port has TLS only: https://, wss://\n")
        assert "set-cookie" not in headers
    for protocol in ("ecdaq.page.v1", "foxglove.sdk.v1"):
        with pytest.raises(RejectedError):
            WebSocket(web.port, (protocol,))
    assert ask(web, certificate, "POST", "/login", token)[0] == 200


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"web.key": ""}, "web.key: is required with web.certificate"),
        ({"web.certificate": ""}, "web.key: is required with web.certificate"),
        ({"web.certificate": "{}/none.pem"}, "web.certificate: {}/none.pem: No such file"),
        ({"web.key": "{}/none.key"}, "web.key: {}/none.key: No such file"),
        ({"web.key": "{}"}, "web.key: {}: is no regular file"),
        ({"web.key": "{}/other.key"}, "web.certificate, web.key: no certificate and its key"),
        ({"web.key": "{}/web.pem"}, "web.certificate, web.key: no certificate and its key"),
        ({"web.certificate": "{}/web.key"}, "web.certificate, web.key: no certificate and its key"),
    ],
)
def test_what_is_no_certificate_and_its_key_is_one_clear_error(
    run_dir: Path, certificate: Path, changes: dict[str, str], why: str
) -> None:
    given = settings(certificate) | {"web.enable": "on", "web.port": str(free_port())} | changes
    words = [f"--set={name}={value.format(certificate)}" for name, value in given.items()]
    # libwebsockets 4.1 does not free all of a context that it could not make.
    environment = os.environ | {"ASAN_OPTIONS": "detect_leaks=0"}
    done = subprocess.run(
        [BIN / "ecdaq-web", "--run-dir", run_dir, *words], env=environment,
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == CONFIG, done.stderr
    assert why.format(certificate) in done.stderr.splitlines()[-1]
