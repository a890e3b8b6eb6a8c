# SPDX-License-Identifier: MIT
"""The bill of materials of a made-up root file system."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import sbom
from conftest import TOP

STATUS = """\
Package: linux-image-ecdaq
Status: install ok installed
Maintainer: The ecdaq project <ecdaq@localhost>
Architecture: arm64
Source: linux-ecdaq
Version: 6.12
Built-Using: linux (= 6.12.107-1)
Description: Linux

Package: ecdaq
Status: install ok installed
Maintainer: The ecdaq project <ecdaq@localhost>
Architecture: arm64
Version: 0.1.0
Built-Using: soem (= 1.4.0)

Package: base-files
Status: install ok installed
Maintainer: Santiago Vila <sanvila@debian.org>
Architecture: arm64
Version: 13.8

Package: libstdc++6
Status: install ok installed
Maintainer: Debian GCC Maintainers <debian-gcc@lists.debian.org>
Architecture: arm64
Source: gcc-14 (14.2.0-19+deb13u1)
Version: 1:14.2.0-19+deb13u1

Package: gone
Status: deinstall ok config-files
Architecture: arm64
Version: 1
"""


@pytest.fixture
def bill(tmp_path: Path) -> dict[str, Any]:
    (tmp_path / "var/lib/dpkg").mkdir(parents=True)
    (tmp_path / "var/lib/dpkg/status").write_text(STATUS)
    text = sbom.spdx(sbom.installed_packages(tmp_path), "image", "0.1.0", 1764547200)
    found: dict[str, Any] = json.loads(text)
    return found


def purls(bill: dict[str, Any], purpose: str = "INSTALL") -> dict[str, str]:
    return {
        p["name"]: p["externalRefs"][0]["referenceLocator"]
        for p in bill["packages"]
        if p["primaryPackagePurpose"] == purpose
    }


def test_the_kernel_has_the_version_of_debians_source(bill: dict[str, Any]) -> None:
    assert purls(bill, "SOURCE")["linux"] == "pkg:deb/debian/linux@6.12.107-1?arch=source"


def test_what_is_compiled_in_is_named(bill: dict[str, Any]) -> None:
    assert purls(bill, "SOURCE")["soem"] == "pkg:generic/soem@1.4.0?arch=source"


def test_every_package_names_its_sources(bill: dict[str, Any]) -> None:
    assert purls(bill, "SOURCE") == {
        "base-files": "pkg:deb/debian/base-files@13.8?arch=source",
        "ecdaq": "pkg:generic/ecdaq@0.1.0?arch=source",
        "gcc-14": "pkg:deb/debian/gcc-14@14.2.0-19%2Bdeb13u1?arch=source",
        "linux": "pkg:deb/debian/linux@6.12.107-1?arch=source",
        "linux-ecdaq": "pkg:generic/linux-ecdaq@6.12?arch=source",
        "soem": "pkg:generic/soem@1.4.0?arch=source",
    }
    names = {p["SPDXID"]: p["name"] for p in bill["packages"]}
    assert len(names) == len(bill["packages"])
    made_of = [
        (names[r["spdxElementId"]], names[r["relatedSpdxElement"]])
        for r in bill["relationships"]
        if r["relationshipType"] == "GENERATED_FROM"
    ]
    assert sorted(made_of) == [
        ("base-files", "base-files"),
        ("ecdaq", "ecdaq"),
        ("ecdaq", "soem"),
        ("libstdc++6", "gcc-14"),
        ("linux-image-ecdaq", "linux"),
        ("linux-image-ecdaq", "linux-ecdaq"),
    ]


def test_only_debians_packages_are_called_debians(bill: dict[str, Any]) -> None:
    assert purls(bill) == {
        "base-files": "pkg:deb/debian/base-files@13.8?arch=arm64",
        "ecdaq": "pkg:generic/ecdaq@0.1.0?arch=arm64",
        "libstdc++6": "pkg:deb/debian/libstdc%2B%2B6@1:14.2.0-19%2Bdeb13u1?arch=arm64",
        "linux-image-ecdaq": "pkg:generic/linux-image-ecdaq@6.12?arch=arm64",
    }


def test_the_packages_name_what_is_compiled_in() -> None:
    control = (TOP / "recipes/recipes-app/ecdaq/files/debian/control").read_text()
    assert "Built-Using: soem (= ${soem:Version})" in control
    rules = (TOP / "recipes/recipes-app/ecdaq/files/debian/rules").read_text()
    assert "-Vsoem:Version=" in rules
    kernel = (TOP / "layers/meta-local/classes/linux-kernel.bbclass").read_text()
    assert "Built-Using: ${APT_SOURCE} (= $source_version)" in kernel
