#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Compare our packages with those that Isar made of the same recipes.

Compared are control fields, maintainer scripts and other control files, and of each file its name,
type, mode, owner, target and contents. Times are not compared, nor is the contents of changelog.gz,
which each build writes itself.
"""

from __future__ import annotations

import argparse
import hashlib
import io
import os
import re
import subprocess
import sys
import tarfile
from collections.abc import Sequence
from pathlib import Path

EPILOG = """\
Isar's packages are below build/tmp/deploy in its work directory; what is there beside ours is
ignored. Exit status: 0 equal, 1 different, 2 nothing to compare.
"""
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
OURS = CACHE / "ecdaq" / "image" / "deploy" / "repo"
CHANGELOG = re.compile(r"^\./usr/share/doc/[^/]+/changelog(\.Debian)?\.gz$")
# Sums of the files, which are compared themselves, and the fields.
NOT_COMPARED = ("./md5sums", "./control")


class CompareError(Exception):
    """Why nothing can be compared, in one line."""


def _dpkg_deb(option: str, package: Path) -> bytes:
    done = subprocess.run(["dpkg-deb", option, package], capture_output=True, check=False)
    if done.returncode != 0:
        reason = done.stderr.decode(errors="replace").strip().splitlines()
        raise CompareError(f"{package}: {reason[-1] if reason else 'dpkg-deb failed'}")
    return done.stdout


def fields(package: Path) -> dict[str, str]:
    """The control fields, each with the lines that continue it."""
    found: dict[str, str] = {}
    name = ""
    for line in _dpkg_deb("--field", package).decode().splitlines():
        if line.startswith((" ", "\t")):
            found[name] += "\n" + line
        else:
            name, _, value = line.partition(":")
            found[name] = value.strip()
    return found


def _describe(entry: tarfile.TarInfo, archive: tarfile.TarFile) -> dict[str, str]:
    kinds = {
        tarfile.REGTYPE: "file",
        tarfile.DIRTYPE: "directory",
        tarfile.SYMTYPE: "symbolic link",
    }
    found = {
        "type": kinds.get(entry.type, f"type {entry.type.decode()}"),
        "mode": f"{entry.mode:o}",
        "owner": f"{entry.uname}({entry.uid}):{entry.gname}({entry.gid})",
        "target": entry.linkname,
    }
    stream = archive.extractfile(entry) if entry.isreg() else None
    if stream and not CHANGELOG.match(entry.name):
        found["contents"] = "SHA-256 " + hashlib.sha256(stream.read()).hexdigest()[:16]
    return found


def files(package: Path, option: str) -> dict[str, dict[str, str]]:
    """What is in the archive of files (--fsys-tarfile) or of control files (--ctrl-tarfile)."""
    with tarfile.open(fileobj=io.BytesIO(_dpkg_deb(option, package))) as archive:
        return {
            entry.name: _describe(entry, archive)
            for entry in archive
            if option == "--fsys-tarfile" or entry.name not in NOT_COMPARED
        }


def differences(ours: dict[str, str], theirs: dict[str, str]) -> list[str]:
    """One line for each name whose value is not the same."""
    found = []
    for name in sorted(ours.keys() | theirs.keys()):
        if ours.get(name) != theirs.get(name):
            found.append(f"{name}: {ours.get(name, 'none')}, Isar: {theirs.get(name, 'none')}")
    return found


def compare(ours: Path, theirs: Path) -> list[str]:
    """All differences of two packages, one line each."""
    found = [f"field {line}" for line in differences(fields(ours), fields(theirs))]
    for option in ("--ctrl-tarfile", "--fsys-tarfile"):
        left, right = files(ours, option), files(theirs, option)
        found += [f"{name}: not in Isar's package" for name in sorted(left.keys() - right.keys())]
        found += [f"{name}: only in Isar's package" for name in sorted(right.keys() - left.keys())]
        for name in sorted(left.keys() & right.keys()):
            found += [f"{name}: {line}" for line in differences(left[name], right[name])]
    return found


def packages(folder: Path) -> dict[str, Path]:
    """The packages below a folder by name; the newest file where a name has several."""
    paths = [p for p in folder.rglob("*.deb") if p.is_file()]
    if not paths:
        raise CompareError(f"{folder}: no .deb files")
    ordered = sorted(paths, key=lambda p: p.stat().st_mtime_ns)
    return {path.name.partition("_")[0]: path for path in ordered}


def compare_folders(ours: Path, theirs: Path) -> list[str]:
    """All differences, each with the name of its package in front."""
    left, right = packages(ours), packages(theirs)
    found = []
    for name, package in sorted(left.items()):
        if name in right:
            found += [f"{name}: {line}" for line in compare(package, right[name])]
        else:
            found.append(f"{name}: Isar made no such package")
    return found


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__, epilog=EPILOG)
    parser.add_argument("isar", type=Path, help="folder with the packages that Isar made")
    parser.add_argument("ours", type=Path, nargs="?", default=OURS, help="with ours (%(default)s)")
    given = parser.parse_args(arguments)
    try:
        found = compare_folders(given.ours, given.isar)
        compared = len(packages(given.ours))
    except CompareError as error:
        print(f"compare_packages: {error}", file=sys.stderr)
        return 2
    for line in found:
        print(line)
    print(f"{compared} packages, {len(found)} differences", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
