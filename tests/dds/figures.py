# SPDX-License-Identifier: MIT
"""What DDS costs and how long it takes, measured: ./build.sh measure dds writes it all to a page.

Times of SYNC0 edges are those of the simulated slaves (ecdaq-sim --edges): DC time beside
CLOCK_MONOTONIC, which the subscribers on the same machine read when they take.
"""

from __future__ import annotations

import bisect
import os
import socket
import statistics
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench import BUILD, DDS_SETTINGS, Bench, Commander, is_passing, live, rows, wait_for
from flags import LOST

DOMAIN = DDS_SETTINGS["dds.domain"]
LED = "piccolo0.led"
COMMANDER = {
    "outputs[0].channel": LED,
    "outputs[0].owner": "remote",
    "outputs[0].timeout": "4s",  # a commander on a busy machine is not to be taken for dead
}


def percentile(values: Iterable[float], percent: float) -> float:
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(len(ordered) * percent / 100))]


def spread(values: list[float], unit: str) -> str:
    p50, p99 = statistics.median(values), percentile(values, 99)
    return f"p50 {p50:.1f}, p99 {p99:.1f}, most {max(values):.1f} {unit}"


class Edges:
    """DC time to CLOCK_MONOTONIC, between the edges of the first slave."""

    def __init__(self, path: Path) -> None:
        pairs = []
        for line in path.read_text().splitlines():
            words = line.split()
            if len(words) == 3 and words[0] == "0":
                pairs.append((int(words[2]), int(words[1])))
        assert pairs, "ecdaq-sim wrote no edges"
        pairs.sort()
        self.dc_ns = [dc_ns for dc_ns, _ in pairs]
        self.mono_ns = [mono_ns for _, mono_ns in pairs]

    def mono_of(self, dc_ns: int) -> int:
        """At most half a period from an edge, where 100 ppm are 50 ns."""
        at = bisect.bisect_left(self.dc_ns, dc_ns)
        near = min(
            range(max(0, at - 1), min(len(self.dc_ns), at + 1)),
            key=lambda i: abs(self.dc_ns[i] - dc_ns),
        )
        assert abs(self.dc_ns[near] - dc_ns) < 2_000_000, "no edge near it"
        return self.mono_ns[near] + dc_ns - self.dc_ns[near]


def control_socket(bench: Bench) -> Path:
    return bench.segment.run_dir / "segment"


