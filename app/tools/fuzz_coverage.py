# SPDX-License-Identifier: MIT
"""How many lines of its parser each fuzz target reaches with its corpus and seeds.

Some are searched for a number of runs, too, the same ones each time. Needs the coverage flavour of
the build.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests" / "fuzz"))
from seeds import make as make_seeds  # noqa: E402

LEAST_PERCENT = 80
TARGET_SECONDS = 120
# What reads foreign bytes, below app/, by the target that has to reach it.
PARSERS: dict[str, tuple[str, ...]] = {
    "bring_up": tuple(
        f"master/bus/{name}.c"
        for name in (
            *("eeprom", "identity", "coe_map", "sii_read", "sii_entries", "enumerate", "scan"),
            *("map_sm", "map_check", "channels", "names", "read_ahead"),
        )
    ),
    "coe": tuple(
        f"master/mailbox/{name}.c" for name in ("coe_client", "coe_information", "box", "engine")
    ),
    "mailbox_protocols": (
        *(f"master/mailbox/{name}_client.c" for name in ("foe", "soe", "eoe", "aoe", "voe")),
        "core/wire/eoe.c",
    ),
    "gateway": (
        "master/network/gateway_frame.c",
        *(f"master/mailbox/{name}.c" for name in ("raw_client", "raw_match")),
    ),
    "sii": ("core/wire/sii.c",),
    "esi": tuple(
        f"core/esi/{name}.c" for name in ("begin", "dictionary", "end", "esi", "field", "nodes")
    ),
    "eni": (
        *(
            f"core/eni/{name}.c"
            for name in ("compare", "compare_frames", "compare_slave", "fields")
        ),
        *(f"core/eni/{name}.c" for name in ("mapping", "read", "rows", "write")),
        *("core/xml/value.c", "core/xml/xml.c"),
    ),
    "catalogue": ("sim/devices/slave_model_parse.c", "sim/devices/model_text.c"),
    "mcap": tuple(
        f"services/record/{name}.c"
        for name in ("mcap_parse", "mcap_reader", "mcap_index", "mcap_recover", "ros2msg")
    ),
    "ring": ("core/base/ring.c", "core/reader/table.c"),
    "returned_frame": ("core/wire/echo.c",),
}
SEARCH_RUNS = {"catalogue": 4000, "mcap": 1000, "ring": 10000}
SEARCH_SEED = 20261122


class CoverageError(Exception):
    """A target failed, or what it was to reach is not in it."""


@dataclass(frozen=True)
class Reached:
    """Lines of one file, as the compiler counts them."""

    target: str
    file: str
    lines: int
    covered: int

    @property
    def percent(self) -> float:
        return 100 * self.covered / self.lines

    def __str__(self) -> str:
        return (
            f"{self.target:18} {self.file:34} {self.covered:5} of {self.lines:5} "
            f"lines {self.percent:5.1f} %"
        )


def run(command: list[str | Path], env: dict[str, str] | None = None) -> str:
    result = subprocess.run(
        command, env=env, text=True, capture_output=True, timeout=TARGET_SECONDS, check=False
    )
    if result.returncode != 0:
        raise CoverageError(f"{command[0]} ended with {result.returncode}\n{result.stderr[-2000:]}")
    return result.stdout


def reached_by(target: str, build: Path) -> Iterator[Reached]:
    """The parsers of @target, in the order of the table."""
    program = build / "tests" / "fuzz" / f"fuzz_{target}"
    profile = build / f"{target}.profdata"
    inputs = sorted((ROOT / "tests" / "fuzz" / target / "corpus").glob("*"))
    inputs += make_seeds(target, build / "seeds" / target)
    counts = [build / f"{target}.profraw"]
    run([program, "-timeout=10", *inputs], {"LLVM_PROFILE_FILE": str(counts[0])})
    if target in SEARCH_RUNS:
        counts.append(build / f"{target}-search.profraw")
        with tempfile.TemporaryDirectory() as found:
            options = [f"-runs={SEARCH_RUNS[target]}", f"-seed={SEARCH_SEED}", "-timeout=10"]
            corpus = ROOT / "tests" / "fuzz" / target / "corpus"
            run([program, *options, found, corpus], {"LLVM_PROFILE_FILE": str(counts[1])})
    run(["llvm-profdata", "merge", "-o", profile, *counts])
    said = run(["llvm-cov", "export", "-summary-only", f"-instr-profile={profile}", program])
    lines = {
        str(Path(file["filename"]).resolve().relative_to(ROOT / "app")): file["summary"]["lines"]
        for file in json.loads(said)["data"][0]["files"]
        if Path(file["filename"]).resolve().is_relative_to(ROOT / "app")
    }
    for name in PARSERS[target]:
        if name not in lines:
            raise CoverageError(f"{target}: {name} is not in it")
        yield Reached(target, name, lines[name]["count"], lines[name]["covered"])


def reached(build: Path) -> list[Reached]:
    return [row for target in PARSERS for row in reached_by(target, build)]
