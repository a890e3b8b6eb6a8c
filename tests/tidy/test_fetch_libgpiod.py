# SPDX-License-Identifier: MIT
"""fetch-libgpiod.sh unpacks what the lock file pins, once; an error is one line with its reason."""

from __future__ import annotations

import hashlib
import io
import os
import subprocess
import tarfile
from pathlib import Path

from project import ROOT

SCRIPT = ROOT / "app" / "third_party" / "fetch-libgpiod.sh"
TOP = "gpiod-9.9.9"


def place(folder: Path, sha256: str | None = None) -> dict[str, str]:
    """An archive, a lock file that names it, and a target: as the script's environment."""
    archive = folder / f"{TOP}.tar.gz"
    with tarfile.open(archive, "w:gz") as file:
        for name in ("lib/chip.c", "include/gpiod.h", "LICENSE", "setup.py"):
            entry = tarfile.TarInfo(f"{TOP}/{name}")
            entry.size = 3
            file.addfile(entry, io.BytesIO(b"xyz"))
    digest = sha256 or hashlib.sha256(archive.read_bytes()).hexdigest()
    lock = folder / "libgpiod.lock"
    lock.write_text(f"package = gpiod\nversion = 9.9.9\nfile = {archive.name}\nsha256 = {digest}\n")
    return {
        "ECDAQ_LIBGPIOD_ARCHIVE": str(archive),
        "ECDAQ_LIBGPIOD_LOCK": str(lock),
        "ECDAQ_LIBGPIOD_TARGET": str(folder / "libgpiod"),
    }


def fetch(settings: dict[str, str], *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [SCRIPT, *words], env=os.environ | settings, capture_output=True, text=True, check=False
    )


def test_the_library_is_unpacked_and_nothing_else(tmp_path: Path) -> None:
    settings = place(tmp_path)
    result = fetch(settings, "--force")
    assert (result.returncode, result.stderr) == (0, "")
    target = tmp_path / "libgpiod"
    assert sorted(p.name for p in target.iterdir()) == [".stamp", "LICENSE", "include", "lib"]
    Path(settings["ECDAQ_LIBGPIOD_ARCHIVE"]).unlink()
    assert fetch(settings).returncode == 0  # nothing to do: nothing is read


def test_another_archive_than_the_locked_one_is_refused(tmp_path: Path) -> None:
    result = fetch(place(tmp_path, "0" * 64), "--force")
    assert result.returncode == 1
    assert result.stderr.startswith("fetch-libgpiod: ") and result.stderr.count("\n") == 1
    assert "SHA-256" in result.stderr
    assert not (tmp_path / "libgpiod").exists()


def test_a_missing_archive_and_a_wrong_word_are_one_line(tmp_path: Path) -> None:
    settings = place(tmp_path) | {"ECDAQ_LIBGPIOD_ARCHIVE": str(tmp_path / "none")}
    result = fetch(settings, "--force")
    assert result.returncode == 1 and "none: no such file" in result.stderr
    result = fetch(settings, "--nonsense")
    assert result.returncode == 1 and "--nonsense" in result.stderr
