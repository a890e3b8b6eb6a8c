# SPDX-License-Identifier: MIT
"""DDS topics are listed in one table, and a new one touches seven files."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest
from project import ROOT, sources

SERVICES = ROOT / "app" / "services"
TABLE = "app/services/keystore/dds_topics.h"
DOC = ROOT / "app" / "doc"


def topics_page() -> str:
    command = [sys.executable, "-B", str(SERVICES / "publish" / "topics_page.py")]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_topics_page_is_up_to_date() -> None:
    assert (DOC / "reference" / "dds-topics.md").read_text() == topics_page()


def test_topic_names_are_written_in_the_table_only() -> None:
    name = re.compile(r'"(?:rt/)?ecdaq/\w+"')
    found = {
        s.path: name.findall(s.text)
        for s in sources()
        if s.path.startswith("app/") and s.path.endswith((".c", ".h", ".py"))
    }
    assert len(found[TABLE]) == 11
    assert not {path: names for path, names in found.items() if names and path != TABLE}


def test_how_to_lists_at_most_seven_files_and_all_that_name_a_type() -> None:
    page = DOC / "how-to" / "add-a-dds-topic.md"
    steps = re.findall(r"^\d+\. \[.*?\]\((.*?)\)", page.read_text(), re.MULTILINE)
    listed = {(page.parent / step).resolve() for step in steps}
    assert 5 <= len(listed) <= 7
    assert all(path.is_file() for path in listed)
    using = {
        ROOT / s.path
        for s in sources()
        if s.path.startswith("app/services/") and "TimeMapV1" in s.text
    }
    kit = SERVICES / "publish" / "python" / "ecdaq" / "link.py"  # a method of convenience
    assert SERVICES / "publish" / "idl" / "ecdaq.idl" in using
    assert using - {kit} <= listed


@pytest.mark.parametrize(
    "line", ["octet x;", "long x[3];", "@optional long x;", "sequence<SampleV1> x;", "struct X {"]
)
def test_python_types_are_not_generated_from_idl_beyond_the_subset(line: str) -> None:
    program = SERVICES / "publish" / "python" / "idl_to_python.py"
    text = f"module ecdaq {{\n@final struct X {{\n{line}\n}};\n}};\n"
    ended = subprocess.run(
        [sys.executable, "-B", str(program), "/dev/stdin", "/dev/null"],
        input=text, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 1
    assert f"line 3: not in the supported subset of IDL: {line}" in ended.stderr
