# SPDX-License-Identifier: MIT
"""What ecdaq-sync0 finds reaches a subscriber on another machine."""

from __future__ import annotations

import json
from collections.abc import Callable

from bench import Bench, live
from test_samples import DOMAIN


def test_results_of_every_slave_reach_a_subscriber(make_bench: Callable[..., Bench]) -> None:
    bench = make_bench()
    segment = bench.segment
    edges = str(bench.folder / "edges")
    segment.start_sim("--edges", edges)
    segment.start_daemon()
    segment.wait_for_op()
    bench.start_dds()
    check = [*segment.options(), "--edges", edges, "--set", "sync0.window=1s"]
    segment.start("sync0", str(live.BIN / "ecdaq-sync0"), *check)
    subscriber = bench.python(
        "results", "sync0_python.py", "--interface", "dds1", "--domain", DOMAIN, "--slaves", "2"
    )
    assert subscriber.wait(120) == 0, bench.logs()
    found = [json.loads(line) for line in bench.log("results").splitlines()]
    assert [m["slave"] for m in found] == [0, 1]
    for m in found:
        assert m["source"] == "simulated edges"
        assert (m["edges"], m["cycles"], m["missing"]) == (1000, 1000, 0)
