# SPDX-License-Identifier: MIT
"""Subscribers of four vendors at once: what each got is, sample by sample, what was recorded.

ECDAQ_DDS_SECONDS: how long each looks (20).
"""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from bench import Bench
from test_samples import finish, gaps_of, of_recording, of_subscriber
from vendors import JOINING_CYCLES, SECONDS, have_foreign, joined, start_vendors, wait_for_ends

Values = dict[tuple[int, int], tuple[int, ...]]
RESUME_S = 14.0
MATCH_CYCLES = 10000  # until peers of another vendor have found a new publisher


@pytest.fixture(scope="module", autouse=True)
def foreign() -> None:
    have_foreign()


def gaps_in(what: str, files: dict[str, Path], recorded: Values, least: float) -> list[str]:
    """Prints a line for each vendor. Who missed some, as lines; a wrong value fails at once."""
    trouble = []
    for vendor, path in files.items():
        got = of_subscriber(path)
        wrong = [key for key, value in got.items() if recorded.get(key) != value]
        gaps = gaps_of(joined(got), 0) + gaps_of(joined(got), 1)
        print(f"{what}, {vendor}: {len(got)} samples, {len(gaps)} gaps, {len(wrong)} wrong values")
        assert not wrong, (vendor, wrong[0], got[wrong[0]], recorded.get(wrong[0]))
        if gaps or len(got) < least:
            trouble.append(f"{what}, {vendor}: {len(got)} samples, gaps {gaps[:5]}")
    return trouble


def test_four_vendors_at_once_get_every_sample_and_every_block_as_recorded(
    make_bench: Callable[..., Bench],
) -> None:
    for attempt in (1, 2, 3):  # who gets no processor for 10 s has gaps: that is measured again
        bench = make_bench()
        bench.start_all()
        samples = start_vendors(bench, SECONDS)
        wait_for_ends(bench, SECONDS + 60)
        blocks = start_vendors(bench, SECONDS / 2, "block")
        finish(bench, SECONDS + 60)
        recorded = of_recording(bench)
        assert not gaps_of(recorded, 0)
        # Each looked for so long from its first message on, or from a little before.
        trouble = gaps_in("ecdaq/sample", samples, recorded, SECONDS * 2 * 900)
        trouble += gaps_in("ecdaq/block", blocks, recorded, SECONDS * 900)
        if not trouble:
            return
        print(f"attempt {attempt}: {trouble}")
    raise AssertionError(trouble)


def test_four_vendors_resume_after_a_killed_publisher_and_the_gap_is_its_down_time(
    make_bench: Callable[..., Bench],
) -> None:
    bench = make_bench()
    bench.start_all()
    files = start_vendors(bench, RESUME_S)
    bench.segment.wait_for_cycles(3 * JOINING_CYCLES, 30)
    before = bench.segment.status()["cycle_number"]
    bench.segment.stop("dds", signal.SIGKILL)
    down = bench.segment.status()["cycle_number"]
    bench.segment.wait_for_cycles(1000, 30)
    up = bench.segment.status()["cycle_number"]
    bench.start_dds(sessions=2)
    back = bench.segment.status()["cycle_number"]
    finish(bench, RESUME_S + 60)
    recorded = of_recording(bench)
    assert not gaps_of(recorded, 0)
    print(f"ecdaq-dds killed in cycles {before} to {down}, started at {up}, published by {back}")
    for vendor, path in files.items():
        got = of_subscriber(path)
        assert not [key for key, value in got.items() if recorded.get(key) != value], vendor
        for slave in (0, 1):
            found = gaps_of(joined(got), slave)
            print(f"{vendor}, slave {slave}: missing {found}")
            assert len(found) == 1, (vendor, found)
            first, count = found[0]
            # From its last message, which is at most a turn of its loop old, ...
            assert before - 100 <= first <= down + 1
            # ... to the first that it wrote with this reader known.
            assert up <= first + count <= back + MATCH_CYCLES
