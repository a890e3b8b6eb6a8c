# SPDX-License-Identifier: MIT
"""The main job on a real packet socket in real time. Counts and content are checked, not times."""

from __future__ import annotations

import itertools
import json
import math
import os
import re
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from segment import BIN, ROOT, Segment, recorded, wait_for

# These measure time, or need a cycle in time.
IDLE = True
PERIOD_NS = 1_000_000
MINUTE_CYCLES = int(os.environ.get("ECDAQ_LIVE_CYCLES", "60000"))
PICCOLOS = ("piccolo0", "piccolo1")
ROUNDS = 10
# SAMPLE_NOT_OP, SAMPLE_FAIL_SAFE, SAMPLE_SKIPPED: no frame carried what was set.
NOT_SENT = 0x08 | 0x10 | 0x20
# A recording of this size has samples: its descriptions take less.
HEAD_BYTES = 100_000


def fit_sine(time_s: np.ndarray, volt: np.ndarray) -> tuple[float, float, float]:
    """Frequency, amplitude and offset of the sine nearest 1 Hz (least squares)."""
    best = (math.inf, 0.0, 0.0, 0.0)
    for frequency in np.linspace(0.98, 1.02, 401):
        angle = 2 * np.pi * frequency * time_s
        basis = np.column_stack((np.sin(angle), np.cos(angle), np.ones_like(angle)))
        solution, residual, _, _ = np.linalg.lstsq(basis, volt, rcond=None)
        if residual[0] < best[0]:
            amplitude = float(np.hypot(solution[0], solution[1]))
            best = (float(residual[0]), float(frequency), amplitude, float(solution[2]))
    return best[1:]


def summary_of(segment: Segment) -> dict[str, Any]:
    return json.loads(segment.ecdaq("status", "--json", "--summary").stdout)


def check_every_cycle_is_recorded(segment: Segment, summary: dict[str, Any]) -> list[Any]:
    """Each cycle number once, in every topic; `ecdaq log check` agrees. Returns the cycle topic."""
    cycles = list(recorded(segment.record_dir, "/ecdaq/cycle"))
    numbers = [c.cycle for c in cycles]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    assert summary["recorded_cycles"] == len(numbers)
    assert summary["recorded_gaps"] == 0
    segment.ecdaq("log", "check", str(segment.record_dir))
    return cycles


