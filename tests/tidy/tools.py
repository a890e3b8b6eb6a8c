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


def tidy_key(name: str, command: list[str], build: Path) -> str:
    """What clang-tidy's verdict on a file depends on: the file, its headers, the checks."""
    listed = run([*command[:1], "-MM", *strip_output(command[1:])], cwd=build).stdout
    headers = re.findall(r"\S+\.h\b", listed)
    configs = [parent / ".clang-tidy" for parent in (ROOT / name).parents]
    digest = hashlib.sha256(clang_tidy_version().encode() + " ".join(command).encode())
    for path in [ROOT / name, *sorted(build / h for h in headers), *configs]:
        if path.is_file() and path.is_relative_to(ROOT):
            digest.update(path.read_bytes())
    return digest.hexdigest()


def strip_output(arguments: list[str]) -> list[str]:
    """The arguments without those that name what is written."""
    kept = []
    skip = False
    for argument in arguments:
        if skip:
            skip = False
        elif argument in ("-o", "-MF", "-MT"):
            skip = True
        elif argument not in ("-c", "-MD"):
            kept.append(argument)
    return kept


def clang_tidy(name: str, command: list[str], build: Path) -> str:
    """What clang-tidy finds in a file; nothing if it found nothing in the same text before."""
    stamp = CACHE / tidy_key(name, command, build)
    if stamp.exists():
        return ""
    result = run(["clang-tidy", "--quiet", "-p", str(build), name])
    if result.returncode == 0:
        CACHE.mkdir(parents=True, exist_ok=True)
        stamp.touch()
        return ""
    return result.stdout + result.stderr
