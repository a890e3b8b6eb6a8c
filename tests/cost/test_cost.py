# SPDX-License-Identifier: MIT
"""What a cycle, a recorded and a published sample, and a cycle of the whole master on virtual time
cost in instructions does not grow unseen.

expected.json holds the counts of the release build by one compiler, on one architecture; elsewhere
the tests are skipped. A count that has changed by more than 3 %:

- fewer: write the new count into expected.json.
- more: find out what the new instructions do (`valgrind --tool=callgrind`, as counting.py calls it,
  then `callgrind_annotate`). If they are worth it, write the new count into expected.json and a
  line into CHANGELOG.md.
"""

from __future__ import annotations

import json
import os
import platform
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from counting import count

TOLERANCE = 0.03
EXPECTED = json.loads((Path(__file__).parent / "expected.json").read_text())
CYCLES = {"cycle": 128, "record": 1000, "publish": 200, "virtual": 100}


def compiler() -> str:
    """As in expected.json: "gcc 12 x86_64"; of Debian 12."""
    cache = (Path(os.environ["ECDAQ_BUILD"]) / "CMakeCache.txt").read_text()
    path = re.search(r"^CMAKE_C_COMPILER:\w+=(.*)$", cache, re.M)
    if path is None or "gcc" not in Path(path[1]).resolve().name:
        return "another compiler"
    version = subprocess.run([path[1], "-dumpversion"], capture_output=True, text=True, check=True)
    return f"gcc {version.stdout.partition('.')[0].strip()} {platform.machine()}"


@pytest.fixture(scope="module", autouse=True)
def can_count() -> None:
    if shutil.which("valgrind") is None:
        pytest.skip("no valgrind: instructions cannot be counted")
    if compiler() != EXPECTED["compiler"]:
        pytest.skip(f"instructions are those of {EXPECTED['compiler']}, this is {compiler()}")


@pytest.mark.parametrize("what", EXPECTED["instructions"])
def test_it_costs_what_it_did(what: str) -> None:
    program, *arguments = what.split()
    slaves, *options = arguments
    cycles = CYCLES[program]
    now = count(program, slaves, cycles, *options).instructions / cycles
    before = EXPECTED["instructions"][what]
    print(f"{what}: {now:.0f} instructions a cycle, {before} before")
    assert abs(now - before) <= TOLERANCE * before, "see the top of tests/cost/test_cost.py"


def test_the_cycle_stays_below_its_bound() -> None:
    """2,500 instructions and 40 for each slave, up to 512 of them."""
    costs = EXPECTED["instructions"]
    for slaves in (2, 16, 64, 512):
        assert costs[f"cycle {slaves} still"] <= 2500 + 40 * slaves


def test_the_recorder_asks_the_rings_little() -> None:
    """Five reads each step of five cycles: is there more, samples, are they whole, is there more,
    and is there an event. Whether their producer lives it asks while no sample comes, and ten times
    a second."""
    counted, settled = 1000, 2000
    times = count("record", 2, counted).times
    cycles = counted + settled
    reads = times.get("foreign_read", 0)
    questions = times.get("ring_is_replaced", 0) + times.get("ring_is_orphaned", 0)
    print(f"{reads} reads and {questions} questions of {cycles} cycles")
    assert 0 < reads <= 5.2 * cycles / 5
    assert questions <= 2 * cycles / 100


def test_a_count_repeats_exactly() -> None:
    first, second = (count("cycle", 2, 64, "still").instructions for _ in range(2))
    assert first == second > 0
