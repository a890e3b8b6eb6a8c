#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Measure on this machine and write one page per subject to app/doc/results/.

Called by `build.sh measure`, which has built everything. Each page names the command, the
commit, the machine and the date.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from measure.page import NotMeasuredError, write_index, write_page
from measure.subjects import PAGES, SUBJECTS

ROOT = Path(__file__).resolve().parents[2]


def parse_arguments(arguments: Sequence[str]) -> argparse.Namespace:
    subjects = "\n".join(f"  {s.name:11} {s.title}" for s in SUBJECTS.values())
    quick = " ".join(s.name for s in SUBJECTS.values() if s.is_quick)
    parser = argparse.ArgumentParser(
        prog="./build.sh measure",
        usage="./build.sh measure [NAME...]",
        description=f"Measures and writes app/doc/results/NAME.md for each NAME:\n\n{subjects}",
        epilog=f"Default, some minutes together: {quick}. The others only when named.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("names", nargs="*", metavar="NAME")
    # build.sh calls this before it prepares anything.
    parser.add_argument("--check", action="store_true", help=argparse.SUPPRESS)
    return parser.parse_args(arguments)


def main(arguments: Sequence[str]) -> int:
    options = parse_arguments(arguments)
    for name in options.names:
        if name not in SUBJECTS:
            there_are = " ".join(SUBJECTS)
            print(
                f"build.sh: measure: no subject '{name}'; there are: {there_are}", file=sys.stderr
            )
            return 2
    if options.check:
        return 0
    failed = False
    for subject in SUBJECTS.values():
        if subject.name not in options.names and (options.names or not subject.is_quick):
            continue
        try:
            page = write_page(ROOT, subject)
            print(f"{subject.name}: wrote {page.relative_to(ROOT)}", flush=True)
        except NotMeasuredError as why:
            print(f"build.sh: measure: {subject.name}: {why}", file=sys.stderr)
            failed = True
    write_index(ROOT, PAGES)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
