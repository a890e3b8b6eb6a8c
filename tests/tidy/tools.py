# SPDX-License-Identifier: MIT
"""Foreign tools over the project's files: which files each looks at, and how it is called."""

from __future__ import annotations

import hashlib
import json
import os
import re
import subprocess
from functools import cache
from pathlib import Path

from project import ROOT, file_names, sources

CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "ecdaq" / "clang-tidy"


def c_files() -> list[str]:
    return [name for name in file_names() if name.endswith((".c", ".h"))]


def python_files() -> list[str]:
    return [name for name in file_names() if name.endswith(".py")]


def shell_files() -> list[str]:
    """Everything that begins with a shell's name, and what is only sourced."""
    shells = ("#!/bin/sh", "#!/bin/bash", "#!/usr/bin/env bash")
    return [s.path for s in sources() if s.path.endswith(".sh") or s.text.startswith(shells)]


def run(command: list[str], cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)


@cache
def clang_tidy_version() -> str:
    return run(["clang-tidy", "--version"]).stdout


def compile_commands(build: Path) -> dict[str, list[str]]:
    """How CMake compiles each of the project's C files."""
    entries = json.loads((build / "compile_commands.json").read_text())
    commands = {}
    for entry in entries:
        path = Path(entry["file"]).resolve()
        if path.is_relative_to(ROOT) and str(path.relative_to(ROOT)) in file_names():
            commands[str(path.relative_to(ROOT))] = entry["command"].split()
    return commands


@cache
def compiled_from(build: Path) -> dict[str, list[Path]]:
    """The files that the last build read for each object, as Ninja keeps them."""
    listed = run(["ninja", "-C", str(build), "--quiet", "-t", "deps"]).stdout
    blocks = re.findall(r"^(\S+): #deps .*\(VALID\)\n((?:    .+\n)*)", listed, re.MULTILINE)
    return {
        target: [Path(os.path.normpath(build / line.strip())) for line in files.splitlines()]
        for target, files in blocks
    }


@cache
def digest(path: Path) -> bytes:
    return hashlib.sha256(path.read_bytes()).digest()


def tidy_key(name: str, command: list[str], build: Path) -> str | None:
    """What clang-tidy's verdict on a file depends on: the file, its headers, the checks, but not
    where the tree is. None if a file has changed since the build, which then knows no headers."""
    target = command[command.index("-o") + 1]
    files = compiled_from(build).get(target, [])
    own = {path for path in files if path.is_relative_to(ROOT)}
    built_ns = (build / target).stat().st_mtime_ns if files else 0
    if ROOT / name not in own or any(
        not path.exists() or path.stat().st_mtime_ns > built_ns for path in own
    ):
        return None
    configs = [folder / ".clang-tidy" for folder in (ROOT / name).parents]
    own |= {path for path in configs if path.is_file() and path.is_relative_to(ROOT)}
    called = " ".join([clang_tidy_version(), *command]).replace(str(ROOT), "")
    return hashlib.sha256(called.encode() + b"".join(map(digest, sorted(own)))).hexdigest()


def clang_tidy(name: str, command: list[str], build: Path) -> str:
    """What clang-tidy finds in a file; nothing if it found nothing in the same text before."""
    key = tidy_key(name, command, build)
    if key and (CACHE / key).exists():
        return ""
    result = run(["clang-tidy", "--quiet", "-p", str(build), name])
    if result.returncode == 0:
        if key:
            CACHE.mkdir(parents=True, exist_ok=True)
            (CACHE / key).touch()
        return ""
    return result.stdout + result.stderr
