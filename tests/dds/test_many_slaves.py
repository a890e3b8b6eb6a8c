# SPDX-License-Identifier: MIT
"""512 slaves with 3072 channels over DDS: channel table, status, and a sample of each slave."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable

from bench import BUILD, Bench, wait_for

SLAVES = 512
ENTRIES = ("led", "oneshot_time", "adc", "counter", "sample_time", "status")


def test_all_of_512_slaves_comes_over_dds(make_bench: Callable[..., Bench]) -> None:
    bench = make_bench()
    program = BUILD / "tests" / "cli" / "test_fake_daemon_512"
    master = subprocess.Popen(
        [*bench.segment.space.enter, str(program), str(bench.segment.run_dir)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert master.stdout is not None and master.stdout.readline() == "ready\n"
        bench.start_dds()
        taker = bench.python("taker", "many_python.py", "dds1", "7", str(SLAVES), "60")
        wait_for("end of the subscriber", lambda: taker.poll() is not None, 150)
    finally:
        master.kill()
        master.communicate()
    log = bench.logs()
    got = json.loads(log["taker"].splitlines()[-1])
    assert got["names"] == [f"piccolo{i}.{e}" for i in range(SLAVES) for e in ENTRIES]
    assert got["slave"] == [i for i in range(SLAVES) for _ in ENTRIES]
    assert (got["state"], got["slaves"]) == ("OP", SLAVES)
    assert got["sampled"] == list(range(SLAVES))
    assert got["wrong"] == []
