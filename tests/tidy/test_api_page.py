# SPDX-License-Identifier: MIT
"""The page of the programming interface is generated from the installed headers."""

from __future__ import annotations

import subprocess
import sys

from project import ROOT

HEADERS = ["app/core/reader/api.h", "app/master/control/control.h"]


def test_the_api_page_is_that_of_the_headers() -> None:
    made = subprocess.run(
        [sys.executable, "app/tools/api_page.py", *HEADERS],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    assert "### `ecdaq_reader_next`" in made
    assert "### `ecdaq_set`" in made
    remedy = f"run: python3 app/tools/api_page.py {' '.join(HEADERS)} > app/doc/reference/api.md"
    assert (ROOT / "app/doc/reference/api.md").read_text() == made, remedy
