# SPDX-License-Identifier: MIT
"""Rules that need more than one file at a time. Each takes the files and gives its breaches."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from project import Finding, Source, functions


def unlisted_sources(files: Sequence[Source]) -> Iterable[Finding]:
    """Every C file below app/ is named in the CMakeLists.txt of its folder or one above."""
    lists = {
        f.path.rpartition("/")[0]: expand_variables(f.text)
        for f in files
        if f.path.endswith("CMakeLists.txt")
    }
    for source in files:
        if not source.path.startswith("app/") or not source.path.endswith(".c"):
            continue
        if source.module == "examples":
            continue
        folders = [str(parent) for parent in Path(source.path).parents]
        named = any(
            re.search(rf"(?<![\w/]){re.escape(source.path[len(folder) + 1 :])}\b", lists[folder])
            for folder in folders
            if folder in lists
        )
        if not named:
            yield Finding(source.path, 1, "no CMakeLists.txt names it: it is never built")


def expand_variables(text: str) -> str:
    """CMake text with plain `set(name value)` put in place of ${name}."""
    for match in re.finditer(r"^set\((\w+) ([\w./-]+)\)", text, re.MULTILINE):
        text = text.replace(f"${{{match.group(1)}}}", match.group(2))
    return text


def doubled_test_names(files: Sequence[Source]) -> Iterable[Finding]:
    """A test's name is unique in the whole project."""
    seen: dict[str, str] = {}
    for source in files:
        if not source.path.startswith("tests/") or not source.path.endswith(".c"):
            continue
        for match in re.finditer(r"^TEST\((\w+),\s*(\w+)\)", source.text, re.MULTILINE):
            name = f"{match.group(1)}.{match.group(2)}"
            line = source.text[: match.start()].count("\n") + 1
            if name in seen:
                yield Finding(source.path, line, f"{name} is also in {seen[name]}")
            seen[name] = source.path


def unseen_tests(files: Sequence[Source]) -> Iterable[Finding]:
    """A TEST() that CMake's pattern does not see would be built and never run."""
    for source in files:
        if not source.path.startswith("tests/") or not source.path.endswith(".c"):
            continue
        for number, line in enumerate(source.lines, 1):
            if re.match(r"\s*TEST\s*\(", line) and not re.match(
                r"TEST\([a-z0-9_]+, *[a-z0-9_]+\)", line
            ):
                yield Finding(source.path, number, "write TEST(module, sentence) on one line")


def stale_exceptions(
    files: Sequence[Source], names: Iterable[str], limit: int
) -> Iterable[Finding]:
    """An exception for a file that is gone, or has become small, goes, too."""
    by_path = {f.path: f for f in files}
    for name in names:
        if name not in by_path:
            yield Finding(name, 1, "has an exception, but is not there")
        elif len(by_path[name].lines) <= limit:
            yield Finding(name, 1, "has an exception for long files and does not need it")


def foreign_binaries(root: Path, names: Iterable[str], data: Path) -> Iterable[Finding]:
    """No capture is tracked, and no file that equals one of the shared data's."""
    known = {
        hashlib.sha256(path.read_bytes()).digest(): path.name
        for path in data.rglob("*")
        if path.is_file() and path.stat().st_size > 0
    }
    for name in names:
        if name.endswith((".pcap", ".pcapng")):
            yield Finding(name, 1, "captures of others are read from the shared data, not kept")
        equal = known.get(hashlib.sha256((root / name).read_bytes()).digest())
        if equal:
            yield Finding(name, 1, f"a copy of {equal} from the shared data")


# Functions of which each reader once had a copy.
DEFINED_ONCE = ["sample_is_good", "channel_table_create", "utc_feed", "reader_next", "feed_read"]


def not_defined_once(files: Sequence[Source]) -> Iterable[Finding]:
    """One definition each of good sample, ring validity, UTC map, session and feed."""
    for name in DEFINED_ONCE:
        places = [
            source.path
            for source in files
            if source.path.startswith("app/") and source.path.endswith(".c")
            for function in functions(source.text)
            if function.name == name
        ]
        if len(places) != 1:
            yield Finding(name, 1, f"defined {len(places)} times: {', '.join(places)}")
