# SPDX-License-Identifier: MIT
"""The test runner counts rightly: a failure, a crash or an empty group cannot pass for success."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

import pytest
from project import ROOT

sys.path.insert(0, str(ROOT / "app" / "tools"))
import run_tests
from run_tests import Outcome, Suite

OPTIONS = argparse.Namespace(only="", fail_fast=False, fuzz_seconds=1)
CTEST = """
cmake_minimum_required(VERSION 3.25)
project(sample NONE)
enable_testing()
add_test(NAME a.ok COMMAND true)
add_test(NAME a.bad COMMAND sh -c "echo the reason; false")
add_test(NAME a.gone COMMAND /nonexistent/program)
add_test(NAME a.skip COMMAND sh -c "echo skipped: no such NIC; exit 77")
set_tests_properties(a.ok a.bad a.gone a.skip PROPERTIES LABELS unit SKIP_RETURN_CODE 77)
"""
PYTEST = """
import pytest

def test_ok(): pass
def test_bad(): assert 1 == 2
def test_skip(): pytest.skip("no such folder")
@pytest.fixture
def broken(): raise OSError("no")
def test_error(broken): pass
"""


@pytest.fixture(autouse=True)
def own_build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(run_tests, "ROOT", tmp_path)
    monkeypatch.setattr(run_tests, "BUILD", tmp_path / "build")
    monkeypatch.setattr(run_tests, "LOGS", tmp_path / "build" / "test-logs")
    return tmp_path


def heads(outcome: Outcome) -> list[str]:
    return [failure.splitlines()[0] for failure in outcome.failures]


def test_ctest_results_are_told_apart(own_build: Path) -> None:
    (own_build / "CMakeLists.txt").write_text(CTEST)
    build = own_build / "build" / "release"
    subprocess.run(["cmake", "-S", own_build, "-B", build], check=True, capture_output=True)
    outcome = run_tests.run_ctest(run_tests.ctest("unit", "release"), OPTIONS)
    assert outcome.totals() == "1 passed, 2 failed, 1 skipped"
    assert sorted(heads(outcome)) == ["unit release: a.bad", "unit release: a.gone"]
    assert any("the reason" in failure for failure in outcome.failures)
    assert outcome.skips == ["unit release: a.skip: no such NIC"]


def test_pytest_results_are_told_apart(own_build: Path) -> None:
    (own_build / "tests" / "cli").mkdir(parents=True)
    (own_build / "tests" / "cli" / "test_sample.py").write_text(PYTEST)
    outcome = run_tests.run_pytest(run_tests.pytest("cli", "release"), OPTIONS)
    assert outcome.totals() == "1 passed, 2 failed, 1 skipped"
    assert "no such folder" in outcome.skips[0]


def test_a_file_that_pytest_cannot_load_is_a_failure(own_build: Path) -> None:
    (own_build / "tests" / "cli").mkdir(parents=True)
    (own_build / "tests" / "cli" / "test_sample.py").write_text("import nothing_of_that_name\n")
    assert run_tests.run_pytest(run_tests.pytest("cli", "release"), OPTIONS).failures


def test_a_runner_that_dies_without_a_report_is_a_failure(own_build: Path) -> None:
    suite = run_tests.ctest("unit", "release")
    log = own_build / "log"
    log.write_text("gone\n")
    outcome = run_tests.finish(suite, own_build / "none.xml", log, 139, (0, 8))
    assert heads(outcome) == ["unit release: ended with 139"]


def test_a_report_that_cannot_be_read_is_a_failure(own_build: Path) -> None:
    (own_build / "half.xml").write_text("<testsuite><testcase")
    (own_build / "log").write_text("")
    suite = run_tests.ctest("unit", "release")
    assert run_tests.finish(suite, own_build / "half.xml", own_build / "log", 0, (0,)).failures


class ReadyBuilder(run_tests.Builder):
    """Everything is built."""

    def build(self, flavour: str) -> str | None:
        return None


class BrokenBuilder(run_tests.Builder):
    """Nothing compiles."""

    def build(self, flavour: str) -> str | None:
        return f"{flavour}: error: no such variable"


def test_an_empty_group_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing = Suite("sim release", "release", lambda *_: Outcome())
    monkeypatch.setitem(run_tests.GROUPS, "sim", [nothing])
    outcome = run_tests.run_group("sim", ReadyBuilder(), OPTIONS)
    assert heads(outcome) == ["sim: the group ran no test"]


def test_a_group_whose_tests_are_all_skipped_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    skipping = Suite("sim release", "release", lambda *_: Outcome(skips=["a: why"]))
    monkeypatch.setitem(run_tests.GROUPS, "sim", [skipping])
    assert run_tests.run_group("sim", ReadyBuilder(), OPTIONS).failures


def test_a_failed_build_fails_its_suite(monkeypatch: pytest.MonkeyPatch) -> None:
    fine = Suite("sim release", "release", lambda *_: Outcome(passed=1))
    monkeypatch.setitem(run_tests.GROUPS, "sim", [fine])
    outcome = run_tests.run_group("sim", BrokenBuilder(), OPTIONS)
    assert heads(outcome)[0] == "sim release: the build failed"
    assert "no such variable" in outcome.failures[0]


def test_an_image_that_cannot_be_made_fails_its_suite(
    monkeypatch: pytest.MonkeyPatch, own_build: Path
) -> None:
    script = own_build / "build.sh"
    script.write_text('#!/bin/sh\necho "no kernel for $3"; exit 1\n')
    script.chmod(0o755)
    booting = Suite("boot", "release", lambda *_: Outcome(passed=1), images=("a", "b"))
    monkeypatch.setitem(run_tests.GROUPS, "boot", [booting])
    options = argparse.Namespace(only="", fail_fast=False, fuzz_seconds=1, groups=["boot"])
    outcome = run_tests.run_group("boot", ReadyBuilder(), options)
    assert heads(outcome)[0] == "boot: the build failed"
    assert "no kernel for a" in outcome.failures[0]


def test_without_root_no_image_is_made_and_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    options = argparse.Namespace(only="", fail_fast=False, fuzz_seconds=1, groups=[])
    outcome = run_tests.run_group("boot", BrokenBuilder(), options)
    assert outcome.skips == ["boot: making and booting an image needs root"]
    assert not outcome.failures


def test_fail_fast_leaves_the_next_suite_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    bad = Suite("sim release", "release", lambda *_: Outcome(failures=["sim: x"]))
    fine = Suite("sim asan", "asan", lambda *_: Outcome(passed=1))
    monkeypatch.setitem(run_tests.GROUPS, "sim", [bad, fine])
    options = argparse.Namespace(only="", fail_fast=True, fuzz_seconds=1)
    assert run_tests.run_group("sim", ReadyBuilder(), options).passed == 0
    assert run_tests.run_group("sim", ReadyBuilder(), OPTIONS).passed == 1


def fuzz_target(build: Path, name: str, script: str) -> None:
    target = build / "tests" / "fuzz" / f"fuzz_{name}"
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(f"#!/bin/sh\n{script}\n")
    target.chmod(0o755)


def test_fuzz_targets_need_a_corpus_and_the_canary_must_be_found(own_build: Path) -> None:
    build = own_build / "build" / "fuzz"
    fuzz_target(build, "good", "exit 0")
    fuzz_target(build, "bad", "echo ERROR: overflow; exit 77")
    fuzz_target(build, "bare", "exit 0")
    fuzz_target(build, "canary", "exit 77")
    for name in ("good", "bad"):
        corpus = own_build / "tests" / "fuzz" / name / "corpus"
        corpus.mkdir(parents=True)
        (corpus / "one").write_bytes(b"1")
    outcome = run_tests.run_fuzz(run_tests.GROUPS["fuzz"][0], OPTIONS)
    assert outcome.passed == 3
    assert [head.split(":")[1].strip() for head in heads(outcome)] == [
        "bad corpus",
        "bad search",
        "bare",
    ]
    fuzz_target(build, "canary", "exit 0")
    assert "fuzz: canary is found: ended with 0" in heads(
        run_tests.run_fuzz(run_tests.GROUPS["fuzz"][0], OPTIONS)
    )
