# SPDX-License-Identifier: MIT
"""The tree keeps its rules."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

import pytest
import rules
import whole_tree
from project import ROOT, Finding, file_names, sources

DATA = Path(os.environ.get("ECDAQ_DATA", ROOT.parent / "shared" / "data"))


def expect_none(findings: Iterable[Finding]) -> None:
    listed = "\n".join(map(str, findings))
    assert not listed, f"\n{listed}"


@pytest.mark.parametrize("rule", rules.RULES, ids=lambda rule: rule.__name__.removeprefix("rule_"))
def test_every_file_keeps(rule: rules.Rule) -> None:
    expect_none(finding for source in sources() for finding in rule(source))


def test_every_source_is_built() -> None:
    expect_none(whole_tree.unlisted_sources(sources()))


def test_what_readers_share_is_defined_once() -> None:
    expect_none(whole_tree.not_defined_once(sources()))


def test_every_test_has_a_name_of_its_own() -> None:
    expect_none(whole_tree.doubled_test_names(sources()))


def test_every_test_is_seen_by_cmake() -> None:
    expect_none(whole_tree.unseen_tests(sources()))


def test_no_exception_outlives_its_reason() -> None:
    expect_none(whole_tree.stale_exceptions(sources(), rules.LONG_FILES, rules.FILE_LINES))


def test_nothing_foreign_is_tracked() -> None:
    expect_none(whole_tree.foreign_binaries(ROOT, file_names(), DATA))
