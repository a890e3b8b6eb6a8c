# SPDX-License-Identifier: MIT
"""The packages for arm64: the files of those for amd64; installed, and their programs started.

A group of its own: the cross compiler's tree takes minutes to make.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from conftest import Machine

TRIPLETS = {"amd64": "x86_64-linux-gnu", "arm64": "aarch64-linux-gnu"}
PACKAGES = ["ecdaq", "ecdaq-sim", "libecdaq-dev", "libecdaq1", "python3-ecdaq"]
PROGRAMS = ["ecdaq", "ecdaqd", "ecdaq-dds", "ecdaq-record", "ecdaq-sim", "ecdaq-stream"]
PROGRAMS += ["ecdaq-sync0", "ecdaq-uplink", "ecdaq-web", "ecdaq-web-command"]


def deb(packages: Path, arch: str, name: str) -> Path:
    folder = "new" if arch == "amd64" else arch
    (file,) = (packages / folder).glob(f"{name}_*_{arch}.deb")
    return file


def dpkg_deb(option: str, file: Path, *more: str) -> str:
    return subprocess.run(
        ["dpkg-deb", option, file, *more], capture_output=True, text=True, check=True
    ).stdout


def contents(packages: Path, arch: str, name: str) -> list[str]:
    """Mode, owner and path of each file, without what names the processor."""
    lines = dpkg_deb("--contents", deb(packages, arch, name)).splitlines()
    fields = [line.split(maxsplit=5) for line in lines]
    return sorted(re.sub(TRIPLETS[arch], "TRIPLET", " ".join([f[0], f[1], f[5]])) for f in fields)


def relations(packages: Path, arch: str, name: str) -> list[str]:
    """What it depends on and recommends; minimum versions of symbols differ between processors."""
    file = deb(packages, arch, name)
    text = dpkg_deb("--field", file, "Depends", "Recommends", "Version")
    return sorted(re.sub(r" \(>= [^)]*\)", "", text).replace("\n", ", ").split(", "))


@pytest.mark.parametrize("name", PACKAGES)
def test_a_package_has_the_files_and_relations_of_the_one_for_amd64(
    arm64_packages: Path, name: str
) -> None:
    packages = arm64_packages
    assert dpkg_deb("--field", deb(packages, "arm64", name), "Architecture").strip() == "arm64"
    assert contents(packages, "arm64", name) == contents(packages, "amd64", name)
    assert relations(packages, "arm64", name) == relations(packages, "amd64", name)


def test_all_that_is_compiled_is_for_arm64(arm64_packages: Path, tmp_path: Path) -> None:
    found = []
    for name in PACKAGES:
        dpkg_deb("--extract", deb(arm64_packages, "arm64", name), str(tmp_path))
    for file in (f for f in tmp_path.rglob("*") if f.is_file() and not f.is_symlink()):
        head = file.read_bytes()[:20]
        if head.startswith(b"\x7fELF"):
            found.append(file.name)
            # e_machine: EM_AARCH64
            assert int.from_bytes(head[18:20], "little") == 183, file
    assert {*PROGRAMS, "libecdaq.so.1.0.1.0"} <= set(found)
    assert any(name.startswith("_clayer") for name in found)


def test_pages_and_completion_are_those_of_amd64(arm64_packages: Path, tmp_path: Path) -> None:
    """Programs write them during the build: here, those for another processor."""
    texts = []
    for arch in TRIPLETS:
        for name in PACKAGES:
            dpkg_deb("--extract", deb(arm64_packages, arch, name), str(tmp_path / arch))
        share = tmp_path / arch / "usr/share"
        pages = [f for f in (share / "man").rglob("*") if f.is_file()]
        pages.append(share / "bash-completion/completions/ecdaq")
        texts.append({f.relative_to(share): f.read_bytes() for f in pages})
    assert len(texts[0]) > 30
    assert texts[0] == texts[1]


def test_packages_are_installed_and_programs_start(arm64_machine: Machine) -> None:
    machine = arm64_machine
    machine.run("apt-get install -q -y --no-install-recommends /mnt/arm64/*.deb")
    status = machine.run("dpkg-query --show --showformat='${Package}:${Architecture}\\n'").split()
    assert {f"{name}:arm64" for name in PACKAGES} <= set(status)
    for program in PROGRAMS:
        assert machine.run(f"{program} --version").startswith(f"{program} ")
    assert "valid" in machine.run("ecdaqd --check --config /etc/ecdaq/ecdaq.yaml")
    assert "ecdaq-read" in machine.run("id --name --groups ecdaqd")


def test_python_loads_the_binding_of_dds(arm64_machine: Machine) -> None:
    said = arm64_machine.run(
        "python3 -c 'import platform, ecdaq.link, ecdaq.mcap_file; print(platform.machine())'"
    )
    assert said == "aarch64"
    assert "usage: ecdaq-remote" in arm64_machine.run("ecdaq-remote --help")
