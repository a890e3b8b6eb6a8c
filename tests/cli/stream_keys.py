# SPDX-License-Identifier: MIT
"""Certificates, and an operator with an account and a user, for a nats-server of the tests."""

from __future__ import annotations

import base64
import json
import os
import ssl
import subprocess
from pathlib import Path
from typing import Any

import nkeys

UNLIMITED = -1
JETSTREAM = {"mem_storage": UNLIMITED, "disk_storage": UNLIMITED, "streams": UNLIMITED} | {
    "consumer": UNLIMITED
}
LIMITS = {
    name: UNLIMITED for name in ("subs", "data", "payload", "imports", "exports", "conn", "leaf")
} | {"wildcards": True}


def _openssl(*words: str | Path) -> None:
    subprocess.run(["openssl", *words], check=True, capture_output=True, timeout=60)


def make_certificates(folder: Path) -> dict[str, Path]:
    """Two authorities, "ca" and "other"; a server and a client of "ca"."""
    new = ("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes")
    for name in ("ca", "other"):
        _openssl(
            *new, "-days", "2", "-subj", f"/CN={name}",
            "-keyout", folder / f"{name}.key", "-out", folder / f"{name}.crt",
        )  # fmt: skip
    for name in ("server", "client"):
        _openssl(
            *new, "-days", "2", "-subj", f"/CN={name}", "-addext", "subjectAltName=IP:127.0.0.1",
            "-addext", "basicConstraints=CA:FALSE",
            "-CA", folder / "ca.crt", "-CAkey", folder / "ca.key",
            "-keyout", folder / f"{name}.key", "-out", folder / f"{name}.crt",
        )  # fmt: skip
    return {path.name: path for path in folder.glob("*.[ck][re][ty]")}


def client_context(files: dict[str, Path]) -> ssl.SSLContext:
    context = ssl.create_default_context(cafile=str(files["ca.crt"]))
    context.load_cert_chain(files["client.crt"], files["client.key"])
    return context


def _new(prefix: int) -> nkeys.KeyPair:
    return nkeys.from_seed(nkeys.encode_seed(os.urandom(32), prefix))


def _encode(data: bytes) -> str:
    return base64.urlsafe_b64encode(data).decode().rstrip("=")


def _jwt(issuer: nkeys.KeyPair, subject: str, name: str, claims: dict[str, Any]) -> str:
    head = _encode(json.dumps({"typ": "JWT", "alg": "ed25519-nkey"}).encode())
    body = {"jti": name, "iat": 1, "iss": issuer.public_key.decode(), "name": name}
    text = f"{head}.{_encode(json.dumps(body | {'sub': subject, 'nats': claims}).encode())}"
    return f"{text}.{_encode(issuer.sign(text.encode()))}"


class Operator:
    """The part of a server's configuration that trusts it, and a user's credentials file."""

    def __init__(self, folder: Path) -> None:
        operator = _new(nkeys.PREFIX_BYTE_OPERATOR)
        account = _new(nkeys.PREFIX_BYTE_ACCOUNT)
        system = _new(nkeys.PREFIX_BYTE_ACCOUNT)
        user = _new(nkeys.PREFIX_BYTE_USER)
        key = {k: k.public_key.decode() for k in (operator, account, system, user)}
        own = _jwt(operator, key[operator], "operator", {"type": "operator", "version": 2})
        plain = {"type": "account", "version": 2, "limits": LIMITS}
        claims = plain | {"limits": LIMITS | JETSTREAM}
        accounts = {
            key[account]: _jwt(operator, key[account], "account", claims),
            key[system]: _jwt(operator, key[system], "system", plain),
        }
        preload = "\n".join(f"  {name}: {jwt}" for name, jwt in accounts.items())
        self.config = (
            f"operator: {own}\nsystem_account: {key[system]}\nresolver: MEMORY\n"
            f"resolver_preload {{\n{preload}\n}}\n"
        )
        claims = {"type": "user", "version": 2, "subs": -1, "data": -1, "payload": -1}
        jwt = _jwt(account, key[user], "user", claims)
        self.credentials = folder / "user.creds"
        self.credentials.write_text(
            f"-----BEGIN NATS USER JWT-----\n{jwt}\n------END NATS USER JWT------\n\n"
            f"-----BEGIN USER NKEY SEED-----\n{user.seed.decode()}\n"
            "------END USER NKEY SEED------\n"
        )
