#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Hold a kernel's final .config against the fragments it was made of: every symbol and value.

usage: kconfig.py CONFIG FRAGMENT...    a line for each symbol that differs, and exit code 1
"""

import re
import sys
from pathlib import Path

ASKED = re.compile(r"^(CONFIG_[A-Za-z0-9_]+)=(.+)$")
UNSET = re.compile(r"^# (CONFIG_[A-Za-z0-9_]+) is not set$")


def read(path: Path) -> dict[str, tuple[str, int]]:
    """Symbol -> (value, line). "n" stands for not set. A line that says nothing is an error."""
    symbols: dict[str, tuple[str, int]] = {}
    for number, line in enumerate(path.read_text().splitlines(), 1):
        asked, unset = ASKED.match(line), UNSET.match(line)
        if asked:
            symbols[asked[1]] = (asked[2], number)
        elif unset:
            symbols[unset[1]] = ("n", number)
        elif line.strip() and not line.startswith("#"):
            raise ValueError(f"{path}:{number}: '{line}' is neither CONFIG_X=value nor a comment")
    return symbols


def differences(config: Path, fragments: list[Path]) -> list[str]:
    """What was asked for and is not so, and what two fragments ask for in two ways."""
    final = {name: value for name, (value, _) in read(config).items()}
    wanted: dict[str, tuple[str, str]] = {}
    found = []
    for fragment in fragments:
        for name, (value, line) in read(fragment).items():
            where = f"{fragment.name}:{line}"
            other = wanted.setdefault(name, (value, where))
            if other[0] != value:
                found.append(f"{where}: {name}={value}, but {other[1]} says {other[0]}")
            got = final.get(name, "n")
            if got != value:
                found.append(f"{where}: {name}={value} was asked for, the configuration has {got}")
    return found


def main(arguments: list[str]) -> int:
    if len(arguments) < 2:
        print(__doc__, file=sys.stderr)
        return 2
    found = differences(Path(arguments[0]), [Path(name) for name in arguments[1:]])
    for line in found:
        print(line, file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
