# SPDX-License-Identifier: MIT
"""The project's files as the rules see them, and what a rule finds."""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path

# Wings (folders of app/) that hold modules; the others are one module each.
WINGS_OF_MODULES = ("core", "master", "services", "sim")

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Source:
    """One file: its path from the top of the tree, and its text."""

    path: str
    text: str

    @property
    def lines(self) -> list[str]:
        return self.text.splitlines()

    @property
    def wing(self) -> str:
        """The folder below app/, or an empty string."""
        parts = self.path.split("/")
        return parts[1] if len(parts) > 2 and parts[0] == "app" else ""

    @property
    def module(self) -> str:
        """The folder below the wing, where the wing has modules; the wing where it has none."""
        parts = self.path.split("/")
        return parts[2] if self.wing in WINGS_OF_MODULES and len(parts) > 3 else self.wing

    @property
    def is_c(self) -> bool:
        return self.path.endswith((".c", ".h"))

    @property
    def is_app_c(self) -> bool:
        return self.is_c and self.path.startswith("app/")


@dataclass(frozen=True)
class Finding:
    """One breach of a rule."""

    path: str
    line: int
    what: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.what}"


@dataclass(frozen=True)
class Function:
    """One C function: where its first line is, and how many lines it has."""

    name: str
    line: int
    length: int


@cache
def file_names() -> tuple[str, ...]:
    """Every file of the project, those not yet committed included, those ignored by git not."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    return tuple(sorted(name for name in listed.split("\0") if name and (ROOT / name).is_file()))


@cache
def sources() -> tuple[Source, ...]:
    """Every text file of the project."""
    found = []
    for name in file_names():
        content = (ROOT / name).read_bytes()
        if b"\0" not in content:
            found.append(Source(name, content.decode(errors="replace")))
    return tuple(found)


def strip_comments(text: str) -> str:
    """C text without comments and without the contents of strings; lines stay where they are."""

    def blank(match: re.Match[str]) -> str:
        token = match.group(0)
        if token.startswith("/"):
            return " " + "\n" * token.count("\n")
        return token[0] + token[-1]

    pattern = r"//[^\n]*|/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*'"
    return re.sub(pattern, blank, text, flags=re.DOTALL)


def functions(text: str) -> list[Function]:
    """The functions of a C file in the project's format: brace and closing brace in column 0."""
    lines = strip_comments(text).splitlines()
    found = []
    head = 0
    for number, line in enumerate(lines, 1):
        if re.match(r"[A-Za-z_]", line) and not line.startswith(("struct {", "else")):
            head = number
        if line == "{" and head:
            name = re.search(r"(\w+)\s*\(", " ".join(lines[head - 1 : number]))
            end = next((n for n in range(number, len(lines)) if lines[n] == "}"), None)
            if name and end is not None:
                found.append(Function(name.group(1), head, end + 2 - head))
            head = 0
    return found
