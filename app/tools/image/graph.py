# SPDX-License-Identifier: MIT
"""Which tasks there are: the graph over recipes, and a hash of all that a task depends on."""

from __future__ import annotations

import hashlib
import os
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from metadata import Metadata, MetadataError, Recipe


@dataclass(frozen=True, order=True)
class Task:
    """One task of one recipe."""

    recipe: str
    name: str

    def __str__(self) -> str:
        return f"{self.recipe}: {self.name.removeprefix('do_')}"


def _files_below(folder: Path) -> Iterator[Path]:
    """Files of the project below a folder: tracked and untracked, not ignored; without git all."""
    listed = subprocess.run(
        ["git", "-C", folder, "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        capture_output=True,
        check=False,
    )
    if listed.returncode == 0 and listed.stdout:
        names = sorted(set(listed.stdout.decode().rstrip("\0").split("\0")))
        yield from (folder / name for name in names)
        return
    yield from sorted(p for p in folder.rglob("*") if p.is_file())


def hash_path(path: Path) -> str:
    """Names, contents and executable bits of a file or of all files below a folder."""
    digest = hashlib.sha256()
    for file in _files_below(path) if path.is_dir() else [path]:
        if file.is_file():
            name = str(file.relative_to(path)) if path.is_dir() else path.name
            mode = "x" if os.access(file, os.X_OK) else "-"
            digest.update(f"{name}\0{mode}\0".encode())
            digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


class Graph:
    """The tasks of all recipes of one machine."""

    def __init__(self, metadata: Metadata) -> None:
        self.metadata = metadata
        self._hashes: dict[Task, str] = {}
        self._bases: dict[str, dict[str, str]] = {}
        self._busy: list[Task] = []

    def recipe(self, task: Task) -> Recipe:
        """The recipe of a task."""
        return self.metadata.recipes[task.recipe]

    def needs(self, task: Task) -> list[Task]:
        """The tasks that have to be done before this one."""
        recipe = self.recipe(task)
        found = {Task(recipe.name, name) for name in recipe.tasks[task.name]}
        for entry in recipe.flag(task.name, "depends").split():
            name, _, other = entry.partition(":")
            found.add(self._known(recipe, Task(name, other)))
        for other in recipe.flag(task.name, "deptask").split():
            for name in recipe.value("DEPENDS").split():
                found.add(self._known(recipe, Task(name, other)))
        return sorted(found)

    def _known(self, recipe: Recipe, task: Task) -> Task:
        if task.recipe not in self.metadata.recipes:
            raise MetadataError(f"{recipe.file}: nothing provides '{task.recipe}'")
        if task.name not in self.recipe(task).tasks:
            raise MetadataError(f"{recipe.file}: {task.recipe} has no task {task.name}")
        return task

    def _base_hashes(self, recipe: Recipe) -> dict[str, str]:
        """BitBake's own hash of each task's code and every variable it uses."""
        if recipe.name not in self._bases:
            bb: Any = self.metadata.bb
            ignored = set((recipe.data.getVar("BB_BASEHASH_IGNORE_VARS") or "").split())
            tasks, needed, values = bb.data.generate_dependencies(recipe.data, ignored)
            _, hashes = bb.data.generate_dependency_hash(
                tasks, needed, values, ignored, recipe.name
            )
            self._bases[recipe.name] = {k.rpartition(":")[2]: v for k, v in hashes.items()}
        return self._bases[recipe.name]

    def local_files(self, task: Task) -> list[Path]:
        """Files and folders outside the metadata that a task reads."""
        recipe = self.recipe(task)
        named = recipe.flag(task.name, "file-checksums").split()
        paths = [Path(entry.rpartition(":")[0]) for entry in named]
        if task.name == "do_fetch":
            uris = [u for u in recipe.value("SRC_URI").split() if u.startswith("file://")]
            if uris:
                fetch = self.metadata.bb.fetch2.Fetch(uris, recipe.data)
                paths += [Path(path) for path in fetch.localpaths()]
        return paths

    def hash(self, task: Task) -> str:
        """Changes whenever anything changes that the task's result could depend on."""
        if task in self._hashes:
            return self._hashes[task]
        if task in self._busy:
            ring = " -> ".join(str(t) for t in [*self._busy[self._busy.index(task) :], task])
            raise MetadataError(f"tasks wait for each other: {ring}")
        self._busy.append(task)
        digest = hashlib.sha256(self._base_hashes(self.recipe(task))[task.name].encode())
        for path in self.local_files(task):
            digest.update(hash_path(path).encode())
        for other in self.needs(task):
            digest.update(self.hash(other).encode())
        self._busy.pop()
        self._hashes[task] = digest.hexdigest()
        return self._hashes[task]
