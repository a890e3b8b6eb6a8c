# SPDX-License-Identifier: MIT
"""The test runner counts correctly: a failure, a crash or an empty group is never a success."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from project import ROOT

sys.path.insert(0, str(ROOT / "app" / "tools"))
import run_tests
from fuzz_coverage import Reached
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


def wait_for_lines(paths: list[Path]) -> None:
    end = time.monotonic() + 60
    while not all(path.exists() and path.read_text().strip() for path in paths):
        assert time.monotonic() < end
        time.sleep(0.01)


def is_running(process: Path) -> bool:
    """Of a folder in /proc. It is there until the parent, init perhaps, has asked for the end."""
    try:
        return (process / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_until_gone(paths: list[Path]) -> None:
    end = time.monotonic() + 60
    while any(is_running(path) for path in paths):
        assert time.monotonic() < end
        time.sleep(0.01)


def heads(outcome: Outcome) -> list[str]:
    return [failure.splitlines()[0] for failure in outcome.failures]


def test_ctest_results_are_counted_by_kind(own_build: Path) -> None:
    (own_build / "CMakeLists.txt").write_text(CTEST)
    build = own_build / "build" / "release"
    subprocess.run(["cmake", "-S", own_build, "-B", build], check=True, capture_output=True)
    outcome = run_tests.run_ctest(run_tests.ctest("unit", "release"), OPTIONS)
    assert outcome.totals() == "1 passed, 2 failed, 1 skipped"
    assert sorted(heads(outcome)) == ["unit release: a.bad", "unit release: a.gone"]
    assert any("the reason" in failure for failure in outcome.failures)
    assert outcome.skips == ["unit release: a.skip: no such NIC"]


def test_pytest_results_are_counted_by_kind(own_build: Path) -> None:
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


def test_images_are_built_beside_other_groups_and_a_failed_one_fails_its_suite(
    monkeypatch: pytest.MonkeyPatch, own_build: Path, tmp_path: Path
) -> None:
    """Each of the two waits for the other; the build takes only idle time, and is over before what
    measures time begins."""
    unit, image, built = tmp_path / "unit", tmp_path / "image", tmp_path / "built"
    script = own_build / "build.sh"
    script.write_text(
        f"#!/bin/sh\n[ $3 = ecdaq-qemuarm64 ] || {{ echo 'no kernel'; exit 1; }}\n"
        f"cat /proc/self/autogroup > {image} 2> /dev/null\n"
        f"chrt --pid $$ >> {image}; until [ -s {unit} ]; do sleep 0.01; done\n"
        f"sleep 1; touch {built}\n"
    )
    script.chmod(0o755)
    booting = Suite("boot", "release", lambda *_: Outcome(passed=1), images=run_tests.IMAGES)
    live = Suite("live", "release", lambda *_: Outcome(passed=int(built.exists())))
    monkeypatch.setitem(run_tests.GROUPS, "unit", [meeting(unit, image)])
    monkeypatch.setitem(run_tests.GROUPS, "replay", [meeting(unit, image)])
    monkeypatch.setitem(run_tests.GROUPS, "boot", [booting])
    monkeypatch.setitem(run_tests.GROUPS, "live", [live])
    options = argparse.Namespace(only="", fail_fast=False, fuzz_seconds=1, groups=["boot"])
    outcome = run_tests.run_in_order(["unit", "replay", "live", "boot"], ReadyBuilder(), options)
    assert outcome.totals() == "3 passed, 1 failed, 0 skipped"
    assert "no kernel" in outcome.failures[0]
    assert "SCHED_IDLE" in image.read_text()
    if Path("/proc/self/autogroup").exists():
        assert "nice 19" in image.read_text()


def test_without_root_no_image_is_built_and_the_reason_is_printed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
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


def meeting(own: Path, other: Path) -> Suite:
    """A suite that passes only while another one of its kind runs."""

    def run(*_: object) -> Outcome:
        own.write_text("here")
        wait_for_lines([other])
        return Outcome(passed=1)

    return Suite(own.name, "release", run)


def test_groups_that_wait_run_beside_those_that_compute(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    unit, cli, docs = tmp_path / "unit", tmp_path / "cli", tmp_path / "docs"
    failing = Suite("live", "release", lambda *_: Outcome(failures=["live: x"]))
    monkeypatch.setitem(run_tests.GROUPS, "unit", [meeting(unit, cli)])
    monkeypatch.setitem(run_tests.GROUPS, "cli", [meeting(cli, docs)])
    monkeypatch.setitem(run_tests.GROUPS, "docs", [meeting(docs, unit)])
    monkeypatch.setitem(run_tests.GROUPS, "live", [failing])
    outcome = run_tests.run_in_order(["unit", "cli", "live", "docs"], ReadyBuilder(), OPTIONS)
    assert outcome.totals() == "3 passed, 1 failed, 0 skipped"
    assert [name for name, *_ in outcome.groups] == ["unit", "cli", "docs", "live"]


def test_groups_that_end_without_a_result_are_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    fine = Suite("unit", "release", lambda *_: Outcome(passed=1))
    monkeypatch.setitem(run_tests.GROUPS, "unit", [fine])
    monkeypatch.setitem(
        run_tests.GROUPS, "docs", [Suite("docs", "release", lambda *_: os._exit(0))]
    )
    outcome = run_tests.run_in_order(["unit", "docs"], ReadyBuilder(), OPTIONS)
    assert heads(outcome) == ["docs: ended without a result"]


def corpus_for(root: Path, name: str) -> None:
    corpus = root / "tests" / "fuzz" / name / "corpus"
    corpus.mkdir(parents=True)
    (corpus / "one").write_bytes(b"1")


def fuzz_target(build: Path, name: str, script: str) -> None:
    target = build / "tests" / "fuzz" / f"fuzz_{name}"
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(f"#!/bin/sh\n{script}\n")
    target.chmod(0o755)


def test_a_parser_that_its_fuzz_target_does_not_reach_is_a_failure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rows = [Reached("a", "enough.c", 100, 80), Reached("a", "less.c", 1000, 799)]
    monkeypatch.setattr(run_tests, "reached", lambda _build: rows)
    outcome = run_tests.run_coverage(run_tests.GROUPS["coverage"][0], OPTIONS)
    assert outcome.passed == 1
    assert [name for name in heads(outcome) if "less.c" in name] == heads(outcome) != []


def test_fuzz_targets_need_a_corpus_and_the_canary_must_be_found(own_build: Path) -> None:
    build = own_build / "build" / "fuzz"
    fuzz_target(build, "good", "echo stat::number_of_executed_units: 100")
    fuzz_target(build, "bad", "echo ERROR: overflow; exit 77")
    fuzz_target(build, "bare", "exit 0")
    fuzz_target(build, "slow", "echo stat::number_of_executed_units: 1")
    fuzz_target(build, "canary", "exit 77")
    for name in ("good", "bad", "slow"):
        corpus_for(own_build, name)
    outcome = run_tests.run_fuzz(run_tests.GROUPS["fuzz"][0], OPTIONS)
    assert outcome.passed == 4
    assert [head.split(":")[1].strip() for head in heads(outcome)] == [
        "bad corpus",
        "bad search",
        "bare",
        "slow search",
    ]
    fuzz_target(build, "canary", "exit 0")
    assert "fuzz: canary is found: ended with 0" in heads(
        run_tests.run_fuzz(run_tests.GROUPS["fuzz"][0], OPTIONS)
    )


def test_a_search_of_an_hour_is_not_ended_before(
    monkeypatch: pytest.MonkeyPatch, own_build: Path
) -> None:
    limits = []

    def logged(_: object, log: Path, _env: object, seconds: int = run_tests.SUITE_SECONDS) -> int:
        limits.append(seconds)
        log.parent.mkdir(parents=True, exist_ok=True)
        log.write_text("stat::number_of_executed_units: 100000\n")
        return 0

    monkeypatch.setattr(run_tests, "run_logged", logged)
    corpus_for(own_build, "long")
    target = own_build / "fuzz_long"
    outcome = run_tests.run_fuzz_target(run_tests.GROUPS["fuzz"][0], target, 3600)
    assert (outcome.passed, outcome.failures) == (2, [])
    assert limits[1] > 3600


BOOTED = """
import time
from pathlib import Path

