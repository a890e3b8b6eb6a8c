# SPDX-License-Identifier: MIT
"""What tests reported: counts, failures with their last lines, skips with their reasons."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path


@dataclass
class Outcome:
    """What one suite, or all of them, reported."""

    passed: int = 0
    failures: list[str] = field(default_factory=list)
    skips: list[str] = field(default_factory=list)
    log: str = ""
    # (seconds, name) of each test; (group, wall seconds, CPU seconds) of each group.
    times: list[tuple[float, str]] = field(default_factory=list)
    groups: list[tuple[str, float, float]] = field(default_factory=list)

    @property
    def ran(self) -> int:
        return self.passed + len(self.failures)

    def add(self, other: Outcome) -> None:
        self.passed += other.passed
        self.failures += other.failures
        self.skips += other.skips
        self.times += other.times
        self.groups += other.groups

    def totals(self) -> str:
        return f"{self.passed} passed, {len(self.failures)} failed, {len(self.skips)} skipped"


def tail(text: str, lines: int) -> str:
    return "\n".join(text.rstrip().splitlines()[-lines:])


def fail_unexpected_skips(total: Outcome, expected: Path) -> None:
    """Each skip that no line of @expected (PATTERN, two blanks, REASON) matches is a failure."""
    lines = [line for line in expected.read_text().splitlines() if line and line[0] != "#"]
    patterns = [line.split("  ")[0] for line in lines]
    for skip in list(total.skips):
        if not any(re.search(pattern, skip) for pattern in patterns):
            total.skips.remove(skip)
            total.failures.append(f"{skip} (a skip that tests/expected_skips.txt does not list)")


def read_junit(path: Path, label: str) -> Outcome:
    """Count the test cases of a JUnit file, as written by ctest or by pytest."""
    outcome = Outcome()
    for case in ET.parse(path).getroot().iter("testcase"):
        where = case.get("classname", "")
        name = case.get("name", "?")
        if where and where != name:
            name = f"{where}.{name}"
        outcome.times.append((float(case.get("time") or 0), f"{label}: {name}"))
        output = case.findtext("system-out") or ""
        bad = [e for e in case if e.tag in ("failure", "error")]
        skipped = case.find("skipped")
        if bad:
            text = output or bad[0].text or bad[0].get("message") or ""
            outcome.failures.append(f"{label}: {name}\n{tail(text, 30)}")
        elif skipped is not None:
            why = skipped.get("message") or ""
            if case.get("status") == "notrun" and why != "SKIP_RETURN_CODE=77":
                outcome.failures.append(f"{label}: {name}\ncould not be run: {why}")
                continue
            reason = re.search(r"^skipped: (.*)$", output, re.MULTILINE)
            outcome.skips.append(f"{label}: {name}: {reason.group(1) if reason else why}")
        else:
            outcome.passed += 1
    return outcome
