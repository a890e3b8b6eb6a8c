# SPDX-License-Identifier: MIT
"""Lines of the product, part by part, and circles of includes."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

from measure.page import git

PARTS = ("app/core", "app/master", "app/services", "app/cli", "app/sim", "app/examples")
TOOLS = ("build.sh", "app/tools", "app/cmake")
SOURCES = (".c", ".h", ".py", ".sh", ".txt", ".cmake", ".idl")


def measure(root: Path) -> list[str]:
    # The rules of the tree count the circles; one way to do it.
    sys.path.insert(0, str(root / "tests" / "tidy"))
    from circles import circles, folder_graph, include_graph
    from project import sources

    lines: Counter[str] = Counter()
    files: Counter[str] = Counter()
    for name in git(root, "ls-files").splitlines():
        path = root / name
        if path.suffix in SOURCES and path.is_file() and not path.is_symlink():
            part = part_of(name)
            lines[part] += len(path.read_text(errors="replace").splitlines())
            files[part] += 1
    rows = [f"{part:14} {files[part]:4} files {lines[part]:7} lines" for part in (*PARTS, "tools")]
    product = sum(lines[part] for part in PARTS)
    rows += [f"{'product':14} {sum(files[p] for p in PARTS):4} files {product:7} lines"]
    rows += [f"{'tests':14} {files['tests']:4} files {lines['tests']:7} lines", ""]
    graph = include_graph(sources())
    found = circles(graph)
    rows += [f"circles of includes: {len(found)}"]
    rows += ["  " + " ".join(circle) for circle in found]
    rows += [f"circles of folders: {len(circles(folder_graph(graph)))}"]
    return rows


def part_of(name: str) -> str:
    for part in (*PARTS, "tests"):
        if name.startswith(f"{part}/"):
            return part
    return "tools" if name.startswith(TOOLS) else "other"
