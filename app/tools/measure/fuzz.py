# SPDX-License-Identifier: MIT
"""Lines of the parsers that the fuzz targets reach with their corpora and seeds."""

from __future__ import annotations

import subprocess
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
