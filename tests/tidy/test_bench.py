# SPDX-License-Identifier: MIT
"""What `./build.sh bench` computes from the records of a run."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from project import ROOT

sys.path.insert(0, str(ROOT / "app" / "tools"))
from bench.figures import (
    Records,
    histogram_values,
    mean,
    percentiles,
    ratio,
    runs,
    strace_calls,
    sync0_spread,
)
from bench.page import wrapped
from bench.running import Load
from bench.setup import Times, read_steps, table

PERIOD_NS = 1_000_000


def of_cycles(*cycles: tuple[int, int, int, int, int]) -> Records:
    return Records(*np.array(cycles, dtype=np.int64).T)


def test_percentiles_are_values_that_were_measured() -> None:
    values = np.arange(1, 1001, dtype=np.int64)
    np.random.default_rng(1).shuffle(values)
    assert percentiles(values) == [500, 990, 999, 1000]
    assert percentiles(np.array([7])) == [7, 7, 7, 7]
    assert percentiles(np.array([1, 2, 3])) == [2, 3, 3, 3]
    assert percentiles(np.array([], dtype=np.int64)) == []


def test_a_cycle_without_a_complete_answer_before_its_end_is_lost() -> None:
    records = of_cycles(
        (1000, 10_000, 0, 40_000, 1),
        (2000, 10_000, 0, 40_000, 0),  # no answer
        (3000, 10_000, 0, 990_000, 1),  # at its end: still of this cycle
        (4000, 10_000, 0, 990_001, 1),
        (5000, 1_200_000, 0, 40_000, 1),  # woken after its end
        (0, 1_200_000, 0, 0, 0),  # skipped
        (6000, 1_200_000, PERIOD_NS, 40_000, 1),  # woken late, and counted as the cycle after
    )
    assert records.lost(PERIOD_NS).tolist() == [False, True, False, True, True, True, False]
    assert records.answered_ns(PERIOD_NS).tolist() == [40_000, 990_000, 40_000]
    assert records.latency_ns().tolist() == [10_000] * 4 + [1_200_000] * 2
    assert records.interval_ns().tolist() == [1000] * 5


def test_records_are_read_as_the_loops_write_them(tmp_path: Path) -> None:
    file = tmp_path / "records"
    np.array([[1, 2, 3, 4, 1], [5, 6, 7, 8, 0]], dtype="<i8").tofile(file)
    records = Records.read(file)
    assert records.wake_ns.tolist() == [1, 5]
    assert records.moved_ns.tolist() == [3, 7]
    assert records.has_answered.tolist() == [1, 0]


@pytest.mark.parametrize(
    ("lost", "lengths"),
    [([], []), ([0, 0], []), ([1], [1]), ([1, 1, 0, 1, 0, 0, 1, 1, 1], [2, 1, 3])],
)
def test_runs_of_lost_cycles(lost: list[int], lengths: list[int]) -> None:
    assert runs(np.array(lost, dtype=bool)) == lengths


def test_a_mean_of_nothing_is_none() -> None:
    assert mean([]) is None
    assert mean([1, 2]) == 1.5


def test_a_ratio_is_above_one_where_we_are_better_than_the_best() -> None:
    assert ratio(40, [80, 50, None], more_is_better=False) == 1.25
    assert ratio(40, [80, 50, None], more_is_better=True) == 0.5
    assert ratio(60, [30, 50], more_is_better=True) == 1.2
    assert ratio(None, [1], more_is_better=True) is None
    assert ratio(1, [None], more_is_better=True) is None
    assert ratio(0, [1], more_is_better=False) is None


def edges(*lines: tuple[int, int]) -> bytes:
    return "".join(f"{slave} {mono} 0\n" for slave, mono in lines).encode()


def test_spread_of_sync0_is_between_edges_that_belong_together() -> None:
    text = edges(
        *((slave, t * 1000 + d) for t in range(10) for slave, d in ((0, 0), (1, -30), (2, 20)))
    )
    assert sync0_spread(text, 0, 10_000) == (50, 50)
    # A slave that is off at first.
    early = edges(*((slave, t * 1000 + slave * (200 if t < 4 else 1)) for t in range(10)
                    for slave in (0, 1)))  # fmt: skip
    assert sync0_spread(early, 0, 10_000) == (200, 1)
    assert sync0_spread(early, 4000, 10_000) == (1, 1)
    # The end of a line that is still being written is not an edge.
    assert sync0_spread(early + b"1 9", 4000, 10_000) == (1, 1)


def test_one_slave_has_no_spread() -> None:
    assert sync0_spread(edges((0, 1), (0, 1001)), 0, 5000) is None
    assert sync0_spread(b"", 0, 5000) is None


def test_the_histogram_of_cyclictest_is_read() -> None:
    text = (
        "# Histogram\n000000 000000\n000003 000002\n000010 000001\n"
        "# Total: 000000004\n# Max Latencies: 00950\n# Histogram Overflows: 00001\n"
    )
    values, most = histogram_values(text)
    assert values.tolist() == [3000, 3000, 10_000, 950_000]
    assert most == 950_000
    with pytest.raises(ValueError, match="no histogram"):
        histogram_values("# Histogram\n")


def test_all_calls_of_strace_are_counted() -> None:
    head = "% time     seconds  usecs/call     calls    errors syscall\n"
    assert strace_calls(head + "100.00    0.000033           0       109        14 total\n") == 109
    assert strace_calls(head + "100.00    0.000033           0       109           total\n") == 109
    with pytest.raises(ValueError, match="no table"):
        strace_calls("strace: attach: ptrace: Operation not permitted")


def test_others_and_stolen_time_disturb_a_round() -> None:
    assert not Load(3, 0.1, 0.02).is_disturbed
    assert Load(0, 0.11, 0).is_disturbed
    assert Load(0, 0, 0.03).is_disturbed


def test_ratios_are_wrapped() -> None:
    lines = wrapped(["a" * 40, "b" * 40, "c" * 40])
    assert lines == [f"  {'a' * 40}, {'b' * 40}", f"  {'c' * 40}"]


def test_steps_of_the_set_up_add_up_to_the_whole() -> None:
    steps = read_steps(["1500 fetching soem", "30000 compiling release", "500 fetching soem"])
    assert steps == {"fetching soem": 2.0, "compiling release": 30.0}
    lines = table({"run": Times(steps, 33.0), "build": Times({"compiling release": 60.0}, 60.5)})
    assert [line.split()[-2:] for line in lines] == [
        ["run", "build"], ["2.0", "-"], ["30.0", "60.0"], ["1.0", "0.5"], ["33.0", "60.5"],
    ]  # fmt: skip
