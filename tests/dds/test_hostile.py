# SPDX-License-Identifier: MIT
"""Peers that mean no good: ecdaq-dds lives, serves the others, and the cycle does not notice.

ECDAQ_DDS_SECONDS: duration of each (20). ECDAQ_DDS_SEED: of the fuzzer.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable

from bench import BUILD, Bench, Commander, wait_for
from figures import COMMANDER, DOMAIN, LED, cycles_of, start_c, start_python, wait_for_ready
from flags import LOST
from test_samples import finish, gaps_of, of_recording, of_subscriber
from vendors import SECONDS, joined

SEED = os.environ.get("ECDAQ_DDS_SEED", "1")
APPLIANCE = "10.77.0.1"
LEARN_S = "5"


def lost_share(bench: Bench, first: int, last: int) -> float:
    some = [m for m in cycles_of(bench) if first <= m.cycle <= last]
    return sum(bool(m.flags & LOST) for m in some) / len(some)


def start_fuzzer(bench: Bench, seconds: float) -> Commander:
    """Learns from a subscriber and a commander that start meanwhile, and live on."""
    fuzzer = bench.python(
        "fuzzer", "fuzz_rtps.py", "--interface", "dds1", "--host", APPLIANCE,
        "--learn", LEARN_S, "--seconds", str(seconds), "--seed", SEED,
    )  # fmt: skip
    wait_for("the fuzzer", lambda: "listening" in bench.log("fuzzer"), 30)
    start_c(bench, "decoy", seconds + 3)
    decoy = bench.commander()
    for k in range(20):
        decoy.accepted({LED: k % 2})
    wait_for("what it learned", lambda: "learned" in bench.log("fuzzer"), 60)
    assert fuzzer.poll() is None, bench.log("fuzzer")
    return decoy


def attacked(bench: Bench, seconds: float) -> tuple[float, float]:
    """Share of frames lost before the attack, and during it. All else is asserted here."""
    bench.start_all()
    quiet = bench.segment.status()["cycle_number"]
    bench.segment.wait_for_cycles(4000, 60)
    decoy = start_fuzzer(bench, seconds)
    first = bench.segment.status()["cycle_number"]
    program = str(BUILD / "tests" / "dds" / "dds_hostile")
    bench.on_pc("hostile", program, DOMAIN, "dds1", str(int(seconds)), APPLIANCE)
    honest = {
        "C": start_c(bench, "honest-c", seconds - 2),
        "Python": start_python(bench, "honest-python", seconds - 2),
    }
    for process in bench.started:
        if process is not decoy.process:
            assert process.wait(seconds + 60) == 0, bench.logs()
    last = bench.segment.status()["cycle_number"]
    decoy.kill()
    bench.started.remove(decoy.process)
    after = start_c(bench, "after", 2)  # somebody new is served as before
    wait_for_ready(bench, ["after"])
    assert bench.segment.processes["dds"].poll() is None, bench.log("dds")
    finish(bench, 60)
    print(bench.log("hostile").splitlines()[-1])
    print(*bench.log("fuzzer").splitlines()[1:], sep="; ")
    recorded = of_recording(bench)
    assert not gaps_of(recorded, 0), "the recording has gaps"
    for name, path in (honest | {"C, after": after}).items():
        got = of_subscriber(path)
        gaps = gaps_of(joined(got), 0) + gaps_of(joined(got), 1)
        print(f"{name}: {len(got)} samples, {len(gaps)} gaps")
        assert not gaps, (name, gaps)
        assert not [key for key, value in got.items() if recorded.get(key) != value], name
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
