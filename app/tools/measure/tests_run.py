# SPDX-License-Identifier: MIT
"""Time per group and the slowest tests, as the last `./build.sh test` has left them."""

from __future__ import annotations

import json
from pathlib import Path

from measure.page import NotMeasuredError


def measure(root: Path) -> list[str]:
    times = root / "build" / "test-logs" / "times.json"
    if not times.exists():
        raise NotMeasuredError("no test run yet: run ./build.sh test first")
    last = json.loads(times.read_text())
    lines = [f"{'group':12} {'wall':>9} {'CPU':>9}"]
    lines += [f"{group:12} {wall:7.1f} s {cpu:7.1f} s" for group, wall, cpu in last["groups"]]
    lines += ["", "slowest tests"]
    lines += [f"{seconds:7.1f} s  {name}" for seconds, name in last["slowest"]]
    return [*lines, "", last["totals"]]
