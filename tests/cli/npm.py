# SPDX-License-Identifier: MIT
"""Packages of the npm registry that tests use: pinned with their hashes, installed once."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
from pathlib import Path

import pytest

CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ecdaq"


def install(source: Path, name: str) -> Path:
    """The folder in which the packages of @source/package-lock.json are; skips if it cannot be."""
    if not shutil.which("node") or not shutil.which("npm"):
        pytest.skip(f"no node and npm here: {name} needs them")
    lock = (source / "package-lock.json").read_bytes()
    folder = CACHE / f"{source.name}-{hashlib.sha256(lock).hexdigest()[:12]}".replace("_", "-")
    if not (folder / ".complete").exists():
        shutil.copytree(source, folder, dirs_exist_ok=True)
        done = subprocess.run(
            ["npm", "ci", "--no-audit", "--no-fund"],
            cwd=folder, capture_output=True, text=True, timeout=300, check=False,
        )  # fmt: skip
        if done.returncode != 0:
            pytest.skip(f"the package registry gave no {name}: {done.stderr[-200:]}")
        (folder / ".complete").touch()
    return folder
