# SPDX-License-Identifier: MIT
"""Instructions that a program of this folder takes, counted by callgrind (see cost.h).

The counts depend on the compiler and the C library, and not on the machine or its load: callgrind
executes the instructions itself, and the processor's extensions, by which the C library chooses
its copying routines, are masked.
"""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

# glibc 2.36 (Debian 12); other versions ignore the words that they do not know.
PLAIN_PROCESSOR = (
    "glibc.cpu.hwcaps=-AVX,-AVX2,-AVX512F,-AVX512VL,-ERMS,-FSRM,-AVX_Fast_Unaligned_Load"
)


@dataclass
class Count:
    """What one run took."""

    instructions: int
    # Of each function with all that it calls.
    inclusive: dict[str, int]
    # Of each function alone; of those shared with what is not counted: too much.
    own: dict[str, int]
    # How often each function was called, in the whole run.
    times: dict[str, int]
    # What the program printed.
    output: str


class Profile:
    """A file of callgrind (its manual, "Callgrind Format")."""

    def __init__(self, text: str) -> None:
        self.own: dict[str, int] = {}
        # By caller and callee: cost of the calls.
        self.calls: dict[tuple[str, str], int] = {}
        self.total = 0
        self.times: dict[str, int] = {}
        names: dict[str, str] = {}
        function = callee = ""
        for line in text.splitlines():
            if match := re.match(r"(c?)fn=(\(\d+\))(?: (.*))?$", line):
                # Recursion and clones: 'name'2, name.part.0.
                name = names.setdefault(match[2], re.split(r"[.']", match[3] or "")[0])
                function, callee = (function, name) if match[1] else (name, "")
            elif match := re.match(r"calls=(\d+) ", line):
                self.times[callee] = self.times.get(callee, 0) + int(match[1])
            elif match := re.match(r"(?:totals|summary): (\d+)$", line):
                self.total = max(self.total, int(match[1]))
            elif match := re.match(r"\d+ (\d+)$", line):
                if callee:
                    pair = (function, callee)
                    self.calls[pair] = self.calls.get(pair, 0) + int(match[1])
                    callee = ""
                else:
                    self.own[function] = self.own.get(function, 0) + int(match[1])

    def aside(self, function: str, above: frozenset[str] = frozenset()) -> int:
        """What @function calls through cost_aside(); a function that does has one caller."""
        return sum(
            cost if callee == "cost_aside" else self.aside(callee, above | {function})
            for (caller, callee), cost in self.calls.items()
            if caller == function and callee not in above | {function}
        )

    def inclusive(self) -> dict[str, int]:
        costs = dict(self.own)
        for (caller, _), cost in self.calls.items():
            costs[caller] = costs.get(caller, 0) + cost
        return {name: cost - self.aside(name) for name, cost in costs.items()}


def count(program: str, *arguments: str | int) -> Count:
    """Run build/.../tests/cost/cost_PROGRAM in a new folder, and count."""
    path = Path(os.environ["ECDAQ_BUILD"]) / "tests" / "cost" / f"cost_{program}"
    with tempfile.TemporaryDirectory(prefix="ecdaq-cost-", dir="/dev/shm") as folder:
        file = Path(folder) / "profile"
        command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={file}"]
        command += ["--compress-pos=no", "--toggle-collect=cost_counted"]
        command += [str(path), folder, *map(str, arguments)]
        run = subprocess.run(
            command,
            capture_output=True,
            text=True,
            env=os.environ | {"GLIBC_TUNABLES": PLAIN_PROCESSOR},
        )
        if run.returncode != 0:
            raise RuntimeError(f"{' '.join(command)}: {run.returncode}\n{run.stdout}{run.stderr}")
        profile = Profile(file.read_text())
    aside = sum(cost for (_, callee), cost in profile.calls.items() if callee == "cost_aside")
    return Count(profile.total - aside, profile.inclusive(), profile.own, profile.times, run.stdout)
