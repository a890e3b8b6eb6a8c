# SPDX-License-Identifier: MIT
"""Programs of Go modules that tests use: pinned by version, checked by their sums, built once."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ecdaq"


def program(module: str, version: str) -> Path:
    """The program of @module at @version; skips if it cannot be built."""
    name = module.rsplit("/", maxsplit=1)[-1]
    folder = CACHE / f"go-{name}-{version}"
    if (folder / name).exists():
        return folder / name
    tool = shutil.which("go") or shutil.which("go", path="/usr/local/go/bin:/usr/lib/go/bin")
    if tool is None:
        pytest.skip(f"no go here: {name} needs it")
    folder.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(
        [tool, "install", f"{module}@{version}"],
        env=os.environ | {"GOBIN": str(folder), "GOFLAGS": "-p=1"},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    if done.returncode != 0:
        pytest.skip(f"the module proxy gave no {name}: {done.stderr[-200:]}")
    return folder / name
