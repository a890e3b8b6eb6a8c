# SPDX-License-Identifier: MIT
"""Run the formatters on the tree: ./build.sh lint --fix."""

from __future__ import annotations

import sys

import tools


def main() -> int:
    commands = [
        ["clang-format", "-i", *tools.c_files()],
        ["ruff", "check", "--no-cache", "--fix", "--quiet", *tools.python_files()],
        ["ruff", "format", "--no-cache", "--quiet", *tools.python_files()],
    ]
    for command in commands:
        result = tools.run(command)
        sys.stdout.write(result.stdout)
        sys.stderr.write(result.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