HERE = Path(__file__).parent

def test_it(request):
    own = Path(__file__).stem
    (HERE / f"{own}.started").touch()
    end = time.monotonic() + 60
    while not (HERE / "OTHER.started").exists():
        assert time.monotonic() < end, "does not run at the same time"
        time.sleep(0.01)
    (HERE / f"{own}.ended").touch()
"""


def test_files_run_side_by_side_but_those_that_need_an_idle_host(
    own_build: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    folder = own_build / "tests" / "boot"
    folder.mkdir(parents=True)
    for own, other in (("a", "b"), ("b", "a")):
        (folder / f"test_0{own}.py").write_text(BOOTED.replace("OTHER", f"test_0{other}"))
    for own, other in (("c", "d"), ("d", "c")):
        (folder / f"test_1{own}.py").write_text(
            "OUTSIDE = True\nfrom pathlib import Path\n\n\ndef test_it():\n"
            "    here = Path(__file__).parent\n"
            "    assert len(list(here.glob('*.ended'))) == 2\n"
            f"    assert not (here / '{other}.running').exists()\n"
            f"    (here / '{own}.running').touch()\n"
            "    import time\n    time.sleep(1)\n"
            f"    (here / '{own}.running').unlink()\n"
        )
    outcome = run_tests.run_files(run_tests.booted("boot", "test_*.py"), OPTIONS)
    assert outcome.failures == []
    assert outcome.totals() == "4 passed, 0 failed, 0 skipped"


def test_a_fuzz_target_runs_on_each_core(own_build: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    meet = "touch {0}; timeout 60 sh -c 'until [ -e {1} ]; do sleep 0.01; done' && echo {2}"
    report = "stat::number_of_executed_units: 100"
    for own, other in (("a", "b"), ("b", "a")):
        script = meet.format(own_build / own, own_build / other, report)
        fuzz_target(own_build / "build" / "fuzz", own, script)
        corpus_for(own_build, own)
    assert run_tests.run_fuzz(run_tests.GROUPS["fuzz"][0], OPTIONS).passed == 4


def test_a_shared_structure_without_a_test_fails(
    own_build: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (own_build / "CMakeLists.txt").write_text(CTEST)
    build = own_build / "build" / "tsan"
    subprocess.run(["cmake", "-S", own_build, "-B", build], check=True, capture_output=True)
    monkeypatch.setattr(run_tests, "SHARED_STATE", ("a", "handover"))
    suite = run_tests.ctest("unit", "tsan", "-R", "^(a|handover)[.]ok")
    outcome = run_tests.run_shared_state(suite, OPTIONS)
    assert heads(outcome) == ["unit tsan: no test named handover.*"]
    assert outcome.passed == 1


def test_an_unexpected_skip_is_a_failure_in_ci(own_build: Path) -> None:
    expected = own_build / "expected"
    expected.write_text("# comment\nno captures  they are not in the tree\n")
    total = Outcome(passed=1, skips=["replay: a: no captures here", "live: b: no network"])
    run_tests.fail_unexpected_skips(total, expected)
    assert total.skips == ["replay: a: no captures here"]
    assert heads(total) == [
        "live: b: no network (a skip that tests/expected_skips.txt does not list)"
    ]


@pytest.mark.parametrize("run", ["start()", "run_tests.Beside(start).result()"])
def test_a_signal_ends_everything_that_was_started(own_build: Path, run: str) -> None:
    """A process that has left the process group of its suite, too."""
    program = f"""
import signal, sys
sys.path.insert(0, {str(Path(run_tests.__file__).parent)!r})
import run_tests
signal.signal(signal.SIGTERM, run_tests.end_on_signal)
run_tests.adopt_orphans()
script = "setsid sleep 600 & echo $! > hidden; sleep 600 & echo $! > visible; wait"
run_tests.ROOT = run_tests.Path({str(own_build)!r})
def start():
    log, env = run_tests.ROOT / "log", {{"PATH": "/usr/bin:/bin"}}
    return run_tests.run_logged(["sh", "-c", script], log, env)
{run}
"""
    runner = subprocess.Popen([sys.executable, "-c", program], cwd=own_build)
    pids = [own_build / "hidden", own_build / "visible"]
    wait_for_lines(pids)
    runner.terminate()
    assert runner.wait(60) == 143
    # They would run for ten minutes.
    wait_until_gone([Path(f"/proc/{path.read_text().strip()}") for path in pids])
