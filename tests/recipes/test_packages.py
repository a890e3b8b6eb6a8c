# SPDX-License-Identifier: MIT
"""Everything that the build installs is in one of the Debian packages."""

from __future__ import annotations

import os
import subprocess
from fnmatch import fnmatch
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
STAGE = Path(os.environ.get("ECDAQ_STAGE", TOP / "build" / "stage"))
PACKAGES = TOP / "recipes" / "recipes-app" / "ecdaq" / "files" / "debian"


def patterns() -> list[str]:
    return [
        line for file in sorted(PACKAGES.glob("*.install")) for line in file.read_text().split()
    ]


def packaged_path(file: Path) -> str:
    """Where debian/rules installs what the plain build installs as @file."""
    path = str(file.relative_to(STAGE))
    if path.startswith("lib/") and not path.startswith("lib/ecdaq/"):
        return "usr/lib/triplet/" + path.removeprefix("lib/")
    return "usr/" + path.replace("lib/ecdaq/", "lib/triplet/ecdaq/", 1)


def is_packaged(path: str, wanted: list[str]) -> bool:
    """As dh_install has it: a pattern that names a directory takes all below it."""
    return any(fnmatch(path, pattern) or path.startswith(pattern + "/") for pattern in wanted)


def test_every_installed_file_is_in_a_package() -> None:
    """dh_missing ends the image's build otherwise, a quarter of an hour later."""
    files = [f for f in STAGE.rglob("*") if f.is_file()]
    assert len(files) > 30
    wanted = patterns()
    missing = [p for p in map(packaged_path, files) if not is_packaged(p, wanted)]
    assert not missing


def test_a_file_that_no_package_lists_is_found() -> None:
    assert not is_packaged("usr/lib/triplet/cmake/other/a.cmake", patterns())
    assert is_packaged("usr/bin/ecdaq-log", patterns())


def test_cross_compiling_without_a_way_to_run_the_programs_is_refused(tmp_path: Path) -> None:
    """They write their completion and manual pages: an empty page must not be installed."""
    machine = ["-DCMAKE_SYSTEM_NAME=Linux", "-DCMAKE_SYSTEM_PROCESSOR=aarch64"]
    done = subprocess.run(
        ["cmake", "-S", TOP / "app", "-B", tmp_path, "-DECDAQ_TESTS=OFF", *machine],
        capture_output=True,
        text=True,
        check=False,
    )
    said = " ".join(done.stderr.split())
    assert done.returncode != 0 and "set CMAKE_CROSSCOMPILING_EMULATOR" in said, said
    rules = (PACKAGES / "rules").read_text()
    assert "-DCMAKE_CROSSCOMPILING_EMULATOR=" in rules