def lamp(bench: Bench) -> str:
    """What the first slave's LED is: its firmware has taken it out of the ESC's memory."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as asking:
        asking.bind(str(bench.segment.run_dir / "asking"))
        try:
            asking.settimeout(10)
            asking.sendto(b"io slave=0", str(control_socket(bench)))
            return asking.recv(4096).decode()
        finally:
            (bench.segment.run_dir / "asking").unlink()


def start_with_edges(bench: Bench) -> Path:
    edges = bench.folder / "edges.txt"
    bench.segment.start_sim("--edges", str(edges), "--control", str(control_socket(bench)))
    bench.segment.start_daemon()
    bench.segment.start_recorder()
    bench.segment.wait_for_op()
    bench.start_dds()
    return edges


def stop(bench: Bench) -> None:
    assert bench.segment.stop("dds") == 0
    bench.segment.stop("daemon")
    assert bench.segment.stop("recorder") == 0
    bench.segment.stop("sim")  # writes the last edges


def start_c(bench: Bench, name: str, seconds: float, what: str = "sample") -> Path:
    out = bench.folder / f"{name}.csv"
    program = str(BUILD / "tests" / "dds" / "dds_subscriber")
    bench.on_pc(name, program, DOMAIN, "dds1", str(seconds), str(out), what)
    return out


def start_python(bench: Bench, name: str, seconds: float, what: str = "sample") -> Path:
    out = bench.folder / f"{name}.csv"
    more = ["--blocks"] if what == "block" else []
    bench.python(
        name, "subscribe_python.py", "--interface", "dds1", "--domain", DOMAIN,
        "--seconds", str(seconds), "--out", str(out), *more,
    )  # fmt: skip
    return out


def wait_for_ready(bench: Bench, names: Iterable[str]) -> None:
    wanted = list(names)
    wait_for("subscribers", lambda: all("ready" in bench.log(n) for n in wanted), 60)


def wait_for_ends(bench: Bench, seconds: float) -> None:
    for process in bench.started:
        assert process.wait(seconds) == 0, bench.logs()


def cpu_seconds(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@dataclass
class Latencies:
    """SYNC0 to the take, in us, by subscriber; of blocks the newest and the oldest cycle."""

    by_name: dict[str, list[float]]
    cpu_percent: float
    cycles: int


def latencies(bench: Bench, seconds: float) -> Latencies:
    """C and Python, samples and blocks, all four at once."""
    edges_path = start_with_edges(bench)
    files = {
        "C, sample": start_c(bench, "c-sample", seconds),
        "C, block": start_c(bench, "c-block", seconds, "block"),
        "Python, sample": start_python(bench, "python-sample", seconds),
        "Python, block": start_python(bench, "python-block", seconds, "block"),
    }
    wait_for_ready(bench, [path.stem for path in files.values()])
    pid = bench.segment.processes["dds"].pid
    cpu, cycle = cpu_seconds(pid), bench.segment.status()["cycle_number"]
    wait_for_ends(bench, seconds + 60)
    cpu, cycle = cpu_seconds(pid) - cpu, bench.segment.status()["cycle_number"] - cycle
    stop(bench)
    edges = Edges(edges_path)
    found: dict[str, list[float]] = {}
    for name, path in files.items():
        by_take: dict[tuple[int, int], list[float]] = {}
        for row in rows(path)[200:]:  # not what waited while it started
            late = (int(row["taken_ns"]) - edges.mono_of(int(row["dc_time_ns"]))) / 1e3
            by_take.setdefault((int(row["slave"]), int(row["taken_ns"])), []).append(late)
        if "block" in name:
            found[f"{name}, newest cycle"] = [min(late) for late in by_take.values()]
            found[f"{name}, oldest cycle"] = [max(late) for late in by_take.values()]
        else:
            found[name] = [late for each in by_take.values() for late in each]
    return Latencies(found, cpu / (cycle / 1000) * 100, cycle)


@dataclass
class RoundTrip:
    """One command, in cycles of 1 ms: DDS write to the frame at the slave, and to the answer."""

    value: int
    cycle: int  # of the answer
    led_cycles: float | None  # None: that frame did not come back in its cycle
    answer_cycles: float


def changed(commander: Commander, value: int) -> dict[str, Any]:
    """The answer to a command that changes the LED to @value; one that a busy machine refuses is
    repeated, from the other value on."""
    for _ in range(20):
        answer = commander.command({LED: value})
        if answer["accepted"]:
            return answer
        assert is_passing(answer), answer
        commander.accepted({LED: 1 - value})
    raise AssertionError(answer)


def round_trips(bench: Bench, count: int) -> list[RoundTrip]:
    """LED on and off, each command after the answer to the last."""
    edges_path = start_with_edges(bench)
    commander = bench.commander()
    answers = []
    for value in (k % 2 for k in range(1, count + 1)):
        answers.append((value, changed(commander, value)))
        expected = f"led={value}"
        wait_for(f"LED with {expected}", lambda e=expected: lamp(bench) == e, 10)
    bench.segment.wait_for_cycles(50, 30)
    stop(bench)
    edges = Edges(edges_path)
    cycles = {m.cycle: m for m in cycles_of(bench)}
    found = []
    for value, answer in answers:
        m = cycles[answer["cycle"]]
        took = None
        if m.frame_dc_ns != 0:
            took = (edges.mono_of(m.frame_dc_ns) - answer["sent_ns"]) / 1e6
        else:
            assert m.flags & LOST, f"cycle {m.cycle} of the answer had no frame"
        found.append(RoundTrip(value, m.cycle, took, answer["ms"]))
    return found


def cycles_of(bench: Bench) -> list:
    return list(live.recorded(bench.segment.record_dir, "/ecdaq/cycle"))
