# SPDX-License-Identifier: MIT
"""Package list and bill of materials (SPDX 2.3, JSON) of a Debian root file system."""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import quote

DEP5 = re.compile(r"^Format:.*copyright-format", re.MULTILINE)
BUILT_USING = re.compile(r"(\S+) \(= ([^)]+)\)")
LICENSE = re.compile(r"^License:[ \t]*(\S[^\n]*)$", re.MULTILINE)


@dataclass(frozen=True)
class Package:
    """One installed package, as dpkg knows it."""

    name: str
    version: str
    architecture: str
    source: str
    source_version: str
    maintainer: str
    homepage: str
    licenses: tuple[str, ...]
    # Name and version of sources that are in its files though no package of theirs is installed.
    built_using: tuple[tuple[str, str], ...]


def _stanza(text: str) -> dict[str, str]:
    fields: dict[str, str] = {}
    for line in text.splitlines():
        name, colon, value = line.partition(":")
        if colon and not line.startswith((" ", "\t")):
            fields[name] = value.strip()
    return fields


def _licenses(rootfs: Path, package: str) -> tuple[str, ...]:
    """The licences that a machine-readable copyright file names; none where it is prose."""
    path = rootfs / "usr/share/doc" / package / "copyright"
    if not path.exists():
        return ()
    text = path.read_text(errors="replace")
    return tuple(sorted(set(LICENSE.findall(text)))) if DEP5.search(text) else ()


def installed_packages(rootfs: Path) -> list[Package]:
    """All packages with status "installed", by name."""
    packages = []
    for block in (rootfs / "var/lib/dpkg/status").read_text().split("\n\n"):
        fields = _stanza(block)
        if not fields.get("Status", "").endswith(" installed"):
            continue
        source, _, rest = fields.get("Source", fields["Package"]).partition(" ")
        packages.append(
            Package(
                name=fields["Package"],
                version=fields["Version"],
                architecture=fields["Architecture"],
                source=source,
                source_version=rest.strip("()") or fields["Version"],
                maintainer=fields.get("Maintainer", ""),
                homepage=fields.get("Homepage", ""),
                licenses=_licenses(rootfs, fields["Package"]),
                built_using=tuple(BUILT_USING.findall(fields.get("Built-Using", ""))),
            )
        )
    return sorted(packages, key=lambda p: (p.name, p.architecture))


def manifest(packages: list[Package]) -> str:
    """One line a package: name, architecture, version, source and its version."""
    return "".join(
        f"{p.name}\t{p.architecture}\t{p.version}\t{p.source}\t{p.source_version}\n"
        for p in packages
    )


def _is_debians(package: Package) -> bool:
    """What our recipes make is not Debian's, whatever its name."""
    return not package.maintainer.endswith("@localhost>")


def _purl(name: str, version: str, architecture: str, debians: bool) -> str:
    kind = "deb/debian" if debians else "generic"
    name, version = quote(name, safe=""), quote(version, safe=":")
    return f"pkg:{kind}/{name}@{version}?arch={architecture}"


def _id(*words: str) -> str:
    return "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", "-".join(words))


def _entry(package: Package) -> dict[str, object]:
    known = "; ".join(package.licenses)
    return {
        "SPDXID": _id(package.name),
        "name": package.name,
        "versionInfo": package.version,
        "supplier": f"Person: {package.maintainer}" if package.maintainer else "NOASSERTION",
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        "homepage": package.homepage or "NOASSERTION",
        "licenseConcluded": "NOASSERTION",
        "licenseDeclared": "NOASSERTION",
        "licenseComments": (
            f"debian/copyright names: {known}"
            if known
            else f"see usr/share/doc/{package.name}/copyright in the image"
        ),
        "copyrightText": "NOASSERTION",
        "primaryPackagePurpose": "INSTALL",
        "externalRefs": [
            {
                "referenceCategory": "PACKAGE-MANAGER",
                "referenceType": "purl",
                "referenceLocator": _purl(
                    package.name, package.version, package.architecture, _is_debians(package)
                ),
            }
        ],
    }


def _source_entry(name: str, version: str, debians: bool) -> dict[str, object]:
    return {
        "SPDXID": _id("source", name, version),
        "name": name,
        "versionInfo": version,
        "supplier": "NOASSERTION",
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        "licenseConcluded": "NOASSERTION",
        "licenseDeclared": "NOASSERTION",
        "copyrightText": "NOASSERTION",
        "primaryPackagePurpose": "SOURCE",
        "externalRefs": [
            {
                "referenceCategory": "PACKAGE-MANAGER",
                "referenceType": "purl",
                "referenceLocator": _purl(name, version, "source", debians),
            }
        ],
    }


def _sources(package: Package) -> list[tuple[str, str, bool]]:
    """Name and version of each source that a package is made of, and whether it is Debian's."""
    # Of what is compiled in, only a source with a Debian revision is Debian's.
    compiled_in = [(name, version, "-" in version) for name, version in package.built_using]
    return [(package.source, package.source_version, _is_debians(package)), *compiled_in]


def _relation(element: object, kind: str, other: object) -> dict[str, object]:
    return {"spdxElementId": element, "relationshipType": kind, "relatedSpdxElement": other}


def spdx(packages: list[Package], name: str, version: str, epoch: int) -> str:
    """The document; equal packages give equal bytes."""
    digest = hashlib.sha256(manifest(packages).encode()).hexdigest()
    entries = [_entry(p) for p in packages]
    # Vulnerabilities of Debian are listed by source.
    sources = [_source_entry(*s) for s in sorted({s for p in packages for s in _sources(p)})]
    document = {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": f"{name}-{version}",
        "documentNamespace": f"urn:ecdaq:sbom:{name}:{digest}",
        "creationInfo": {
            "created": datetime.fromtimestamp(epoch, UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
            "creators": ["Tool: ecdaq-image"],
        },
        "packages": [*entries, *sources],
        "relationships": [
            *(_relation("SPDXRef-DOCUMENT", "DESCRIBES", e["SPDXID"]) for e in entries),
            *(
                _relation(e["SPDXID"], "GENERATED_FROM", _id("source", name, version))
                for e, p in zip(entries, packages, strict=True)
                for name, version, _ in _sources(p)
            ),
        ],
    }
    return json.dumps(document, indent=1) + "\n"
