# SPDX-License-Identifier: MIT
"""DDS Security, with the keys that `ecdaq security` makes."""

from __future__ import annotations

import re
from pathlib import Path

from ecdaq.errors import LinkError

# As app/services/keystore makes them.
KEY_FILES = (
    "identity_ca.cert.pem",
    "cert.pem",
    "key.pem",
    "governance.p7s",
    "permissions_ca.cert.pem",
    "permissions.p7s",
)


def plugin_folder() -> Path:
    """Where the DDS Security plug-ins of the libddsc that we have loaded are."""
    maps = Path("/proc/self/maps").read_text()
    for library in dict.fromkeys(re.findall(r"(/\S*/libddsc[^/\s]*)$", maps, re.MULTILINE)):
        folder = Path(library).parent
        for found in [folder, *folder.glob("libddsc*")]:
            if (found / "libdds_security_auth.so").exists():
                return found
    raise LinkError(
        "this cyclonedds was built without DDS Security, as that of PyPI is; a program in C with "
        "Debian's Cyclone DDS can join (app/doc/reference/dds.md)"
    )


def security_config(keys: Path) -> str:
    """Use the keys in a folder that `ecdaq security` made."""
    folder = keys.resolve()
    missing = [name for name in KEY_FILES if not (folder / name).is_file()]
    if missing:
        raise LinkError(f"{folder / missing[0]}: not there: is this a folder of a participant?")
    if re.search(r"[<>&\"'${}]", str(folder)):
        raise ValueError(f"{folder}: a path without < > & $ {{ }} and quotes is wanted")
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
