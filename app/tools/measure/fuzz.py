# SPDX-License-Identifier: MIT
"""Lines of the parsers that the fuzz targets reach, and what a long search for crashes finds."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from fuzz_coverage import LEAST_PERCENT, CoverageError, reached

from measure.page import NotMeasuredError


def measure(root: Path) -> list[str]:
    built = subprocess.run(
        [root / "app" / "tools" / "build-flavour.sh", "coverage"],
        text=True,
        capture_output=True,
        check=False,
    )
    if built.returncode != 0:
        raise NotMeasuredError(f"the build failed\n{built.stderr[-2000:]}")
    try:
        rows = reached(root / "build" / "coverage")
    except CoverageError as why:
        raise NotMeasuredError(str(why)) from why
    least = min(rows, key=lambda row: row.percent)
    end = f"least: {least.percent:.1f} % ({least.file}); at least {LEAST_PERCENT} % are wanted"
    return [*(str(row) for row in rows), "", end]


def search(targets: list[str], seconds: int, root: Path) -> list[str]:
    """Search with each of @targets for @seconds; a crash is an error, not a line of the page."""
    command = [sys.executable, root / "app" / "tools" / "run_tests.py"]
    command += ["--fuzz-seconds", str(seconds), "--only", f"^fuzz_({'|'.join(targets)})$", "fuzz"]
    done = subprocess.run(command, cwd=root, text=True, capture_output=True, check=False)
    if done.returncode != 0:
        raise NotMeasuredError(f"the search found something, or failed\n{done.stdout[-2000:]}")
    logs = root / "build" / "test-logs"
    return [
        searched(name, seconds, (logs / f"fuzz-{name}-search.log").read_text(errors="replace"))
        for name in targets
    ]


def searched(name: str, seconds: int, log: str) -> str:
    """A line of the page from libFuzzer's output."""
    runs = re.search(r"^stat::number_of_executed_units: *(\d+)", log, re.M)
    added = re.search(r"^stat::new_units_added: *(\d+)", log, re.M)
    ended = re.search(r"^Done \d+ runs in (\d+) second", log, re.M)
    if not runs or not added or not ended or int(ended[1]) < seconds:
        raise NotMeasuredError(f"{name}: the search did not take its {seconds} s")
    return f"{name:10} {int(runs[1]):>12} runs in {ended[1]} s, {added[1]} new inputs, 0 crashes"
