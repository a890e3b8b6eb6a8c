# SPDX-License-Identifier: MIT
"""`./build.sh bench sim`, with few slaves and few cycles."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def other_build(tmp_path: Path) -> Path:
    """Another build, of the same program."""
    if shutil.which("valgrind") is None:
        pytest.skip("no valgrind: instructions cannot be counted")
    program = Path(os.environ["ECDAQ_BUILD"]) / "tests/cost/cost_virtual"
    folder = tmp_path / "other/tests/cost"
    folder.mkdir(parents=True)
    shutil.copy(program, folder)
    return tmp_path / "other"


def test_it_prints_a_row_for_each_number_of_slaves_and_compares(
    tmp_path: Path, other_build: Path
) -> None:
    page, file = tmp_path / "page.md", tmp_path / "figures.json"
    command = [sys.executable, str(ROOT / "app/tools/bench.py"), "sim", "--slaves", "2,5"]
    command += ["--cycles", "200", "--seeds", "3", "--before", str(other_build)]
    subprocess.run([*command, "--page", str(page), "--json", str(file)], check=True)
    rows = json.loads(file.read_text())["rows"]
    assert [row["slaves"] for row in rows] == [2, 5]
    for row in rows:
        assert row["is_same"]
        assert row["instructions"] == pytest.approx(row["instructions_before"], rel=0.01)
        assert row["times_real_time"] == pytest.approx(1e3 / row["us_a_cycle"])
    assert rows[0]["instructions"] < rows[1]["instructions"] < 3 * rows[0]["instructions"]
    text = page.read_text()
    assert "Its samples are the same." in text
    assert text.count("3 seeds, 200 cycles each") == 1


def test_a_run_that_fails_is_one_line_and_no_page(tmp_path: Path) -> None:
    folder = tmp_path / "tests/cost"
    folder.mkdir(parents=True)
    (folder / "cost_virtual").write_text("#!/bin/sh\necho no good >&2\nexit 1\n")
    (folder / "cost_virtual").chmod(0o755)
    page = tmp_path / "page.md"
    command = [sys.executable, str(ROOT / "app/tools/bench.py"), "sim", "--slaves", "2"]
    command += ["--before", str(tmp_path), "--page", str(page)]
    run = subprocess.run(command, capture_output=True, text=True)
    assert run.returncode == 1
    assert run.stderr.startswith("build.sh: bench: ")
    assert run.stderr.endswith("no good\n") and run.stderr.count("\n") == 1
    assert not page.exists()
