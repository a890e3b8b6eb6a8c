# SPDX-License-Identifier: MIT
"""A page of results: what was run, on what, when, and what it printed."""

from __future__ import annotations

import datetime
import os
import platform
import subprocess
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

NOTE = (
    "Timings of an emulated or shared machine show that a function works, not how fast it is on\n"
    "the hardware it is made for. Counts (lost, bad, gaps, differences) hold everywhere."
)

INDEX = """# Measurement results

One page per subject, written by `./build.sh measure` or `bench`, as is this list: the command,
the commit, the machine, the date, and what was measured. The manuals state bounds and commands;
figures of one machine belong here.

"""


class NotMeasuredError(Exception):
    """The command failed, or printed nothing that belongs on the page."""


@dataclass(frozen=True)
class Subject:
    """One page."""

    name: str
    title: str
    commands: tuple[str, ...]
    # The lines of the page.
    measure: Callable[[Path], list[str]]
    is_quick: bool = False
    # Of build.sh.
    verb: str = "measure"

    @property
    def written_by(self) -> str:
        return f"`./build.sh {self.verb} {self.name}`"


def machine() -> str:
    """Processor, cores, kernel; whether it is a virtual machine."""
    cpu = "unknown processor"
    text = Path("/proc/cpuinfo").read_text()
    for line in text.splitlines():
        if line.startswith(("model name", "Model")):
            cpu = line.partition(":")[2].strip()
            break
    virtual = ", virtual" if " hypervisor" in text else ""
    return f"{cpu}{virtual}, {os.cpu_count()} cores, Linux {platform.release()}"


def commit(root: Path) -> str:
    """Short name of the commit; pages of results themselves do not make it a changed one."""
    head = git(root, "rev-parse", "--short", "HEAD")
    changed = git(root, "status", "--porcelain", "--", ".", ":!app/doc/results")
    return f"{head}, with changes" if changed else head


def git(root: Path, *words: str) -> str:
    result = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=True)
    return result.stdout.strip()


def write_index(root: Path, subjects: Iterable[Subject]) -> None:
    """Link the pages that there are, and name the subjects without one."""
    folder = root / "app" / "doc" / "results"
    lines = []
    for subject in subjects:
        page = folder / f"{subject.name}.md"
        if page.exists():
            title = page.read_text().splitlines()[0].removeprefix("# ")
            lines.append(f"- [{title}]({page.name})")
        else:
            lines.append(f"- {subject.title}: no page yet, {subject.written_by}")
    (folder / "README.md").write_text(INDEX + "\n".join(lines) + "\n")


def write_page(root: Path, subject: Subject, place: Path | None = None) -> Path:
    """Into the file @place, or where the pages are."""
    at = commit(root)
    lines = subject.measure(root)
    if not lines:
        raise NotMeasuredError("nothing was measured")
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    commands = "<br>".join(f"`{command}`" for command in subject.commands)
    page = place or root / "app" / "doc" / "results" / f"{subject.name}.md"
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(
        f"# {subject.title}\n\n"
        f"Written by {subject.written_by}.\n\n"
        "| | |\n| --- | --- |\n"
        f"| command | {commands} |\n"
        f"| commit | {at} |\n"
        f"| machine | {machine()} |\n"
        f"| date | {today} |\n\n"
        f"{NOTE}\n\n```text\n" + "\n".join(lines) + "\n```\n"
    )
    return page
