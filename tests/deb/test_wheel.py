# SPDX-License-Identifier: MIT
"""The Python kit from pip, in an environment that has nothing else."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from conftest import TOP

KIT = TOP / "app/services/publish/python"
# What reads, records and subscribes without an option.
MODULES = ("ecdaq", "ecdaq.recording", "ecdaq.mcap_file", "ecdaq.link", "ecdaq.remote")


def test_its_wheel_brings_all_that_reading_and_recording_need(tmp_path: Path) -> None:
    clean = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet"]
    subprocess.run([*pip, "wheel", "--no-deps", "--wheel-dir", tmp_path, KIT], check=True)
    (wheel,) = tmp_path.glob("ecdaq-*.whl")
    python = tmp_path / "venv/bin/python"
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "venv"], check=True)
    subprocess.run([python, "-m", "pip", "--quiet", "install", wheel], check=True, env=clean)
    use = f"import {', '.join(MODULES)}; print(ecdaq.read, ecdaq.connect)"
    subprocess.run([python, "-c", use], check=True, env=clean, cwd=tmp_path)
    for program in ("ecdaq-parquet", "ecdaq-remote"):
        subprocess.run([python.parent / program, "--help"], check=True, env=clean)
