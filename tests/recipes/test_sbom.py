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


def purls(bill: dict[str, Any]) -> dict[str, str]:
    return {p["name"]: p["externalRefs"][0]["referenceLocator"] for p in bill["packages"]}


def test_the_kernel_has_the_version_of_debians_source(bill: dict[str, Any]) -> None:
    assert purls(bill)["linux"] == "pkg:deb/debian/linux@6.12.107-1?arch=source"


def test_what_is_compiled_in_is_named(bill: dict[str, Any]) -> None:
    assert purls(bill)["soem"] == "pkg:generic/soem@1.4.0?arch=source"
    made_of = {
        (r["spdxElementId"], r["relatedSpdxElement"])
        for r in bill["relationships"]
        if r["relationshipType"] == "GENERATED_FROM"
    }
    assert made_of == {
        ("SPDXRef-linux-image-ecdaq", "SPDXRef-source-linux"),
        ("SPDXRef-ecdaq", "SPDXRef-source-soem"),
    }


def test_only_debians_packages_are_called_debians(bill: dict[str, Any]) -> None:
    found = purls(bill)
    assert found["base-files"] == "pkg:deb/debian/base-files@13.8?arch=arm64"
    assert found["ecdaq"] == "pkg:generic/ecdaq@0.1.0?arch=arm64"
    assert "gone" not in found


def test_the_packages_name_what_is_compiled_in() -> None:
    control = (TOP / "recipes/recipes-app/ecdaq/files/debian/control").read_text()
    assert "Built-Using: soem (= ${soem:Version})" in control
    rules = (TOP / "recipes/recipes-app/ecdaq/files/debian/rules").read_text()
    assert "-Vsoem:Version=" in rules
    kernel = (TOP / "layers/meta-local/classes/linux-kernel.bbclass").read_text()
    assert "Built-Using: ${APT_SOURCE} (= $source_version)" in kernel
