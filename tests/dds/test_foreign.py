# SPDX-License-Identifier: MIT
"""Subscribers of four vendors at once: what each got is, sample by sample, what was recorded.

ECDAQ_DDS_SECONDS: how long each looks (10).
"""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from bench import Bench
from test_samples import finish, gaps_of, of_recording, of_subscriber, since, wait_for_cycle
from vendors import SECONDS, have_foreign, start_vendors, wait_for_ends

Values = dict[tuple[int, int], tuple[int, ...]]
RESUME_S = 20.0


@pytest.fixture(scope="module", autouse=True)
def foreign() -> None:
    have_foreign()


def gaps_in(
    what: str, files: dict[str, Path], recorded: Values, known: int, least: float
) -> list[str]:
    """Prints a line for each vendor. Who missed some, as lines; a wrong value fails at once."""
    trouble = []
    for vendor, path in files.items():
        got = of_subscriber(path)
        wrong = [key for key, value in got.items() if recorded.get(key) != value]
        gaps = gaps_of(since(got, known), 0) + gaps_of(since(got, known), 1)
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
        samples_known = bench.wait_for_subscribers(len(samples))
        wait_for_ends(bench, SECONDS + 60)
        bench.wait_for_subscribers(0)
        blocks = start_vendors(bench, SECONDS / 2, "block")
        blocks_known = bench.wait_for_subscribers(len(blocks))
        finish(bench, SECONDS + 60)
        recorded = of_recording(bench)
        assert not gaps_of(recorded, 0)
        # Each looked for so long from its first message on, or from a little before.
        trouble = gaps_in("ecdaq/sample", samples, recorded, samples_known, SECONDS * 2 * 900)
        trouble += gaps_in("ecdaq/block", blocks, recorded, blocks_known, SECONDS * 900)
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
    known = bench.wait_for_subscribers(len(files))
    before = bench.segment.wait_for_cycles(500, 30)["cycle_number"]
    wait_for_cycle(files.values(), before)
    bench.segment.stop("dds", signal.SIGKILL)
    down = bench.segment.wait_for_cycles(1, 30)["cycle_number"]
    bench.segment.wait_for_cycles(1000, 30)
    up = bench.segment.status()["cycle_number"]
    bench.start_dds(sessions=2)
    known_again = bench.wait_for_subscribers(len(files))
    finish(bench, RESUME_S + 60)
    recorded = of_recording(bench)
    assert not gaps_of(recorded, 0)
    print(
        f"ecdaq-dds killed in cycles {before} to {down}, started at {up}, "
        f"knew all readers by {known_again}"
    )
    for vendor, path in files.items():
        got = of_subscriber(path)
        assert not [key for key, value in got.items() if recorded.get(key) != value], vendor
        for slave in (0, 1):
            found = gaps_of(since(got, known), slave)
            print(f"{vendor}, slave {slave}: missing {found}")
            assert found, vendor
            first, count = found[0]
            # From the last that the dead one sent to the first of the new one ...
            assert before < first <= down + 1
            assert up < first + count
            # ... where others may have read already when this one was not known yet.
            assert all(a + n <= known_again + 1 for a, n in found[1:]), (vendor, found)
