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

    @property
    def ran(self) -> int:
        return self.passed + len(self.failures)

    def add(self, other: Outcome) -> None:
        self.passed += other.passed
        self.failures += other.failures
        self.skips += other.skips

    def totals(self) -> str:
        return f"{self.passed} passed, {len(self.failures)} failed, {len(self.skips)} skipped"


def tail(text: str, lines: int) -> str:
    return "\n".join(text.rstrip().splitlines()[-lines:])


def read_junit(path: Path, label: str) -> Outcome:
    """Count the test cases of a JUnit file, as written by ctest or by pytest."""
    outcome = Outcome()
    for case in ET.parse(path).getroot().iter("testcase"):
        where = case.get("classname", "")
        name = case.get("name", "?")
        if where and where != name:
            name = f"{where}.{name}"
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
            said = re.search(r"^skipped: (.*)$", output, re.MULTILINE)
            outcome.skips.append(f"{label}: {name}: {said.group(1) if said else why}")
        else:
            outcome.passed += 1
    return outcome
