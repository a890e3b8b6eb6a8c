# SPDX-License-Identifier: MIT
"""Samples over DDS: complete, equal to the recording, also when programs are killed.

ECDAQ_DDS_SECONDS: how long each looks (5). Numbers are printed: ./build.sh test dds, or pytest -s.
"""

from __future__ import annotations

import itertools
import os
import signal
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest
from bench import BUILD, Bench, live, rows, wait_for

SECONDS = float(os.environ.get("ECDAQ_DDS_SECONDS", "5"))
DOMAIN = "7"
CYCLES = int(SECONDS * 1000)
FOREVER = 600.0  # for who is ended when it has seen enough


def start_python(bench: Bench, name: str, seconds: float, *more: str) -> Path:
    out = bench.folder / f"{name}.csv"
    bench.python(
        name, "subscribe_python.py", "--interface", "dds1", "--domain", DOMAIN,
        "--seconds", str(seconds), "--out", str(out), *more,
    )  # fmt: skip
    return out


def start_c(bench: Bench, seconds: float) -> Path:
    out = bench.folder / "c.csv"
    program = str(BUILD / "tests" / "dds" / "dds_subscriber")
    bench.on_pc("subscriber", program, DOMAIN, "dds1", str(seconds), str(out))
    return out


def of_recording(bench: Bench) -> dict[tuple[int, int], tuple[int, ...]]:
    """(slave, cycle) -> time, flags, goodness, all raw values; from the recording."""
    return {
        (slave, m.cycle): (
            m.dc_time_ns,
            m.flags,
            int(m.good),
            int(m.led),
            m.oneshot_time,
            m.adc_raw,
            m.counter,
            m.sample_time,
            m.status,
        )
        for slave in (0, 1)
        for m in live.recorded(bench.segment.record_dir, f"/ecdaq/piccolo{slave}")
    }


def of_subscriber(path: Path) -> dict[tuple[int, int], tuple[int, ...]]:
    """The same from a subscriber's file; no sample came twice."""
    found = rows(path)
    assert found
    values = {
        (int(r["slave"]), int(r["cycle"])): (
            int(r["dc_time_ns"]),
            int(r["flags"]),
            int(r["is_good"]),
            *map(int, r["raw"].split()),
        )
        for r in found
    }
    assert len(values) == len(found)
    for r in found:  # fields that need no decoder equal the raw values
        raw = [int(word) for word in r["raw"].split()]
        assert float(r["adc"]) == pytest.approx(raw[2] * 3.3 / 4095, abs=1e-12)
        assert (int(r["counter"]), int(r["sample_time_ns"])) == (raw[3], raw[4])
    return values


def gaps_of(values: dict[tuple[int, int], tuple[int, ...]], slave: int) -> list[tuple[int, int]]:
    """First and count of what is missing between the first and the last cycle."""
    cycles = sorted(cycle for place, cycle in values if place == slave)
    pairs = itertools.pairwise(cycles)
    return [(a + 1, b - a - 1) for a, b in pairs if b != a + 1]


def since(
    values: dict[tuple[int, int], tuple[int, ...]], cycle: int
) -> dict[tuple[int, int], tuple[int, ...]]:
    """Those of later cycles than @cycle."""
    return {key: value for key, value in values.items() if key[1] > cycle}


def newest(path: Path) -> int:
    """The cycle of the newest whole row in a subscriber's file, while it grows."""
    if not path.exists():
        return 0
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - 4096))
        lines = file.read().split(b"\n")[1:-1]  # without the head, and what is not whole
    return int(lines[-1].split(b",")[2]) if lines else 0


def wait_for_cycle(paths: Iterable[Path], cycle: int) -> None:
    """Until all subscribers have written samples as new as @cycle."""
    for path in paths:
        wait_for(f"cycle {cycle} in {path.name}", lambda p=path: newest(p) >= cycle, 120)


def end_subscribers(bench: Bench) -> None:
    """Of those that read until SIGTERM."""
    for process in bench.started:
        process.terminate()


def finish(bench: Bench, seconds: float) -> None:
    """All subscribers end by themselves; then the appliance ends in order."""
    for process in bench.started:
        assert process.wait(seconds) == 0, bench.logs()
    assert bench.segment.stop("dds") == 0
    bench.segment.stop("daemon")
    assert bench.segment.stop("recorder") == 0


