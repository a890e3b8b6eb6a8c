# SPDX-License-Identifier: MIT
"""The source of a Debian package, of a mirror that does not hold all that it lists."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from metadata import Metadata

# Stands in for the chroot: apt lists three versions, the mirror holds those in $held.
CHROOT = """
bbwarn() { echo "WARNING: $*"; }
bbfatal() { echo "ERROR: $*"; exit 1; }
sdk_run() {
    case "$*" in
    *showsrc*-euc* | *sha256sum*) return 1 ;;
    *showsrc*) printf 'Version: %s\\n' 6.12.9-1 6.12.107-1 6.12.117-1 ;;
    *--download-only*)
        for last; do :; done
        echo "asked $last"
        case " $held " in *" $last "*) return 0 ;; esac
        return 1
        ;;
    esac
}
"""


def fetch(metadata: Metadata, work: Path, held: str) -> tuple[int, list[str]]:
    recipe = metadata.recipes["linux-ecdaq"]
    texts = [f"{n}() {{\n{recipe.value(n)}\n}}" for n in ("download", "fetch_apt_source")]
    script = "\n".join([f"set -e\nheld='{held}'", CHROOT, *texts, "fetch_apt_source"])
    script = script.replace(recipe.value("WORKDIR"), str(work))
    done = subprocess.run(["sh", "-c", script], capture_output=True, text=True, check=False)
    asked = [x.removeprefix("asked ") for x in done.stdout.splitlines() if x.startswith("asked ")]
    return done.returncode, asked


@pytest.mark.parametrize(
    ("held", "asked"),
    [
        ("linux", ["linux"]),
        ("linux/trixie", ["linux", "linux/trixie"]),
        ("linux=6.12.9-1 linux=6.12.107-1", ["linux=6.12.117-1", "linux=6.12.107-1"]),
    ],
    ids=["newest", "suite", "older"],
)
def test_the_newest_source_that_the_mirror_holds_is_taken(
    metadata: Metadata, tmp_path: Path, held: str, asked: list[str]
) -> None:
    code, found = fetch(metadata, tmp_path, held)
    assert code == 0
    assert found[-len(asked) :] == asked


def test_without_any_source_the_build_ends(metadata: Metadata, tmp_path: Path) -> None:
    assert fetch(metadata, tmp_path, "")[0] == 1
