# SPDX-License-Identifier: MIT
"""From a fresh Debian 12 and this source tree to the first cycle in OP, step by step."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from measure.page import NotMeasuredError

IN_OP = "slaves in OP"
RUN = "run --seconds 1 --json"
REST = "the rest: what is missing, start"


@dataclass
class Times:
    """Of one call of build.sh: seconds of each step, and of the whole until @IN_OP or the end."""

    steps: dict[str, float] = field(default_factory=dict)
    whole: float = 0.0

    @property
    def rest(self) -> float:
        return self.whole - sum(self.steps.values())


def read_steps(lines: Iterable[str]) -> dict[str, float]:
    """Lines "MILLISECONDS TEXT" of $ECDAQ_STEP_TIMES; a step that came twice is one."""
    steps: dict[str, float] = {}
    for line in lines:
        milliseconds, _, text = line.strip().partition(" ")
        steps[text] = steps.get(text, 0.0) + int(milliseconds) / 1000
    return steps


def copy_sources(root: Path, folder: Path) -> None:
    """What a clone of this tree has, with the changes that are not committed."""
    words = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(words, cwd=root, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        if (root / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, folder / name)


def call(command: list[str | Path], folder: Path, words: str) -> Times:
    """Run build.sh with @words by the shell that @command starts; its output goes to folder/log."""
    steps = folder / "steps"
    steps.unlink(missing_ok=True)
    script = f"ECDAQ_STEP_TIMES=/mnt/steps exec /mnt/ecdaq/build.sh {words}"
    print(f"setup: ./build.sh {words}", flush=True)
    start = time.monotonic()
    in_op = None
    with subprocess.Popen(
        [*command, "sh", "-c", script], stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        lines = []
        for line in process.stdout:
            lines.append(line)
            if IN_OP in line:
                in_op = in_op or time.monotonic()
    end = time.monotonic()
    if process.returncode != 0 or (words == RUN and in_op is None):
        last = "".join(lines[-10:]).rstrip()
        raise NotMeasuredError(f"./build.sh {words} ended with {process.returncode}:\n{last}")
    return Times(read_steps(steps.read_text().splitlines()), (in_op or end) - start)


def table(columns: dict[str, Times]) -> list[str]:
    """A row for each step, in the order of the first call that has it."""
    names = list(dict.fromkeys(name for times in columns.values() for name in times.steps))
    width = max(len(name) for name in [*names, REST])
    lines = [f"{'s':{width}} " + " ".join(f"{title:>12}" for title in columns)]
    rows = [(name, [times.steps.get(name) for times in columns.values()]) for name in names]
    rows.append((REST, [times.rest for times in columns.values()]))
    rows.append(("together", [times.whole for times in columns.values()]))
    for name, values in rows:
        cells = [f"{'-' if value is None else f'{value:.1f}':>12}" for value in values]
        lines.append(f"{name:{width}} " + " ".join(cells))
    return lines


def measure_calls(root: Path) -> dict[str, Times]:
    """Each cold call on an overlay of its own, with a copy of the sources of its own."""
    tools = root / "app/tools/deb"
    made = subprocess.run([tools / "fresh-tree.sh"], stdout=subprocess.PIPE, text=True, check=False)
    if made.returncode != 0:
        raise NotMeasuredError("no fresh system (see above)")
    columns = {}
    for title, words in (("run", RUN), ("build", "build")):
        with tempfile.TemporaryDirectory(prefix="ecdaq-setup-") as name:
            folder = Path(name)
            copy_sources(root, folder / "ecdaq")
            command = [tools / "in-chroot.sh", "--network", made.stdout.strip(), folder]
            columns[title] = call(command, folder, words)
    return columns


def lines_of(root: Path) -> list[str]:
    if os.geteuid() != 0:
        raise NotMeasuredError("setup needs root: the fresh system is a chroot")
    from measure import tests_run

    before, cores = os.getloadavg()[0], os.cpu_count()
    columns = measure_calls(root)
    lines = [
        "A fresh Debian 12 (a chroot of priority important), an empty cache;",
        f"load average before: {before:.2f}, {cores} cores.",
        f"run: `./build.sh {RUN}` until the slaves are in OP; build: `./build.sh build`.",
        "",
        *table(columns),
    ]
    try:
        tests = tests_run.measure(root)
    except NotMeasuredError as why:
        print(f"setup: without the times of tests: {why}", file=sys.stderr)
        return lines
    return [*lines, "", "the last `./build.sh test` in this tree:", "", *tests]
