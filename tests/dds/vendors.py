# SPDX-License-Identifier: MIT
"""Subscribers of four vendors on the PC, each writing the same CSV (see bench.py)."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from bench import BUILD, DDS_SETTINGS, Bench, wait_for

sys.path.insert(0, str(Path(__file__).parent / "foreign"))

import build

SECONDS = float(os.environ.get("ECDAQ_DDS_SECONDS", "10"))
DOMAIN = DDS_SETTINGS["dds.domain"]


def have_foreign() -> None:
    """Build the foreign subscribers, before anything is measured. In CI they must be there."""
    try:
        build.fast_subscriber()
        build.rust_subscriber()
    except build.Unavailable as why:
        if os.environ.get("CI"):
            pytest.fail(str(why))
        pytest.skip(str(why))


def of_program(program: Callable[[], Path]) -> Callable[..., None]:
    def start(bench: Bench, name: str, seconds: float, out: Path, what: str) -> None:
        bench.on_pc(name, str(program()), DOMAIN, "dds1", str(seconds), str(out), what)

    return start


def start_python(bench: Bench, name: str, seconds: float, out: Path, what: str) -> None:
    more = ["--blocks"] if what == "block" else []
    bench.python(
        name, "subscribe_python.py", "--interface", "dds1", "--domain", DOMAIN,
        "--seconds", str(seconds), "--out", str(out), *more,
    )  # fmt: skip


VENDORS: dict[str, Callable[..., None]] = {
    "cyclone-c": of_program(lambda: BUILD / "tests" / "dds" / "dds_subscriber"),
    "cyclone-python": start_python,
    "fast-dds": of_program(build.fast_subscriber),
    "rustdds": of_program(build.rust_subscriber),
}


def start_vendors(bench: Bench, seconds: float, what: str = "sample") -> dict[str, Path]:
    """One subscriber of each vendor; returns their files when all of them have a publisher."""
    files = {}
    for vendor, start in VENDORS.items():
        name = f"{vendor}-{what}"
        files[vendor] = bench.folder / f"{name}.csv"
        start(bench, name, seconds, files[vendor], what)

    def are_ready() -> bool:
        assert all(process.poll() in (None, 0) for process in bench.started), bench.logs()
        return all("ready" in bench.log(f"{vendor}-{what}") for vendor in VENDORS)

    wait_for(f"subscribers to {what}", are_ready, 40)
    return files


def wait_for_ends(bench: Bench, seconds: float) -> None:
    for process in bench.started:
        assert process.wait(seconds) == 0, bench.logs()


JOINING_CYCLES = 1000


def joined(
    values: dict[tuple[int, int], tuple[int, ...]],
) -> dict[tuple[int, int], tuple[int, ...]]:
    """Without a subscriber's first second: where others read already, it hears of samples before
    the writer knows of it, and of those the writer repeats none."""
    first = min(cycle for _, cycle in values) + JOINING_CYCLES
    return {key: value for key, value in values.items() if key[1] >= first}
