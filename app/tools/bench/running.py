# SPDX-License-Identifier: MIT
"""One master or floor at a time on a segment, and what it left behind."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from foreign import Unavailable

from bench.figures import Records, histogram_values, strace_calls, sync0_spread
from bench.peers import BIN, PRIORITY, PROGRAMS, ROOT, program

sys.path.insert(0, str(ROOT / "tests" / "live"))
from segment import Namespace, wait_for

SETTLE = 500
# How long an answer is waited for: ecdaq's default of cycle.receive, 40 % of 1 ms.
LIMIT_NS = 400_000
PERIOD_NS = 1_000_000
STRACE_PERIOD_NS = 5_000_000
STRACE_SECONDS = 2.0
FREE_MS = 500
START_SECONDS = 120
ATTEMPTS = 5
# Every so many frames one is lost on the way back.
LOSS_EVERY = 100
# A round is disturbed if others took so much of one core, or the machine below so much of it.
OTHERS_MOST = 0.1
STOLEN_MOST = 0.02
HERTZ = os.sysconf("SC_CLK_TCK")


class RunError(Exception):
    """A master did not start, or ended early."""


@dataclass
class Load:
    """What else the processors did while something ran."""

    average: float
    others: float
    stolen: float

    @property
    def is_disturbed(self) -> bool:
        return self.others > OTHERS_MOST or self.stolen > STOLEN_MOST


class LoadMeter:
    """Measures from its making to load(), of which all children have ended."""

    def __init__(self) -> None:
        self.start = self.now()

    @staticmethod
    def now() -> tuple[float, float, float, float]:
        fields = Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:]
        user, nice, system, _, _, irq, soft, steal = (int(n) / HERTZ for n in fields[:8])
        used = [resource.getrusage(w) for w in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
        own = sum(usage.ru_utime + usage.ru_stime for usage in used)
        return time.monotonic(), user + nice + system + irq + soft, own, steal

    def load(self) -> Load:
        at, busy, own, stolen = (b - a for a, b in zip(self.start, self.now(), strict=True))
        others = max(0.0, busy - own) / at
        return Load(os.getloadavg()[0], round(others, 3), round(stolen / at, 3))


@dataclass
class Run:
    """What a master did in one run."""

    op_s: float
    records: Records
    slaves: int = 0
    # Good answers a second without pauses.
    free_rate: float | None = None
    # Over the run and in its second half, ns.
    spread: tuple[int, int] | None = None
    attempts: int = 1
    op_ns: int = 0


class Wire:
    """A simulated segment of its own for each run; or an interface with slaves of this machine."""

    def __init__(self, interface: str | None) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="ecdaq-bench-", dir="/dev/shm"))
        self.space = None if interface else Namespace()
        self.nic = interface or "ecat0"
        self.enter = self.space.enter if self.space else []
        is_real_time = subprocess.run(["chrt", "-f", "1", "true"], capture_output=True)
        self.has_priority = is_real_time.returncode == 0

    def close(self) -> None:
        if self.space:
            self.space.close()
        shutil.rmtree(self.folder)

    def priority(self, number: int) -> list[str]:
        return ["chrt", "-f", str(number)] if self.has_priority else []

    def popen(self, command: list[str], out: int | IO[bytes]) -> subprocess.Popen[bytes]:
        """Started in the namespace; messages go to the file errors."""
        with (self.folder / "errors").open("ab") as errors:
            return subprocess.Popen([*self.enter, *command], stdout=out, stderr=errors)

    def forget_errors(self) -> None:
        (self.folder / "errors").write_bytes(b"")

    def errors(self) -> str:
        """The last message since then."""
        lines = (self.folder / "errors").read_text(errors="replace").strip().splitlines()
        return lines[-1] if lines else "no message"


class SimulatedSegment:
    """ecdaq-sim, while a with statement lasts."""

    def __init__(self, wire: Wire, slaves: int) -> None:
        self.wire = wire
        self.edges = wire.folder / "edges"
        self.control = wire.folder / "control"
        command = [str(BIN / "ecdaq-sim"), "--interface", "ecsim0", "--slaves", str(slaves)]
        command += ["--control", str(self.control), "--edges", str(self.edges)]
        self.command = command + (["--priority", "50"] if wire.has_priority else [])

    def __enter__(self) -> SimulatedSegment:
        self.process = self.wire.popen(self.command, subprocess.DEVNULL)
        wait_for("control socket of ecdaq-sim", self.control.exists, 10)
        self.tell("io slave=0")
        return self

    def __exit__(self, *_: object) -> None:
        self.process.terminate()
        self.process.wait(30)
        self.control.unlink(missing_ok=True)

    def tell(self, line: str) -> None:
        tell = [sys.executable, str(ROOT / "app/tools/tell-segment.py"), "--control"]
        subprocess.run([*tell, str(self.control), line], check=True, capture_output=True)


@dataclass(frozen=True)
class Timing:
    """What a loop is to do."""

    cycles: int
    period_ns: int = PERIOD_NS
    settle: int = SETTLE
    free_ms: int = 0

    def arguments(self) -> list[str]:
        limit_ns = LIMIT_NS * self.period_ns // PERIOD_NS
        numbers = (self.period_ns, self.settle, self.cycles, limit_ns, self.free_ms)
        return [str(number) for number in numbers]

    def seconds(self) -> float:
        """More than a run takes, without its bring-up."""
        return 30 + 3 * (self.settle + self.cycles) * self.period_ns / 1e9


class Master:
    """A loop that runs; or ecdaqd with the reader of its ring, which says the same."""

    def __init__(
        self,
        wire: Wire,
        command: list[str] | None,
        timing: Timing,
        wrapper: list[str] | None = None,
    ) -> None:
        self.wire = wire
        self.file = wire.folder / "records"
        self.daemon: subprocess.Popen[bytes] | None = None
        wire.forget_errors()
        self.start_ns = time.monotonic_ns()
        arguments = [*timing.arguments(), str(self.file)]
        try:
            if command is None:
                ring = self.start_daemon(timing)
                words = [program("bench_ring_times"), str(ring), *arguments]
            else:
                start = wrapper if wrapper is not None else wire.priority(PRIORITY)
                words = [*start, *command, wire.nic, *arguments]
            self.loop = wire.popen(words, subprocess.PIPE)
        except BaseException:
            self.end()
            raise
        self.traced = self.daemon or self.loop

    def start_daemon(self, timing: Timing) -> Path:
        run_dir = self.wire.folder / "run"
        shutil.rmtree(run_dir, ignore_errors=True)
        run_dir.mkdir()
        switch = self.wire.folder / "switch"
        switch.write_bytes(bytes(4096))
        os.environ["ECDAQ_BENCH_SWITCH"] = str(switch)
        preload = ["env", f"LD_PRELOAD={program('libbench_free.so')}"] if timing.free_ms else []
        words = [*preload, str(BIN / "ecdaqd"), "--exit-on-failure", "--run-dir", str(run_dir)]
        words += [
            "--interface",
            self.wire.nic,
            "--set",
            f"cycle.period={timing.period_ns // 1000}us",
        ]
        if self.wire.space:
            words.append("--simulated")
        self.daemon = self.wire.popen(words, subprocess.DEVNULL)
        return run_dir / "samples"

    def wait_for_op(self) -> tuple[int, int]:
        """When it was reached (CLOCK_MONOTONIC), and the number of slaves."""
        slaves = 0
        assert self.loop.stdout is not None
        for line in self.loop.stdout:
            word, number = line.split()[:2]
            if word == b"op":
                return int(number), slaves
            slaves = int(number)
        self.end()
        raise RunError(self.wire.errors())

    def finish(self, seconds: float) -> tuple[Records, float | None]:
        """Records, and the rate of the free run."""
        try:
            out = self.loop.communicate(timeout=seconds)[0].split()
        except subprocess.TimeoutExpired:
            self.end()
            raise RunError(f"not ready after {seconds:.0f} s") from None
        if self.loop.returncode != 0:
            self.end()
            raise RunError(self.wire.errors())
        self.end()
        rate = int(out[1]) * 1e9 / int(out[2]) if out[:1] == [b"free"] else None
        return Records.read(self.file), rate

    def end(self) -> None:
        for process in (getattr(self, "loop", None), self.daemon):
            if process is None:
                continue
            if process.poll() is None:
                process.terminate()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait(10)


def again(run: Callable[[], Run]) -> Run:
    """A start that fails, as on a busy machine it may, is repeated."""
    for attempt in range(1, ATTEMPTS + 1):
        try:
            result = run()
            result.attempts = attempt
            return result
        except RunError:
            if attempt == ATTEMPTS:
                raise
    raise AssertionError


def run_cycles(wire: Wire, command: list[str] | None, slaves: int, cycles: int) -> Run:
    """Bring-up, cycles, free run; on an interface of this machine no free run."""

    def run_one(segment: SimulatedSegment | None) -> Run:
        timing = Timing(cycles, free_ms=FREE_MS if segment else 0)
        master = Master(wire, command, timing)
        op_ns, found = master.wait_for_op()
        records, rate = master.finish(timing.seconds())
        return Run((op_ns - master.start_ns) / 1e9, records, found, rate, op_ns=op_ns)

    def run_simulated() -> Run:
        with SimulatedSegment(wire, slaves) as segment:
            result = run_one(segment)
        end_ns = int(result.records.wake_ns.max())
        result.spread = sync0_spread(segment.edges.read_bytes(), result.op_ns, end_ns)
        return result

    return again(run_simulated if wire.space else lambda: run_one(None))


def run_loss(wire: Wire, command: list[str] | None, slaves: int, cycles: int) -> Records:
    """Cycles while each LOSS_EVERYth frame is lost on the way back."""

    def run() -> Run:
        with SimulatedSegment(wire, slaves) as segment:
            master = Master(wire, command, Timing(cycles))
            master.wait_for_op()
            segment.tell(f"every={LOSS_EVERY} lose")
            records, _ = master.finish(Timing(cycles).seconds())
        return Run(0, records)

    return again(run).records


def run_strace(
    wire: Wire, command: list[str] | None, slaves: int, options: tuple[str, ...] = ("-f",)
) -> float:
    """System calls a second, in OP with cycles of STRACE_PERIOD_NS: of all threads, or without
    options of the first one."""
    cycles = int((STRACE_SECONDS + 2) * 1e9 / STRACE_PERIOD_NS)
    table = wire.folder / "strace"

    def run() -> Run:
        with SimulatedSegment(wire, slaves):
            master = Master(wire, command, Timing(cycles, STRACE_PERIOD_NS))
            master.wait_for_op()
            words = ["strace", *options, "-c", "-o", str(table), "-p", str(master.traced.pid)]
            tracer = subprocess.Popen(words, stderr=subprocess.PIPE)
            assert tracer.stderr is not None
            tracer.stderr.readline()  # attached
            start = time.monotonic()
            try:
                tracer.wait(STRACE_SECONDS)
            except subprocess.TimeoutExpired:
                tracer.send_signal(signal.SIGINT)
            seconds = time.monotonic() - start
            tracer.wait(10)
            master.end()
        return Run(seconds, Records.empty())

    seconds = again(run).op_s
    return strace_calls(table.read_text()) / seconds


def run_echo(wire: Wire, slaves: int, cycles: int) -> Run:
    """A frame as long as one with the process data of so many Piccolos."""
    echo = program("bench_echo")
    answerer = wire.popen([*wire.priority(50), echo, "reflect", "ecsim0"], subprocess.PIPE)
    try:
        assert answerer.stdout is not None
        answerer.stdout.readline()
        timing = Timing(cycles, free_ms=FREE_MS)
        master = Master(wire, [echo, str(echo_bytes(slaves))], timing)
        master.wait_for_op()
        records, rate = master.finish(timing.seconds())
        return Run(0, records, slaves, rate)
    finally:
        answerer.terminate()
        answerer.wait(10)


def echo_bytes(slaves: int) -> int:
    """Ethernet and EtherCAT heads, FRMW of the time, one LRW with 22 bytes of each slave."""
    return min(1514, max(60, 14 + 2 + 12 + 8 + 12 + 22 * slaves))


def run_cyclictest(wire: Wire, command: list[str], cycles: int) -> Run:
    """A thread that only sleeps; its latency in place of records."""
    words = [*command, "-q", "-m", "-t", "1", "-h", "10000", "-l", str(cycles)]
    words += ["-i", str(PERIOD_NS // 1000)]
    words += ["-p", str(PRIORITY)] if wire.has_priority else []
    seconds = Timing(cycles).seconds()
    ended = subprocess.run(words, capture_output=True, text=True, timeout=seconds)
    if ended.returncode != 0:
        raise RunError(f"cyclictest: {ended.stderr.strip()[-200:]}")
    return Run(0, Records.of_latency(histogram_values(ended.stdout)[0]))


def is_tracer_there() -> None:
    if shutil.which("strace") is None:
        raise Unavailable("strace is missing (app/tools/packages.txt: strace)")


def programs_are_there() -> None:
    for path in (BIN / "ecdaqd", BIN / "ecdaq-sim", PROGRAMS / "bench_ring_times"):
        if not path.exists():
            raise Unavailable(f"{path}: not built (./build.sh build)")
