# SPDX-License-Identifier: MIT
"""DDS Security with the keys that `ecdaq security` creates."""

from __future__ import annotations

import re
from pathlib import Path

from ecdaq.errors import LinkError

# As app/services/keystore names them.
KEY_FILES = (
    "identity_ca.cert.pem",
    "cert.pem",
    "key.pem",
    "governance.p7s",
    "permissions_ca.cert.pem",
    "permissions.p7s",
)


def plugin_folder() -> Path:
    """The directory of the DDS Security plug-ins of the loaded libddsc."""
    maps = Path("/proc/self/maps").read_text()
    for library in dict.fromkeys(re.findall(r"(/\S*/libddsc[^/\s]*)$", maps, re.MULTILINE)):
        folder = Path(library).parent
        for found in [folder, *folder.glob("libddsc*")]:
            if (found / "libdds_security_auth.so").exists():
                return found
    raise LinkError(
        "this cyclonedds was built without DDS Security, like that of PyPI: use a C program with "
        "Debian's Cyclone DDS (app/doc/reference/dds.md)"
    )


def security_config(keys: Path) -> str:
    """The XML that uses the keys in a directory created by `ecdaq security`."""
    folder = keys.resolve()
    missing = [name for name in KEY_FILES if not (folder / name).is_file()]
    if missing:
        raise LinkError(f"{folder / missing[0]}: no such file: is this a participant's directory?")
    if re.search(r"[<>&\"'${}]", str(folder)):
        raise ValueError(f"{folder}: the path must not contain < > & $ {{ }} or quotes")
    plugins = plugin_folder()

    def library(file: str, function: str) -> str:
        return (
            f'<Library path="{plugins}/libdds_security_{file}.so" initFunction="init_{function}" '
            f'finalizeFunction="finalize_{function}"/>'
        )

    def element(name: str, file: str) -> str:
        return f"<{name}>file:{folder}/{file}</{name}>"

    ca, cert, key, governance, permissions_ca, permissions = KEY_FILES
    return (
        "<Security><Authentication>"
        + library("auth", "authentication")
        + element("IdentityCA", ca)
        + element("IdentityCertificate", cert)
        + element("PrivateKey", key)
        + "</Authentication><AccessControl>"
        + library("ac", "access_control")
        + element("PermissionsCA", permissions_ca)
        + element("Governance", governance)
        + element("Permissions", permissions)
        + "</AccessControl><Cryptographic>"
        + library("crypto", "crypto")
        + "</Cryptographic></Security>"
    )
