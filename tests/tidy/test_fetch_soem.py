# SPDX-License-Identifier: MIT
"""fetch-soem.sh unpacks what the lock file pins, once; an error is one line with its reason."""

from __future__ import annotations

import hashlib
import io
import os
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest
from project import ROOT

SCRIPT = ROOT / "app" / "third_party" / "fetch-soem.sh"
TOP = "pysoem-9.9.9"
PATCH = """Count from two, as the data sheet has it;
one is the reserved value.
--- a/soem/main.c
+++ b/soem/main.c
@@ -1,2 +1,2 @@
-int count = 1;
+int count = 2;
 int end;
"""


class Place:
    """A lock file, a folder of patches, a target and a cache, all in a folder of the test."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.archive = root / f"{TOP}.tar.gz"
        self.target = root / "soem"
        self.patches = root / "patches"
        self.patches.mkdir()
        self.write_archive("int count = 1;\r\nint end;\r\n")
        self.write_lock(hashlib.sha256(self.archive.read_bytes()).hexdigest())

    def write_archive(self, main_c: str) -> None:
        files = {
            "soem/soem/main.c": main_c,
            "soem/soem/main.h": "\r\n",
            "soem/osal/osal.h": "\r\n",
            "soem/osal/linux/osal.c": "",
            "soem/oshw/win32/wpcap/pcap.h": "",
            "setup.py": "raise SystemExit('setup.py was run')\n",
        }
        with tarfile.open(self.archive, "w:gz") as archive:
            for name, text in files.items():
                entry = tarfile.TarInfo(f"{TOP}/{name}")
                entry.size = len(text)
                archive.addfile(entry, io.BytesIO(text.encode()))

    def write_lock(self, sha256: str) -> None:
        lines = [
            "package = pysoem",
            "version = 9.9.9",
            f"file = {TOP}.tar.gz",
            f"sha256 = {sha256}",
        ]
        (self.root / "soem.lock").write_text("\n".join(lines) + "\n")

    def fetch(self, *arguments: str | Path, **env: str) -> subprocess.CompletedProcess[str]:
        places = {
            "ECDAQ_SOEM_TARGET": str(self.target),
            "ECDAQ_SOEM_LOCK": str(self.root / "soem.lock"),
            "ECDAQ_SOEM_PATCHES": str(self.patches),
            "ECDAQ_SOEM_ARCHIVE": "",
            "XDG_CACHE_HOME": str(self.root / "cache"),
            "PYTHON": sys.executable,
        }
        return subprocess.run(
            [SCRIPT, *arguments],
            env=os.environ | places | env,
            capture_output=True,
            text=True,
            check=False,
        )


@pytest.fixture
def place(tmp_path: Path) -> Place:
    return Place(tmp_path)


def expect_one_line(result: subprocess.CompletedProcess[str], *parts: str) -> None:
    assert result.returncode == 1, result.stderr
    assert result.stderr.startswith("fetch-soem: ")
    assert result.stderr.count("\n") == 1, result.stderr
    for part in parts:
        assert part in result.stderr


def test_only_what_is_built_is_unpacked_with_unix_line_ends(place: Place) -> None:
    result = place.fetch("--archive", place.archive)
    assert result.returncode == 0, result.stderr
    unpacked = {str(p.relative_to(place.target)) for p in place.target.rglob("*") if p.is_file()}
    assert unpacked == {"soem/main.c", "soem/main.h", "osal/osal.h", ".stamp"}
    assert (place.target / "soem/main.c").read_bytes() == b"int count = 1;\nint end;\n"


def test_a_second_run_does_nothing(place: Place) -> None:
    assert place.fetch("--archive", place.archive).returncode == 0
    before = (place.target / ".stamp").stat().st_ino
    place.archive.unlink()
    assert place.fetch("--archive", place.archive).returncode == 0
    assert (place.target / ".stamp").stat().st_ino == before


def test_after_a_new_patch_the_sources_are_unpacked_again_and_patched(place: Place) -> None:
    assert place.fetch("--archive", place.archive).returncode == 0
    (place.patches / "0001-count-from-two.patch").write_text(PATCH)
    assert place.fetch("--archive", place.archive).returncode == 0
    assert (place.target / "soem/main.c").read_text().startswith("int count = 2;")


def test_a_patch_that_does_not_apply_is_named_and_nothing_is_touched(place: Place) -> None:
    assert place.fetch("--archive", place.archive).returncode == 0
    (place.patches / "0001-no.patch").write_text(PATCH.replace("count = 1", "other = 1"))
    expect_one_line(place.fetch("--archive", place.archive), "0001-no.patch does not apply")
    assert (place.target / "soem/main.c").read_text().startswith("int count = 1;")
    assert not list(place.root.glob(".soem-*"))


def test_an_archive_with_another_hash_is_refused(place: Place) -> None:
    place.write_lock("0" * 64)
    found = hashlib.sha256(place.archive.read_bytes()).hexdigest()
    expect_one_line(place.fetch("--archive", place.archive), "SHA-256", found, "0" * 64)
    assert not place.target.exists()


def test_a_registry_that_gives_another_archive_is_refused(place: Place) -> None:
    shelf = place.root / "shelf"
    shelf.mkdir()
    place.archive.rename(shelf / place.archive.name)
    place.write_lock("0" * 64)
    result = place.fetch(PIP_NO_INDEX="1", PIP_FIND_LINKS=str(shelf))
    expect_one_line(result, "another SHA-256")
    assert not place.target.exists()


def test_the_archive_is_fetched_without_running_anything_of_it(place: Place) -> None:
    # pip would ask setup.py for the metadata.
    shelf = place.root / "shelf"
    shelf.mkdir()
    place.archive.rename(shelf / place.archive.name)
    result = place.fetch(PIP_NO_INDEX="1", PIP_FIND_LINKS=str(shelf))
    assert result.returncode == 0, result.stderr
    assert (place.root / "cache/ecdaq" / place.archive.name).is_file()
    assert (place.target / "soem/main.c").is_file()


def test_an_unreachable_registry_is_reported(place: Place) -> None:
    nowhere = "http://127.0.0.1:9/simple"
    result = place.fetch(
        PIP_INDEX_URL=nowhere, PIP_FIND_LINKS="", PIP_RETRIES="0", PIP_CONFIG_FILE=os.devnull
    )
    expect_one_line(result, "cannot download pysoem 9.9.9", "--archive FILE")
    assert not place.target.exists()


def test_a_python_without_pip_is_reported(place: Place) -> None:
    expect_one_line(place.fetch(PYTHON="/bin/false"), "has no pip")


def test_a_missing_tool_is_named(place: Place) -> None:
    tools = place.root / "bin"
    tools.mkdir()
    (tools / "dirname").symlink_to("/usr/bin/dirname")
    expect_one_line(place.fetch("--archive", place.archive, PATH=str(tools)), "patch is not")


def test_a_damaged_archive_is_reported(place: Place) -> None:
    place.archive.write_bytes(place.archive.read_bytes()[:60])
    place.write_lock(hashlib.sha256(place.archive.read_bytes()).hexdigest())
    result = place.fetch("--archive", place.archive)
    assert result.returncode == 1
    assert "cannot unpack" in result.stderr.splitlines()[-1]


def test_a_missing_archive_or_lock_value_is_named(place: Place) -> None:
    expect_one_line(place.fetch("--archive", "/nowhere.tar.gz"), "/nowhere.tar.gz: no such file")
    (place.root / "soem.lock").write_text("package = pysoem\n")
    expect_one_line(place.fetch("--archive", place.archive), "no value for 'version'")


def test_an_unknown_argument_is_named(place: Place) -> None:
    expect_one_line(place.fetch("--fast"), "'--fast'")
