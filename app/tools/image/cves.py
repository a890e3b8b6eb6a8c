#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Known vulnerabilities of an image: its bill of materials against Debian's own data.

Each line: source package, its version in the image, what is known, state, urgency, version that
has the fix. What is not Debian's (our programs, SOEM) is in none of these data; it is named at the
end.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

EPILOG = """\
At least one of --tracker, --support and --archive is needed. None of them is downloaded:
  --tracker  the file data/json of Debian's security tracker, by any means. No package and no
             registry has it.
  --support  security-support.deb13 of the package debian-security-support
  --archive  /var/lib/apt/lists after an apt update with deb-src lines

Exit status: 0 done, 1 an open vulnerability that is fixed in Debian (--tracker), a newer version in
the archive (--archive), or support that has ended (--support), 2 wrong command line or data.
"""
SOURCE_PURL = re.compile(r"^pkg:(deb/debian|generic)/([^@]+)@([^?]+)\?arch=source$")
SUPPORT = re.compile(r"^(\S+)\s+(limited|non-supported)(?:\s+(.*))?$")


class DataError(Exception):
    """What cannot be read, in one line."""


@dataclass(frozen=True, order=True)
class Finding:
    source: str
    version: str
    what: str
    state: str
    urgency: str = ""
    fixed: str = ""

    def is_old(self) -> bool:
        """A newer image would be without it."""
        return self.state in ("fixed", "newer", "support ended")


def _order(character: str) -> int:
    """deb-version(7): ~ is before the end, letters are before the rest."""
    if character == "~":
        return -1
    if not character or character.isdigit():
        return 0
    return ord(character) if character.isalpha() else ord(character) + 256


def _compare_part(a: str, b: str) -> int:
    while a or b:
        while (a and not a[0].isdigit()) or (b and not b[0].isdigit()):
            difference = _order(a[:1]) - _order(b[:1])
            if difference:
                return difference
            a, b = a[1:], b[1:]
        digits = [re.match(r"\d*", text) for text in (a, b)]
        first, second = (match[0] if match else "" for match in digits)
        difference = int(first or 0) - int(second or 0)
        if difference:
            return difference
        a, b = a[len(first) :], b[len(second) :]
    return 0


def compare(a: str, b: str) -> int:
    """Debian versions: below 0 if a is older than b."""
    parts = []
    for version in (a, b):
        epoch, colon, rest = version.partition(":")
        if not colon:
            epoch, rest = "0", version
        upstream, _, revision = rest.rpartition("-") if "-" in rest else (rest, "", "0")
        parts.append((epoch, upstream, revision))
    for first, second in zip(*parts, strict=True):
        difference = _compare_part(first, second)
        if difference:
            return difference
    return 0


def sources(bill: Any) -> tuple[dict[str, str], list[str]]:
    """Debian's source packages with their oldest version in the image, and what is not Debian's."""
    debians: dict[str, str] = {}
    others = set()
    for package in bill["packages"]:
        for reference in package.get("externalRefs", []):
            match = SOURCE_PURL.match(reference["referenceLocator"])
            if not match:
                continue
            name, version = unquote(match[2]), unquote(match[3])
            if match[1] == "generic":
                others.add(f"{name} {version}")
            elif name not in debians or compare(version, debians[name]) < 0:
                debians[name] = version
    if not debians:
        raise DataError("no source package of Debian in it: no .spdx.json of an image?")
    return debians, sorted(others)


def of_tracker(debians: dict[str, str], tracker: Any, suite: str) -> Iterator[Finding]:
    """Vulnerabilities that the image has, by the security tracker's data."""
    if not any(
        suite in entry.get("releases", {})
        for name in debians
        for entry in tracker.get(name, {}).values()
    ):
        raise DataError(f"nothing about {suite} in it")
    for name, version in debians.items():
        for cve, entry in tracker.get(name, {}).items():
            release = entry.get("releases", {}).get(suite)
            if release is None:
                continue
            state, fixed = release.get("status", ""), release.get("fixed_version", "")
            if state == "resolved":
                # "0": never in this suite.
                if fixed == "0" or compare(version, fixed) >= 0:
                    continue
                state = "fixed"
            elif state == "open" and release.get("nodsa"):
                state = "open, minor"
            yield Finding(name, version, cve, state, release.get("urgency", ""), fixed)


def of_support(debians: dict[str, str], lines: Sequence[str]) -> Iterator[Finding]:
    """Packages that Debian's security team supports in part only, or no longer."""
    for line in lines:
        match = SUPPORT.match(line)
        if line.startswith("#") or not match:
            continue
        # The file has patterns such as golang.*
        pattern = re.compile(match[1])
        for name, version in debians.items():
            if pattern.fullmatch(name):
                state = "limited support" if match[2] == "limited" else "support ended"
                yield Finding(name, version, (match[3] or "").strip(), state)


def of_archive(debians: dict[str, str], lists: Path) -> Iterator[Finding]:
    """Sources of which the archive has a newer version now."""
    newest: dict[str, str] = {}
    files = sorted(lists.glob("*_Sources"))
    if not files:
        raise DataError("no *_Sources in it: apt update with deb-src lines makes them")
    for file in files:
        for block in file.read_text(errors="replace").split("\n\n"):
            fields = dict(re.findall(r"^(Package|Version): (.+)$", block, re.MULTILINE))
            name, version = fields.get("Package", ""), fields.get("Version", "")
            if name in debians and compare(version, newest.get(name, "0")) > 0:
                newest[name] = version
    for name, version in debians.items():
        if name in newest and compare(version, newest[name]) < 0:
            yield Finding(name, version, "security or point update", "newer", "", newest[name])


def parse_arguments(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="app/tools/image/cves.py",
        description=__doc__,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("bill", type=Path, help=".spdx.json of the image")
    parser.add_argument("--tracker", type=Path, metavar="FILE")
    parser.add_argument("--support", type=Path, metavar="FILE")
    parser.add_argument("--archive", type=Path, metavar="FOLDER")
    parser.add_argument("--suite", default="trixie", help="of Debian (default: %(default)s)")
    options = parser.parse_args(arguments)
    if not (options.tracker or options.support or options.archive):
        parser.error("one of --tracker, --support and --archive is needed")
    return options


def findings(options: argparse.Namespace) -> tuple[list[Finding], list[str]]:
    path = options.bill
    found: list[Finding] = []
    try:
        debians, others = sources(json.loads(path.read_text()))
        if options.tracker:
            path = options.tracker
            found += of_tracker(debians, json.loads(path.read_text()), options.suite)
        if options.support:
            path = options.support
            found += of_support(debians, path.read_text().splitlines())
        if options.archive:
            path = options.archive
            found += of_archive(debians, path)
    except (OSError, ValueError, LookupError, TypeError, AttributeError, DataError) as error:
        raise DataError(f"{path}: {error}") from error
    return sorted(found), others


def main(arguments: Sequence[str]) -> int:
    options = parse_arguments(arguments)
    try:
        found, others = findings(options)
    except DataError as error:
        print(f"cves.py: {error}", file=sys.stderr)
        return 2
    for f in found:
        print("\t".join((f.source, f.version, f.what, f.state, f.urgency, f.fixed)))
    old = sum(f.is_old() for f in found)
    print(f"-- {len(found)} known, {old} of them gone in a newer image", file=sys.stderr)
    print(f"-- not in Debian's data: {', '.join(others) or 'nothing'}", file=sys.stderr)
    return 1 if old else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
