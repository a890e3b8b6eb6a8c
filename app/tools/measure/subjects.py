# SPDX-License-Identifier: MIT
"""What `./build.sh measure` can measure: mostly commands whose output is the page."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from measure import fuzz, tests_run, tree
from measure.page import NotMeasuredError, Subject

SCENARIOS = "build/release/tests/sim/scenarios"
LOCK_TEST = "sim_clocks.lock_phase_and_sync0_hold_from_a_hundred_starts"
SECONDS = os.environ.get("ECDAQ_DDS_SECONDS", "60")
TRIALS = os.environ.get("ECDAQ_FAULT_TRIALS", "20")
CUTS = os.environ.get("ECDAQ_POWER_CUTS", "20")
DISKS = os.environ.get("ECDAQ_CUT_DISKS", "10000")
UPDATE_DISKS = os.environ.get("ECDAQ_UPDATE_DISKS", "2000")
FUZZ_TARGETS = os.environ.get("ECDAQ_FUZZ_TARGETS", "eni esi").split()
FUZZ_SECONDS = int(os.environ.get("ECDAQ_FUZZ_SECONDS", "3600"))
FIRST_BOOTS = os.environ.get("ECDAQ_FIRST_BOOTS", "12")
WEB_HOUR_SECONDS = os.environ.get("ECDAQ_WEB_HOUR_SECONDS", "3600")
UPDATE_BOOTS = os.environ.get("ECDAQ_UPDATE_BOOTS", "8")


def run(command: list[str], keep: str, root: Path) -> list[str]:
    """Run @command in the tree; the lines of its output that match @keep."""
    env = os.environ | {
        "ECDAQ_BUILD": str(root / "build/release"),
        "ECDAQ_BIN_DIR": str(root / "build/stage/bin"),
        "ECDAQ_STAGE": str(root / "build/stage"),
        "ECDAQ_FLAVOUR": "release",
        "ECDAQ_DDS_SECONDS": SECONDS,
        "ECDAQ_POWER_CUTS": CUTS,
        "ECDAQ_CUT_DISKS": DISKS,
        "ECDAQ_UPDATE_DISKS": UPDATE_DISKS,
        "ECDAQ_UPDATE_BOOTS": UPDATE_BOOTS,
        "ECDAQ_FIRST_BOOTS": FIRST_BOOTS,
        "ECDAQ_FAULT_TRIALS": TRIALS,
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    result = subprocess.run(
        command, cwd=root, env=env, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    if result.returncode != 0:
        last = "\n".join(result.stdout.splitlines()[-10:])
        raise NotMeasuredError(f"{command[0]} ended with {result.returncode}:\n{last}")
    # The dots of pytest may precede a line of the test.
    lines = [re.sub(r"^(\d+: )|^\.[.sF]*(?=[^.])", "", line) for line in result.stdout.splitlines()]
    return [line.rstrip() for line in lines if re.search(keep, line)]


def program(*words: str, keep: str = ".") -> tuple[str, Callable[[Path], list[str]]]:
    return " ".join(words), partial(run, list(words), keep)


def fault_matrix(root: Path) -> list[str]:
    """The table of sim_fault_matrix in the order of its source (it runs the last row first), and
    the time to fail-safe outputs while the service thread is busy."""
    lines = run([f"{SCENARIOS}/sim_fault_matrix"], r"^(?!passed|\d+ passed)\S", root)
    safe = run([f"{SCENARIOS}/sim_fail_safe_busy"], "fail-safe outputs", root)
    head = "median and maximum; ms to OP from the end of the fault, or from its start"
    return [head, "", *lines[:1], *reversed(lines[1:]), "", *safe]


def pytest(*words: str, keep: str) -> tuple[str, Callable[[Path], list[str]]]:
    command = [sys.executable, "-m", "pytest", "-q", "-s", "-p", "no:cacheprovider", *words]
    return " ".join(["pytest", "-s", *words]), partial(run, command, keep)


def subject(
    name: str,
    title: str,
    how: tuple[str, Callable[[Path], list[str]]],
    is_quick: bool = False,
) -> Subject:
    return Subject(name, title, (how[0],), how[1], is_quick)


# Lines of pytest itself are not part of the page.
NOT_PYTEST = r"^(?!\s*$|[.sF]*\s*(\[ *\d+%\])?$|=+ |\d+ passed|SKIPPED|-- |\s*$)"
ALL = (
    subject(
        "run",
        "1.5 hours of bus time, two slaves at +-100 ppm",
        program(f"{SCENARIOS}/sim_long_run", "5400000", "1"),
        is_quick=True,
    ),
    subject(
        "lock",
        "Distributed clocks from 100 starts",
        program(f"{SCENARIOS}/sim_clocks", LOCK_TEST, keep="worst of"),
        is_quick=True,
    ),
    Subject(
        "faults",
        f"Faults and recovery, {TRIALS} buses each (ECDAQ_FAULT_TRIALS)",
        (f"{SCENARIOS}/sim_fault_matrix", f"{SCENARIOS}/sim_fail_safe_busy"),
        fault_matrix,
        is_quick=True,
    ),
    subject(
        "replay",
        "Captures of real buses against the simulated segment",
        program(
            *("ctest", "--test-dir", "build/release", "-L", "^replay$", "-V"),
            keep=r"frames, \d+ datagrams|not explained|frame back at port",
        ),
        is_quick=True,
    ),
    subject(
        "live",
        "A minute at 1 ms over a veth pair",
        pytest("tests/live/test_run.py", "-k", "minute", keep=r"^\.?\{|frames lost"),
        is_quick=True,
    ),
    subject(
        "kit",
        "An hour of two slaves in the Python kit",
        (
            "python tests/kit/hour.py",
            partial(run, [sys.executable, "tests/kit/hour.py"], "."),
        ),
        is_quick=True,
    ),
    subject(
        "fleet",
        "Recordings of 50 appliances to one Parquet dataset",
        (
            "python tests/kit/fleet.py",
            partial(run, [sys.executable, "tests/kit/fleet.py"], "."),
        ),
    ),
    subject(
        "web",
        "Clients of ecdaq-web",
        (
            "python tests/cli/web_figures.py",
            partial(run, [sys.executable, "tests/cli/web_figures.py"], "."),
        ),
    ),
    subject(
        "web-hour",
        f"ecdaq-web and its page, open for {WEB_HOUR_SECONDS} s (ECDAQ_WEB_HOUR_SECONDS)",
        (
            f"python tests/cli/web_hour.py {WEB_HOUR_SECONDS}",
            partial(run, [sys.executable, "tests/cli/web_hour.py", WEB_HOUR_SECONDS], "."),
        ),
    ),
    subject(
        "stream-fleet",
        "Live streams of 50 appliances into one JetStream",
        (
            "python tests/cli/stream_fleet.py",
            partial(run, [sys.executable, "tests/cli/stream_fleet.py"], "."),
        ),
    ),
    subject(
        "upload-fleet",
        "Recordings of 50 appliances through one object store to one query",
        (
            "python tests/cli/upload_fleet.py",
            partial(run, [sys.executable, "tests/cli/upload_fleet.py"], "."),
        ),
    ),
    subject(
        "kills",
        "Stream and uplink of two appliances while their servers are killed, 10 minutes",
        (
            "python tests/cli/kill_figures.py",
            partial(run, [sys.executable, "tests/cli/kill_figures.py"], "."),
        ),
    ),
    subject(
        "web-clients",
        "The cycle while none, 8 and 50 clients use ecdaq-web",
        pytest("tests/live/test_web_clients.py", keep=r"^(clients|\s+\d+  )"),
    ),
    subject(
        "history",
        "Pictures of a day of recordings",
        (
            "python tests/cli/history_figures.py",
            partial(run, [sys.executable, "tests/cli/history_figures.py"], "."),
        ),
    ),
    subject(
        "cycle",
        "Instructions of a cycle, counted by callgrind",
        (
            "python tests/cost/cycle_table.py",
            partial(run, [sys.executable, "tests/cost/cycle_table.py"], ""),
        ),
        is_quick=True,
    ),
    subject(
        "record",
        "Instructions and bytes of a recorded sample",
        (
            "python tests/cost/record_table.py",
            partial(run, [sys.executable, "tests/cost/record_table.py"], ""),
        ),
        is_quick=True,
    ),
    subject(
        "dds",
        f"DDS, {SECONDS} s each (ECDAQ_DDS_SECONDS)",
        pytest(
            *(f"tests/dds/test_{n}.py" for n in ("foreign", "figures", "hostile")), keep=NOT_PYTEST
        ),
    ),
    subject(
        "image",
        "The image in QEMU, in guest time",
        pytest("tests/boot/test_20_segment.py", keep=NOT_PYTEST),
    ),
    subject(
        "power-cuts",
        f"{CUTS} power cuts of the image in QEMU (ECDAQ_POWER_CUTS)",
        pytest("tests/boot/test_50_power_cut.py", "-k", "every_cut", keep=NOT_PYTEST),
    ),
    subject(
        "cut-disks",
        f"{DISKS} disks as a power cut may leave them (ECDAQ_CUT_DISKS)",
        pytest("tests/boot/test_50_power_cut.py", "-k", "every_disk", keep=NOT_PYTEST),
    ),
    subject(
        "update-cuts",
        f"{UPDATE_DISKS} disks as a power cut in an update may leave them (ECDAQ_UPDATE_DISKS)",
        pytest("tests/boot/test_95_update_cuts.py", keep=NOT_PYTEST),
    ),
    subject(
        "first-boot",
        f"First starts of 8 and 512 GB, and {FIRST_BOOTS} that are cut (ECDAQ_FIRST_BOOTS)",
        pytest("tests/boot/test_37_first_boot.py", keep=NOT_PYTEST),
    ),
    Subject(
        "fuzz",
        "Lines of the parsers that the fuzz targets reach",
        ("./build.sh test coverage",),
        fuzz.measure,
    ),
    Subject(
        "fuzz-search",
        f"Search for crashes, {FUZZ_SECONDS} s each (ECDAQ_FUZZ_SECONDS, ECDAQ_FUZZ_TARGETS)",
        tuple(f"./build.sh fuzz {name} {FUZZ_SECONDS}" for name in FUZZ_TARGETS),
        partial(fuzz.search, FUZZ_TARGETS, FUZZ_SECONDS),
    ),
    Subject(
        "ci",
        "Time of the last ./build.sh test",
        ("./build.sh test",),
        tests_run.measure,
        is_quick=True,
    ),
    Subject(
        "tree",
        "Size of the source tree",
        ("./build.sh measure tree",),
        tree.measure,
        is_quick=True,
    ),
)
SUBJECTS = {s.name: s for s in ALL}
# Measured by app/tools/bench.py.
PEERS = Subject(
    "peers", "Beside other masters", ("./build.sh bench peers",), lambda _: [], verb="bench"
)
SIM = Subject(
    "sim", "How fast virtual time is", ("./build.sh bench sim",), lambda _: [], verb="bench"
)
SETUP = Subject(
    "setup", "From nothing to OP", ("./build.sh bench setup",), lambda _: [], verb="bench"
)
PAGES = (*ALL, PEERS, SIM, SETUP)