def test_every_sample_reaches_c_and_python_and_equals_the_recording(
    make_bench: Callable[..., Bench],
) -> None:
    bench = make_bench()
    bench.start_all()
    files = {
        "C": start_c(bench, FOREVER),
        "Python": start_python(bench, "python", FOREVER),
        "Python, blocks": start_python(bench, "blocks", FOREVER, "--blocks"),
    }
    known = bench.wait_for_subscribers(len(files))
    wait_for_cycle(files.values(), known + CYCLES)
    end_subscribers(bench)
    finish(bench, 60)
    recorded = of_recording(bench)
    for name, path in files.items():
        got = of_subscriber(path)
        wrong = [key for key, value in got.items() if recorded.get(key) != value]
        missing = gaps_of(since(got, known), 0) + gaps_of(since(got, known), 1)
        print(f"{name}: {len(got)} samples, {len(missing)} gaps, {len(wrong)} wrong values")
        assert len(since(got, known)) > CYCLES  # of two slaves
        assert not missing
        assert not wrong, (wrong[0], got[wrong[0]], recorded.get(wrong[0]))
    assert not gaps_of(recorded, 0)


def test_killed_publisher_costs_its_subscribers_its_down_time_and_the_recording_nothing(
    make_bench: Callable[..., Bench],
) -> None:
    bench = make_bench()
    bench.start_all()
    out = start_python(bench, "python", FOREVER)
    bench.wait_for_subscribers(1)
    before = bench.segment.wait_for_cycles(500, 30)["cycle_number"]
    wait_for_cycle([out], before)
    bench.segment.stop("dds", signal.SIGKILL)
    down = bench.segment.wait_for_cycles(1, 30)["cycle_number"]
    bench.segment.wait_for_cycles(1000, 30)
    up = bench.segment.status()["cycle_number"]
    bench.start_dds(sessions=2)
    back = bench.segment.status()["cycle_number"]
    bench.wait_for_subscribers(1)
    wait_for_cycle([out], bench.segment.status()["cycle_number"] + 500)
    end_subscribers(bench)
    assert bench.started[0].wait(60) == 0, bench.logs()
    assert bench.segment.stop("dds") == 0
    of_dds = bench.segment.status()["dds"]
    bench.segment.stop("daemon")
    assert bench.segment.stop("recorder") == 0
    found = gaps_of(of_subscriber(out), 0)
    print(f"killed in cycles {before} to {down}, started at {up}, back by {back}: gaps {found}")
    assert len(found) == 1
    first, count = found[0]
    assert before < first <= down + 1
    # It resumes when the old subscriber and the new publisher have found each other.
    assert up < first + count
    # The new publisher has published all since then.
    assert of_dds["published_cycles"] >= newest(out) - back
    assert (of_dds["missed_cycles"], of_dds["failed_messages"]) == (0, 0)
    assert not gaps_of(of_recording(bench), 0)


def test_publisher_follows_the_master_through_a_restart(make_bench: Callable[..., Bench]) -> None:
    bench = make_bench()
    bench.start_all()
    out = start_python(bench, "python", FOREVER)
    wait_for_cycle([out], bench.wait_for_subscribers(1) + 500)
    bench.segment.stop("daemon")
    bench.segment.start_daemon()
    bench.segment.wait_for_op()
    wait_for("the new session", lambda: sessions(out) == 2, 60)
    bench.segment.wait_for_cycles(500, 30)
    bench.started[0].terminate()
    finish(bench, 60)
    for session in sorted({r["session"] for r in rows(out)}):
        cycles = [
            int(r["cycle"]) for r in rows(out) if r["session"] == session and r["slave"] == "0"
        ]
        assert cycles == list(range(cycles[0], cycles[-1] + 1))
    assert cycles[0] == 0  # of a new master, all is published


def sessions(path: Path) -> int:
    # Without the last row: it may be half there.
    return len({r["session"] for r in rows(path)[:-1]}) if path.exists() else 0


def test_hostile_peer_with_our_names_and_garbage_stops_no_program(
    make_bench: Callable[..., Bench],
) -> None:
    bench = make_bench()
    bench.start_all()
    out = start_python(bench, "python", SECONDS)
    program = str(BUILD / "tests" / "dds" / "dds_hostile")
    bench.on_pc("hostile", program, DOMAIN, "dds1", str(int(SECONDS)), "10.77.0.1")
    finish(bench, SECONDS + 60)
    print(bench.log("hostile").splitlines()[-1])
    got = of_subscriber(out)
    missing = gaps_of(got, 0) + gaps_of(got, 1)
    print(f"{len(got)} samples, {len(missing)} gaps beside the hostile peer")
    assert not missing
    assert "garbage" in bench.log("hostile")
