# SPDX-License-Identifier: MIT
"""Circles of includes: units that cannot be read one after the other.

A unit is a header and the source of the same name. A private header, NAME_internal.h, is no unit:
it counts as part of each file that includes it, and a function that it declares leads to the unit
that defines it. So a call between two sources of one module counts like an include. That it
includes NAME.h, for the types, does not.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import PurePosixPath

from project import Source

COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
INCLUDE_ROOTS = ("app", "app/core", "app/master", "app/services", "app/sim")

# As many as there are; a circle that is opened lowers it.
CIRCLES_LIMIT = 5

Graph = dict[str, set[str]]


def include_graph(files: Sequence[Source]) -> Graph:
    """Which unit of app/ needs which."""
    texts = {f.path: COMMENT.sub("", f.text) for f in files if f.is_app_c}
    defined = definitions(texts)
    graph: Graph = {unit(path): set() for path in texts if not is_private(path)}
    for path in texts:
        if not is_private(path):
            graph[unit(path)] |= needs(path, texts, defined) & graph.keys() - {unit(path)}
    return graph


def unit(path: str) -> str:
    return path.rpartition(".")[0]


def is_private(path: str) -> bool:
    return path.endswith("_internal.h")


def definitions(texts: dict[str, str]) -> dict[tuple[str, str], str]:
    """Folder and name of each function that is not static, and the unit that defines it."""
    found = {}
    for path, text in texts.items():
        folder = str(PurePosixPath(path).parent)
        for match in re.finditer(
            r"^(?!static)\w[\w *]*?\b(\w+)\([^;{}]*\)\n\{", text, re.MULTILINE
        ):
            if path.endswith(".c"):
                found[folder, match.group(1)] = unit(path)
    return found


def needs(path: str, texts: dict[str, str], defined: dict[tuple[str, str], str]) -> set[str]:
    """The units that @path includes, and those whose private functions it calls."""
    found: set[str] = set()
    called = set(re.findall(r"\w+", texts[path]))
    open_files = [path]
    seen = {path}
    while open_files:
        file = open_files.pop()
        for header in included(file, texts):
            if header in seen or file == header.replace(".h", "_internal.h"):
                continue
            seen.add(header)
            if not is_private(header):
                found.add(unit(header))
                continue
            open_files.append(header)
            folder = str(PurePosixPath(header).parent)
            for name in re.findall(r"\b(\w+)\(", texts[header]):
                if name in called and (folder, name) in defined:
                    found.add(defined[folder, name])
    return found


def included(path: str, texts: dict[str, str]) -> Iterable[str]:
    for name in re.findall(r'^\s*#\s*include\s+"([^"]+)"', texts[path], re.MULTILINE):
        for root in (str(PurePosixPath(path).parent), *INCLUDE_ROOTS):
            if f"{root}/{name}" in texts:
                yield f"{root}/{name}"
                break


def circles(graph: Graph) -> list[list[str]]:
    """Groups of more than one unit, each reachable from each other one; the largest first."""
    reach = {start: reachable(graph, start) for start in graph}
    groups = {
        tuple(sorted(other for other in reach[start] if start in reach[other])) for start in graph
    }
    return sorted((list(group) for group in groups if len(group) > 1), key=len, reverse=True)


def reachable(graph: Graph, start: str) -> set[str]:
    found: set[str] = set()
    todo = [start]
    while todo:
        for other in graph[todo.pop()] - found:
            found.add(other)
            todo.append(other)
    return found


def folder_graph(graph: Graph) -> Graph:
    """The same for folders."""
    folders: Graph = {}
    for start, others in graph.items():
        here = str(PurePosixPath(start).parent)
        there = {str(PurePosixPath(other).parent) for other in others} - {here}
        folders.setdefault(here, set()).update(there)
        for folder in there:
            folders.setdefault(folder, set())
    return folders
