# SPDX-License-Identifier: MIT
"""Peers that mean no good: ecdaq-dds lives, serves the others, and the cycle does not notice.

ECDAQ_DDS_SECONDS: duration of each (10). ECDAQ_DDS_SEED: of the fuzzer.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
from collections.abc import Callable

from bench import BUILD, Bench, Commander, wait_for
from figures import COMMANDER, DOMAIN, LED, cycles_of, start_c, start_python
from flags import LOST
from test_samples import (
    FOREVER,
    end_subscribers,
    finish,
    gaps_of,
    of_recording,
    of_subscriber,
    since,
    wait_for_cycle,
)
from vendors import JOINING_CYCLES, SECONDS, joined

SEED = os.environ.get("ECDAQ_DDS_SEED", "1")
APPLIANCE = "10.77.0.1"
LEARN_S = "5"


def lost_share(bench: Bench, first: int, last: int) -> float:
    some = [m for m in cycles_of(bench) if first <= m.cycle <= last]
    return sum(bool(m.flags & LOST) for m in some) / len(some)


def start_fuzzer(bench: Bench, seconds: float) -> tuple[subprocess.Popen[bytes], Commander]:
    """Learns from a subscriber and a commander that start meanwhile, and live on."""
    fuzzer = bench.python(
        "fuzzer", "fuzz_rtps.py", "--interface", "dds1", "--host", APPLIANCE,
        "--learn", LEARN_S, "--seconds", str(seconds), "--seed", SEED,
    )  # fmt: skip
    wait_for("the fuzzer", lambda: "listening" in bench.log("fuzzer"), 30)
    start_c(bench, "decoy", FOREVER)
    decoy = bench.commander()
    for k in range(20):
        decoy.accepted({LED: k % 2})
    # Not before: a changed copy may make the appliance ignore the decoy's own packets.
    fuzzer.send_signal(signal.SIGUSR1)
    wait_for("what it learned", lambda: "learned" in bench.log("fuzzer"), 60)
    assert fuzzer.poll() is None, bench.log("fuzzer")
    return fuzzer, decoy


def attacked(bench: Bench, seconds: float) -> tuple[float, float]:
    """Share of frames lost before the attack, and during it. All else is asserted here."""
    bench.start_all()
    quiet = bench.segment.status()["cycle_number"]
    bench.segment.wait_for_cycles(4000, 60)
    honest = {
        "C": start_c(bench, "honest-c", FOREVER),
        "Python": start_python(bench, "honest-python", FOREVER),
    }
    known = bench.wait_for_subscribers(len(honest))
    fuzzer, decoy = start_fuzzer(bench, seconds)
    first = bench.segment.status()["cycle_number"]
    program = str(BUILD / "tests" / "dds" / "dds_hostile")
    hostile = bench.on_pc("hostile", program, DOMAIN, "dds1", str(int(seconds)), APPLIANCE)
    joining = start_python(bench, "joining", FOREVER)  # served, but nobody knows from when on
    for process in (fuzzer, hostile):
        assert process.wait(seconds + 60) == 0, bench.logs()
    last = bench.segment.status()["cycle_number"]
    wait_for_cycle([*honest.values(), joining], last)
    decoy.kill()
    bench.started.remove(decoy.process)
    after = start_c(bench, "after", FOREVER)  # somebody new is served as before
    wait_for_cycle([after], bench.segment.status()["cycle_number"] + 3 * JOINING_CYCLES)
    assert bench.segment.processes["dds"].poll() is None, bench.log("dds")
    end_subscribers(bench)
    finish(bench, 60)
    print(bench.log("hostile").splitlines()[-1])
    print(*bench.log("fuzzer").splitlines()[1:], sep="; ")
    recorded = of_recording(bench)
    assert not gaps_of(recorded, 0), "the recording has gaps"
    for name, path in (honest | {"Python, joining": joining, "C, after": after}).items():
        got = of_subscriber(path)
        assert not [key for key, value in got.items() if recorded.get(key) != value], name
        if path is not joining:
            counted = since(got, known) if name in honest else joined(got)
            gaps = gaps_of(counted, 0) + gaps_of(counted, 1)
            print(f"{name}: {len(got)} samples, {len(gaps)} gaps")
            assert not gaps, (name, gaps)
    return lost_share(bench, quiet, quiet + 4000), lost_share(bench, first, last)


def test_malformed_packets_wrong_types_and_garbage_have_no_effect(
    make_bench: Callable[..., Bench],
) -> None:
    for attempt in (1, 2, 3):  # what depends on the machine is measured again
        bench = make_bench(**COMMANDER)
        before, during = attacked(bench, max(8.0, SECONDS / 2))
        sent = re.search(r"sent (\d+) packets", bench.log("fuzzer"))
        assert sent and int(sent.group(1)) > 1000
        print(f"frames lost: {100 * before:.3f} % before, {100 * during:.3f} % during the attack")
        if during <= 2 * before + 0.002:
            return
        print(f"attempt {attempt}: not alike")
    raise AssertionError((before, during))
