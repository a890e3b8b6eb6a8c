# SPDX-License-Identifier: MIT
"""What every program does is defined once: exit codes, JSON, command line, stop signals."""

from __future__ import annotations

import re

import pytest
from project import sources

# What only its definition holds, and where that is.
ONCE = {
    "exit codes": (r"enum \w*exit\w* \{|EXIT_CODE_\w+ = \d", {"app/core/program/exit_code.h"}),
    "JSON text": (r"\\u%04x", {"app/core/program/json.c"}),
    "long options": (
        r"getopt_long\s*\(|args_parse\(struct args [^;{]*\n\{",
        {"app/core/base/args.c"},
    ),
    "--check and --set": (
        r"\{ \"(?:check|set)\", 0, args_",
        {"app/core/program/command_line.c", "app/cli/config.c"},  # of a file, not of the program
    ),
    "stop signals": (r"sigaction\(SIGTERM", {"app/core/base/stop.c"}),
}


@pytest.mark.parametrize("what", ONCE)
def test_it_is_defined_once(what: str) -> None:
    pattern, places = ONCE[what]
    found = {s.path for s in sources() if s.is_app_c and re.search(pattern, s.text)}
    assert found == places