def test_a_minute_at_one_millisecond_loses_and_invents_nothing(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment()
    segment.start_all()
    segment.wait_for_cycles(MINUTE_CYCLES, MINUTE_CYCLES / 1000 * 4 + 30)
    assert segment.stop("daemon") == 0
    assert segment.stop("recorder") == 0
    summary = summary_of(segment)
    print(json.dumps(summary))

    assert summary["samples_bad_unexplained"] == 0
    assert summary["samples_good"] > 0
    assert summary["page_faults"] == 0
    assert summary["slaves"] == 2
    cycles = check_every_cycle_is_recorded(segment, summary)
    assert len(cycles) >= MINUTE_CYCLES

    good: list[dict[int, Any]] = []
    for name in PICCOLOS:
        samples = list(recorded(segment.record_dir, f"/ecdaq/{name}"))
        assert [s.cycle for s in samples] == [c.cycle for c in cycles]
        good.append({s.cycle: s for s in samples if s.good})
        check_values(good[-1])
    both = good[0].keys() & good[1].keys()
    # Each bad sample takes at most one cycle from those in which both are good.
    assert 2 * len(both) >= summary["samples_good"] - summary["samples_bad"]
    # The same instant: both slaves stamped their sample with the SYNC0 edge of the cycle.
    assert all(
        good[0][k].sample_time == good[1][k].sample_time == good[0][k].dc_time_ns for k in both
    )


def check_values(samples: dict[int, Any]) -> None:
    """The counter advanced as the cycle did; the ADC holds the 1 Hz sine of the generator."""
    numbers = sorted(samples)
    for before, after in itertools.pairwise(numbers):
        assert (samples[after].counter - samples[before].counter) % 65536 == (
            after - before
        ) % 65536
    time_s = np.array(
        [(samples[k].dc_time_ns - samples[numbers[0]].dc_time_ns) / 1e9 for k in numbers]
    )
    volt = np.array([samples[k].adc for k in numbers])
    frequency, amplitude, offset = fit_sine(time_s, volt)
    print(
        f"sine: {frequency:.4f} Hz, {amplitude:.4f} V around {offset:.4f} V, {len(numbers)} samples"
    )
    assert abs(frequency - 1.0) < 0.001
    assert abs(amplitude - 0.5) < 0.005
    assert abs(offset - 1.0) < 0.005


def test_a_recorder_killed_for_ten_seconds_misses_no_cycle(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment()
    segment.start_all()
    wait_for("a recording", lambda: segment.status().get("recorded_cycles", 0) > 1000, 60)
    assert segment.stop("recorder", signal.SIGKILL) == -signal.SIGKILL
    segment.wait_for_cycles(10_000, 60)
    segment.start_recorder()
    # It counts its own: first all that it missed.
    wait_for("the backlog", lambda: segment.status()["recorded_cycles"] > 10_000, 60)
    segment.wait_for_cycles(2_000, 60)
    assert segment.stop("daemon") == 0
    assert segment.stop("recorder") == 0
    cycles = [m.cycle for m in recorded(segment.record_dir, "/ecdaq/cycle")]
    assert cycles == list(range(cycles[0], cycles[0] + len(cycles)))
    assert len(cycles) > 12_000
    segment.ecdaq("log", "check", str(segment.record_dir))
    assert not list(segment.record_dir.glob("*.part"))


def test_a_stopped_reader_of_the_ring_changes_nothing_for_the_cycle(
    make_segment: Callable[..., Segment],
) -> None:
    """Rounds with a reader and with it stopped, in one run; counts are compared."""
    segment = make_segment()
    segment.start_all()
    segment.start(
        "watch",
        str(BIN / "ecdaq"),
        "--run-dir",
        str(segment.run_dir),
        "watch",
        f"{PICCOLOS[0]}.adc",
    )
    lost: dict[signal.Signals, list[int]] = {signal.SIGCONT: [], signal.SIGSTOP: []}
    # The machine's own losses come and go; those of a reader that holds up the cycle would be in
    # each round.
    for number in [signal.SIGCONT, signal.SIGSTOP] * ROUNDS:
        segment.send("watch", number)
        before = segment.status()
        after = segment.wait_for_cycles(2_000, 60)
        lost[number].append(after["frames_lost"] - before["frames_lost"])
        for key in ("page_faults", "samples_bad_unexplained"):
            assert after[key] == 0
        if lost[signal.SIGSTOP] and min(lost[signal.SIGSTOP]) <= max(lost[signal.SIGCONT]):
            break
    segment.send("watch", signal.SIGCONT)
    print(f"frames lost in 2000 cycles: {lost}")
    assert min(lost[signal.SIGSTOP]) <= max(lost[signal.SIGCONT])


def test_the_cycle_thread_is_alone_with_its_rights(make_segment: Callable[..., Segment]) -> None:
    """SCHED_FIFO where permitted; the daemon's other threads keep the default policy."""
    segment = make_segment(settings={"cycle.priority": "70"})
    segment.start_all()
    daemon = segment.processes["daemon"].pid
    classes: dict[str, str] = {}
    for task in Path(f"/proc/{daemon}/task").iterdir():
        got = subprocess.run(["chrt", "-p", task.name], capture_output=True, text=True, check=False)
        if not task.exists():
            continue  # it has ended
        assert got.returncode == 0, got.stderr
        classes[(task / "comm").read_text().strip()] = got.stdout
    cycle = [text for name, text in classes.items() if "cycle" in name]
    assert len(cycle) == 1, classes
    if os.geteuid() == 0:
        assert "SCHED_FIFO" in cycle[0] and "priority: 70" in cycle[0]
    others = [text for name, text in classes.items() if "cycle" not in name]
    assert others and all("SCHED_OTHER" in text for text in others)


def test_an_output_set_by_the_operator_is_on_the_wire_in_the_cycle_printed(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment()
    segment.start_all()
    answer = json.loads(segment.ecdaq("set", f"{PICCOLOS[1]}.led=on", "--json").stdout)
    segment.wait_for_cycles(500, 60)
    segment.wait_for_op()
    assert segment.stop("daemon") == 0
    assert segment.stop("recorder") == 0
    sent = {c.cycle for c in recorded(segment.record_dir, "/ecdaq/cycle") if not c.flags & NOT_SENT}
    led = {m.cycle: m.led for m in recorded(segment.record_dir, f"/ecdaq/{PICCOLOS[1]}")}
    assert min(cycle for cycle, value in led.items() if value) >= answer["cycle"]
    # A cycle that this machine skipped has no frame: then the next one.
    assert led[min(cycle for cycle in sent if cycle >= answer["cycle"])]


def test_build_sh_run_ends_with_one_json_line(tmp_path: Path) -> None:
    got = subprocess.run(
        [
            str(ROOT / "build.sh"),
            "run",
            "--seconds",
            "5",
            "--slaves",
            "3",
            "--json",
            "--record",
            str(tmp_path / "record"),
        ],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert got.returncode == 0, got.stderr
    line = json.loads(got.stdout.strip().splitlines()[-1])
    for key in (
        "state",
        "slaves",
        "cycles",
        "frames_lost",
        "frames_late",
        "overruns",
        "samples_good",
        "samples_bad",
        "dc_lock_ms",
        "page_faults",
        "recording",
        "recorded_cycles",
        "recorded_gaps",
        "dds",
        "sync0",
    ):
        assert key in line
    for key in ("wake_latency_ns", "round_trip_ns", "phase_ns"):
        assert set(line[key]) >= {"p50", "p99", "p999", "max"}
    assert line["slaves"] == 3
    assert line["recorded_gaps"] == 0
    assert line["samples_good"] > 3000
    assert line["dds"]["published_cycles"] > 1000
    assert (line["dds"]["missed_cycles"], line["dds"]["failed_messages"]) == (0, 0)
    assert (line["dds"]["interface"], line["dds"]["commands"]) == ("lo", False)
    check = line["sync0"]
    assert (check["source"], check["lines"], check["state"]) == ("simulated edges", 3, "ended")
    assert line["recording"].endswith(".mcap")
    assert list((tmp_path / "record").glob("*.mcap"))


def test_ctrl_c_ends_the_run_in_order(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [str(ROOT / "build.sh"), "run", "--record", str(tmp_path / "record")],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        record = tmp_path / "record"

        def has_samples() -> bool:
            return any(path.stat().st_size > HEAD_BYTES for path in record.glob("*.part"))

        # build.sh may have to build first.
        wait_for("a recording", has_samples, 300)
        os.killpg(process.pid, signal.SIGINT)
        output, _ = process.communicate(timeout=60)
    finally:
        if process.poll() is None:
            process.kill()
            process.wait(10)
    assert process.returncode == 0, output
    assert re.search(r"cycles", output)
    assert not list(record.glob("*.part"))
