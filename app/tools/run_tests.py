# SPDX-License-Identifier: MIT
"""Run groups of tests and add up what ctest, pytest and the fuzz targets report.

Called by `build.sh test`, which has made the Python environment. A group is a list of suites; a
suite is one program that runs tests in one flavour of the build. The last line printed is
"N passed, N failed, N skipped".
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import resource
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from beside import Beside, wait_for_any
from fuzz_coverage import LEAST_PERCENT, CoverageError, make_seeds, reached
from processes import adopt_orphans, end_group, wait_and_reap
from test_report import Outcome, fail_unexpected_skips, read_junit, tail

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build"
LOGS = BUILD / "test-logs"
SUITE_SECONDS = 3000
BOOT_SECONDS = 9000
IMAGE_SECONDS = 5400
FUZZ_SEED = 20261122
# Of the slowest target, on a loaded machine.
FUZZ_RUNS_PER_SECOND = 2
SLOWEST = 10
IMAGES = ("ecdaq-qemuarm64", "ecdaq-raspberrypi4-64")
# What threads share: the tests of these modules run under ThreadSanitizer.
SHARED_STATE = (
    "ring",
    "line",
    "board",
    "status",
    "histogram",
    "cycle_thread",
    "control_guard",
    "daemon_event_queue",
    "remote_board",
)
SHARED_STATE_TESTS = f"^({'|'.join(SHARED_STATE)})[.]"
# whole.* runs all tests of a program in one process, once more: in the release flavour only.
ONE_BY_ONE = ("-E", "^whole[.]")
CONTROL_TESTS = r"^(control|sim_control|sim_loopback)[.]"
SYNC0_TESTS = r"^sync0(_gpio|_watch)?\."


@dataclass(frozen=True)
class Suite:
    """One program that runs tests, in one flavour of the build."""

    name: str
    flavour: str
    run: Callable[[Suite, argparse.Namespace], Outcome]
    arguments: tuple[str, ...] = ()
    seconds: int = SUITE_SECONDS
    images: tuple[str, ...] = ()

    @property
    def build_dir(self) -> Path:
        return BUILD / self.flavour

    @property
    def stage(self) -> Path:
        return BUILD / "stage" if self.flavour == "release" else self.build_dir / "stage"


def run_logged(
    command: Sequence[str | Path], log: Path, env: dict[str, str], seconds: int = SUITE_SECONDS
) -> int:
    """Run a command with its output in a file; ends it after @seconds with 124."""
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("wb") as out:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=out,
            cwd=ROOT,
            env=env,
            start_new_session=True,
        )
        try:
            return wait_and_reap(process, seconds)
        except subprocess.TimeoutExpired:
            end_group(process)
            out.write(f"\nended after {seconds} s\n".encode())
            return 124
        except BaseException:
            end_group(process)
            raise


def environment(suite: Suite) -> dict[str, str]:
    """What a test may rely on: where the programs, the build and the flavour are."""
    return os.environ | {
        "ECDAQ_BIN_DIR": str(suite.stage / "bin"),
        "ECDAQ_STAGE": str(suite.stage),
        "ECDAQ_BUILD": str(suite.build_dir),
        "ECDAQ_FLAVOUR": suite.flavour,
        "PYTHONDONTWRITEBYTECODE": "1",
        "ASAN_OPTIONS": "detect_leaks=1:strict_string_checks=1",
        "UBSAN_OPTIONS": "print_stacktrace=1",
        "TSAN_OPTIONS": "halt_on_error=1:second_deadlock_stack=1",
    }


def finish(suite: Suite, junit: Path, log: Path, status: int, good: tuple[int, ...]) -> Outcome:
    outcome = Outcome()
    if junit.exists():
        try:
            outcome = read_junit(junit, suite.name)
        except ET.ParseError as error:
            outcome.failures.append(f"{suite.name}: {junit.name} cannot be read: {error}")
    if status not in good and not outcome.failures:
        text = log.read_text(errors="replace")
        outcome.failures.append(f"{suite.name}: ended with {status}\n{tail(text, 30)}")
    outcome.log = str(log.relative_to(ROOT))
    return outcome


def fixed_addresses() -> list[str]:
    """ThreadSanitizer of gcc 12 cannot run where the kernel spreads addresses over 32 bits."""
    wrapper = ["setarch", platform.machine(), "-R"]
    works = subprocess.run([*wrapper, "true"], capture_output=True, check=False).returncode == 0
    return wrapper if works else []


def run_ctest(suite: Suite, options: argparse.Namespace) -> Outcome:
    slug = suite.name.replace(" ", "-")
    junit, log = LOGS / f"{slug}.xml", LOGS / f"{slug}.log"
    junit.unlink(missing_ok=True)
    command = fixed_addresses() if suite.flavour == "tsan" else []
    command += ["ctest", "--test-dir", str(suite.build_dir), "--output-on-failure"]
    command += ["--output-junit", str(junit), "--test-output-size-failed", "100000"]
    command += ["-j", str(os.cpu_count() or 1), *suite.arguments]
    if options.only and suite.flavour != "tsan":
        command += ["-R", options.only]
    status = run_logged(command, log, environment(suite))
    return finish(suite, junit, log, status, (0, 8))


def run_pytest(suite: Suite, options: argparse.Namespace) -> Outcome:
    """suite.arguments: a folder or a file of tests, and options of pytest."""
    path = ROOT / suite.arguments[0]
    if not path.is_file() and not any(path.glob("test_*.py")):
        return Outcome()
    slug = suite.name.replace(" ", "-")
    junit, log = LOGS / f"{slug}.xml", LOGS / f"{slug}.log"
    junit.unlink(missing_ok=True)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-rs"]
    command += [f"--junitxml={junit}", *suite.arguments[1:], str(path)]
    if options.only:
        command += ["-k", options.only]
    status = run_logged(command, log, environment(suite), suite.seconds)
    return finish(suite, junit, log, status, (0, 1, 5))


def run_fuzz_target(suite: Suite, target: Path, seconds: int) -> Outcome:
    """The target's corpus must pass, then some seconds of search must find nothing.

    The canary is the other way round: its planted fault must be found, or the search is blind.
    """
    outcome = Outcome()
    name = target.name.removeprefix("fuzz_")
    source = ROOT / "tests" / "fuzz" / name
    found = suite.build_dir / "corpus" / name
    artifacts = suite.build_dir / "artifacts" / name
    for folder in (found, artifacts):
        folder.mkdir(parents=True, exist_ok=True)
    limits = ["-timeout=10", "-rss_limit_mb=2048", f"-artifact_prefix={artifacts}/"]
    limits += ["-print_final_stats=1"]
    if os.environ.get("CI"):
        limits.append(f"-seed={FUZZ_SEED}")
    if (source / f"{name}.dict").exists():
        limits.append(f"-dict={source / f'{name}.dict'}")
    corpus = sorted((source / "corpus").glob("*"))
    seeds = make_seeds(name, suite.build_dir / "seeds" / name)
    steps: list[tuple[str, list[str | Path], bool]] = [
        ("corpus", [target, *limits, *corpus, *seeds], False),
        (
            "search",
            [
                *(target, *limits, f"-max_total_time={seconds}", found, source / "corpus"),
                *{path.parent for path in seeds},
            ],
            False,
        ),
    ]
    if name == "canary":
        steps = [("is found", [target, *limits, "-max_total_time=60"], True)]
    elif not corpus:
        outcome.failures.append(f"fuzz: {name}: tests/fuzz/{name}/corpus is empty")
        return outcome
    for step, command, must_fail in steps:
        log = LOGS / f"fuzz-{name}-{step.replace(' ', '-')}.log"
        status = run_logged(command, log, environment(suite), suite.seconds + seconds)
        if (status != 0) == must_fail:
            outcome.passed += 1
            runs = re.search(
                r"^stat::number_of_executed_units: *(\d+)", log.read_text(errors="replace"), re.M
            )
            if step == "search" and (not runs or int(runs[1]) < FUZZ_RUNS_PER_SECOND * seconds):
                outcome.passed -= 1
                did = runs[1] if runs else "no"
                outcome.failures.append(
                    f"fuzz: {name} search: {did} runs in {seconds} s, at least "
                    f"{FUZZ_RUNS_PER_SECOND} a second are expected"
                )
        else:
            text = tail(log.read_text(errors="replace"), 40)
            outcome.failures.append(f"fuzz: {name} {step}: ended with {status}\n{text}")
    return outcome


def run_side_by_side(functions: Mapping[str, Callable[[], Outcome]]) -> Outcome:
    """All of them, as many at once as there are processors; started and added in their order."""
    waiting = list(functions.items())
    running: dict[str, Beside[Outcome]] = {}
    results: dict[str, Outcome] = {}
    while waiting or running:
        while waiting and len(running) < (os.cpu_count() or 1):
            name, function = waiting.pop(0)
            running[name] = Beside(function)
        ended = wait_for_any(running.values())
        results |= {n: result_of(n, one) for n, one in running.items() if one in ended}
        running = {n: one for n, one in running.items() if one not in ended}
    total = Outcome()
    for name in functions:
        total.add(results[name])
    return total


def result_of(name: str, one: Beside[Outcome]) -> Outcome:
    """Wait for one that runs beside this process."""
    return one.result() or Outcome(failures=[f"{name}: ended without a result"])


def run_fuzz(suite: Suite, options: argparse.Namespace) -> Outcome:
    targets = [p for p in (suite.build_dir / "tests" / "fuzz").glob("**/fuzz_*") if p.is_file()]
    chosen = sorted(p for p in targets if os.access(p, os.X_OK) and re.search(options.only, p.name))
    return run_side_by_side(
        {
            target.name: partial(run_fuzz_target, suite, target, options.fuzz_seconds)
            for target in chosen
        }
    )


def needs_idle_host(path: Path) -> bool:
    """Whether a file says that its tests measure time, or that something on the host has to keep
    pace with their machine."""
    return re.search(r"^(IDLE|OUTSIDE|WIRE) = True$", path.read_text(), re.M) is not None


def run_files(suite: Suite, options: argparse.Namespace) -> Outcome:
    """The files that match suite.arguments[0], a pytest for each. A bus, or a machine that is
    alone with its clock, uses one processor at most: as many at once as there are processors.
    Then those that need an idle host, one after the other."""
    paths = sorted((ROOT / "tests").glob(suite.arguments[0]))
    files = {
        path: replace(
            suite,
            name=f"{suite.name} {path.stem.removeprefix('test_')}",
            arguments=(str(path.relative_to(ROOT)), *suite.arguments[1:]),
        )
        for path in paths
    }
    one_by_one = [path for path in paths if needs_idle_host(path)]
    together = [path for path in paths if path not in one_by_one]
    outcome = run_side_by_side({p.name: partial(run_pytest, files[p], options) for p in together})
    for path in one_by_one:
        outcome.add(run_pytest(files[path], options))
    return outcome


def run_coverage(suite: Suite, _options: argparse.Namespace) -> Outcome:
    """One test for each parser: its fuzz target reaches enough of its lines."""
    outcome = Outcome()
    try:
        rows = reached(suite.build_dir)
    except CoverageError as why:
        return Outcome(failures=[f"coverage: {why}"])
    for row in rows:
        print(row, flush=True)
        if row.percent >= LEAST_PERCENT:
            outcome.passed += 1
        else:
            outcome.failures.append(f"coverage: {row}: less than {LEAST_PERCENT} %")
    return outcome


def run_shared_state(suite: Suite, options: argparse.Namespace) -> Outcome:
    """The unit tests of what threads share; a name without a test is an error."""
    listing = subprocess.run(
        ["ctest", "--test-dir", suite.build_dir, "--show-only=json-v1", *suite.arguments],
        capture_output=True,
        text=True,
        check=True,
    )
    tests = [test["name"] for test in json.loads(listing.stdout)["tests"]]
    outcome = run_ctest(suite, options)
    for name in SHARED_STATE:
        if not any(test.startswith(f"{name}.") for test in tests):
            outcome.failures.append(f"{suite.name}: no test named {name}.*")
    return outcome


def ctest(group: str, flavour: str, *arguments: str) -> Suite:
    return Suite(f"{group} {flavour}", flavour, run_ctest, ("-L", f"^{group}$", *arguments))


def pytest(group: str, flavour: str, *options: str) -> Suite:
    return Suite(f"{group} python {flavour}", flavour, run_pytest, (f"tests/{group}", *options))


def booted(name: str, files: str) -> Suite:
    """Tests of the images, most of them in QEMU."""
    files = f"boot/{files}"
    return Suite(f"{name} python", "release", run_files, (files, "-s"), BOOT_SECONDS, IMAGES)


# Fast groups first. Tests labelled "long" run in the release flavour only.
GROUPS: dict[str, list[Suite]] = {
    "unit": [
        ctest("unit", "release", "-LE", "^long$"),
        ctest("unit", "asan", "-LE", "^long$", *ONE_BY_ONE),
        replace(ctest("unit", "tsan", "-R", SHARED_STATE_TESTS), run=run_shared_state),
    ],
    "tidy": [pytest("tidy", "release")],
    "cli": [
        ctest("cli", "release"),
        pytest("cli", "release"),
        ctest("cli", "asan", "-LE", "^long$"),
        pytest("cli", "asan"),
    ],
    "kit": [pytest("kit", "release")],
    "replay": [ctest("replay", "release"), pytest("replay", "release")],
    "sim": [
        ctest("sim", "release", "-LE", "^long$"),
        pytest("sim", "release"),
        ctest("sim", "asan", "-LE", "^long$", *ONE_BY_ONE),
    ],
    "cost": [pytest("cost", "release")],
    "fuzz": [Suite("fuzz", "fuzz", run_fuzz)],
    "recipes": [pytest("recipes", "release")],
    "deb": [pytest("deb", "release", "--ignore=tests/deb/test_arm64.py")],
    "live": [
        ctest("live", "release"),
        Suite("live python", "release", run_files, ("live/test_*.py",)),
    ],
    "dds": [pytest("dds", "release", "-s")],
    "docs": [pytest("docs", "release")],
    # All tests of control programs in unit, sim, cli and live.
    "control": [
        Suite("control release", "release", run_ctest, ("-R", CONTROL_TESTS)),
        Suite("control cli python", "release", run_pytest, ("tests/cli", "-k", "control")),
        Suite(
            "control live python",
            "release",
            run_pytest,
            ("tests/live", "-k", "control or loopback"),
        ),
    ],
    # All tests of the SYNC0 check in unit, cli and live.
    "sync0": [
        Suite("sync0 release", "release", run_ctest, ("-R", SYNC0_TESTS)),
        Suite("sync0 cli python", "release", run_pytest, ("tests/cli", "-k", "test_sync0")),
        Suite(
            "sync0 live python",
            "release",
            run_pytest,
            ("tests/live", "-k", "test_sync0 or test_oneshot"),
        ),
    ],
    "deb-arm64": [Suite("deb-arm64 python", "release", run_pytest, ("tests/deb/test_arm64.py",))],
    # Lines that the fuzz targets reach.
    "coverage": [Suite("coverage", "coverage", run_coverage)],
    "long": [ctest("long", "release")],
    "boot": [booted("boot", "test_[0-6][0-5]*.py")],
    "boot-long": [booted("boot-long", "test_[0-6][6-9]*.py")],
    "wire": [booted("wire", "test_[78]*.py")],
    "update": [booted("update", "test_9*.py")],
}
# Part of other groups, long, or too exact for a loaded machine: only when named.
ON_REQUEST = ("control", "sync0", "deb-arm64", "coverage", "long", "boot-long", "wire", "update")
# Runs a command behind all other work of the machine, also where the kernel groups that by session.
BEHIND = ("sh", "-c", '{ echo 19 > /proc/self/autogroup; } 2>/dev/null; exec "$@"', "behind")
# These mostly wait, and run beside the computing ones. The rest measure time: each alone.
WAITING = ("cli", "docs")
COMPUTING = ("unit", "tidy", "kit", "replay", "sim", "cost", "fuzz", "recipes", "deb")


class Builder:
    """Builds each flavour or image when a suite first needs it, and keeps the result."""

    def __init__(self) -> None:
        self.failed: dict[str, str | None] = {}
        self.images_beside: Beside[dict[str, str | None]] | None = None
        self.prefix: Sequence[str] = ()

    def build(self, flavour: str) -> str | None:
        """None, or the last lines of the failed build."""
        if flavour not in self.failed:
            script = ROOT / "app" / "tools" / "build-flavour.sh"
            self.failed[flavour] = self.make(flavour, [script, flavour], SUITE_SECONDS)
        return self.failed[flavour]

    def begin_images(self, machines: Sequence[str]) -> None:
        """Build images beside the tests, with the time of the processors that these leave idle."""

        def build() -> dict[str, str | None]:
            os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
            self.prefix = BEHIND
            return {machine: self.image(machine) for machine in machines}

        self.images_beside = Beside(build)

    def wait_for_images(self) -> None:
        """Until those that are built beside are done: what measures time is alone then."""
        if self.images_beside is not None:
            beside, self.images_beside = self.images_beside, None
            self.failed |= beside.result() or {}

    def image(self, machine: str) -> str | None:
        """The same as build() for a machine's image."""
        self.wait_for_images()
        if machine not in self.failed:
            command = [ROOT / "build.sh", "image", "--machine", machine]
            self.failed[machine] = self.make(machine, command, IMAGE_SECONDS)
        return self.failed[machine]

    def make(self, name: str, command: Sequence[str | Path], seconds: int) -> str | None:
        started = time.monotonic()
        log = LOGS / f"build-{name}.log"
        status = run_logged([*self.prefix, *command], log, dict(os.environ), seconds)
        print(f"{'build ' + name:24} {time.monotonic() - started:7.1f} s", flush=True)
        return None if status == 0 else tail(log.read_text(errors="replace"), 40)

    def prepare(self, suite: Suite) -> str | None:
        """All that a suite needs; the first problem ends it."""
        problem = self.build(suite.flavour)
        for machine in suite.images:
            problem = problem or self.image(machine)
        return problem


def may_boot(groups: Sequence[str]) -> bool:
    """Making and booting an image needs root: without it, only a user's explicit wish fails."""
    return os.geteuid() == 0 or "boot" in groups


def run_group(group: str, builder: Builder, options: argparse.Namespace) -> Outcome:
    total = Outcome()
    if group == "boot" and not may_boot(options.groups):
        return Outcome(skips=["boot: making and booting an image needs root"])
    for suite in GROUPS[group]:
        problem = builder.prepare(suite)
        started = time.monotonic()
        if problem is not None:
            outcome = Outcome(failures=[f"{suite.name}: the build failed\n{problem}"])
        else:
            outcome = suite.run(suite, options)
        total.add(outcome)
        if outcome.ran + len(outcome.skips) > 0:
            spent = time.monotonic() - started
            print(f"{suite.name:24} {spent:7.1f} s  {outcome.totals()}", flush=True)
            for failure in outcome.failures:
                print("FAILED " + failure.replace("\n", "\n    "), flush=True)
        if outcome.failures and options.fail_fast:
            return total
    if total.ran == 0:
        total.failures.append(f"{group}: the group ran no test")
        print(f"FAILED {group}: the group ran no test", flush=True)
    return total


def cpu_seconds() -> float:
    """Of all children that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run_timed(group: str, builder: Builder, options: argparse.Namespace) -> Outcome:
    started, cpu = time.monotonic(), cpu_seconds()
    outcome = run_group(group, builder, options)
    outcome.groups = [(group, time.monotonic() - started, cpu_seconds() - cpu)]
    return outcome


def run_all(groups: Sequence[str], builder: Builder, options: argparse.Namespace) -> Outcome:
    total = Outcome()
    for group in groups:
        total.add(run_timed(group, builder, options))
        if total.failures and options.fail_fast:
            break
    return total


def run_in_order(wanted: Sequence[str], builder: Builder, options: argparse.Namespace) -> Outcome:
    """All groups; each of those that wait beside those that compute."""
    computing = [group for group in wanted if group in COMPUTING]
    waiting = [group for group in wanted if group in WAITING]
    alone = [group for group in wanted if group not in (*computing, *waiting)]
    if len(computing) + len(waiting) < 2 or options.fail_fast:
        return run_all(wanted, builder, options)
    if "boot" in alone and may_boot(options.groups):
        builder.begin_images(IMAGES)
    # Two processes must not build in the same folder.
    for suite in (suite for group in waiting for suite in GROUPS[group]):
        builder.build(suite.flavour)
    beside = {name: Beside(partial(run_timed, name, builder, options)) for name in waiting}
    total = run_all(computing, builder, options)
    for name, one in beside.items():
        total.add(result_of(name, one))
    builder.wait_for_images()
    total.add(run_all(alone, builder, options))
    return total


def report_times(total: Outcome) -> None:
    """Print time per group and the slowest tests; keep both for ./build.sh measure ci."""
    print(f"\n{'time per group':24} {'wall':>9} {'CPU':>9}")
    for group, wall, cpu in total.groups:
        print(f"  {group:22} {wall:7.1f} s {cpu:7.1f} s")
    slowest = sorted(total.times, reverse=True)[:SLOWEST]
    print("\nslowest tests")
    for seconds, name in slowest:
        print(f"  {seconds:7.1f} s  {name}")
    LOGS.mkdir(parents=True, exist_ok=True)
    times = {"groups": total.groups, "slowest": slowest, "totals": total.totals()}
    (LOGS / "times.json").write_text(json.dumps(times) + "\n")


def end_on_signal(number: int, _frame: object) -> None:
    raise SystemExit(128 + number)


def parse_arguments(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="build.sh test")
    parser.add_argument("groups", nargs="*")
    parser.add_argument("--keep-going", dest="fail_fast", action="store_false")
    parser.add_argument("--fail-fast", dest="fail_fast", action="store_true")
    parser.add_argument("--only", default="")
    parser.add_argument(
        "--fuzz-seconds", type=int, default=int(os.environ.get("ECDAQ_FUZZ_SECONDS", "5"))
    )
    # build.sh calls this before it prepares anything.
    parser.add_argument("--check", action="store_true", help=argparse.SUPPRESS)
    parser.set_defaults(fail_fast=False)
    return parser.parse_args(arguments)


def main(arguments: Sequence[str]) -> int:
    # Started in the background by a shell, this ignores SIGINT; the tests must not inherit that.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, end_on_signal)
    adopt_orphans()
    options = parse_arguments(arguments)
    for group in options.groups:
        if group not in GROUPS:
            known = " ".join(GROUPS)
            print(f"build.sh: test: no group '{group}'; there are: {known}", file=sys.stderr)
            return 2
    if options.check:
        return 0
    usual = [g for g in GROUPS if g not in ON_REQUEST]
    wanted = [g for g in GROUPS if g in (options.groups or usual)]
    started = time.monotonic()
    total = run_in_order(wanted, Builder(), options)
    cpu = sum(seconds for *_, seconds in total.groups)
    total.groups.append(("together", time.monotonic() - started, cpu))
    if os.environ.get("CI"):
        fail_unexpected_skips(total, ROOT / "tests" / "expected_skips.txt")
    if total.skips:
        print("\nskipped, and why:\n  " + "\n  ".join(total.skips))
    if total.failures:
        heads = [failure.splitlines()[0] for failure in total.failures]
        print("\nfailed:\n  " + "\n  ".join(heads) + f"\nlogs: {LOGS.relative_to(ROOT)}/")
    report_times(total)
    print(f"\n{total.totals()}")
    return 1 if total.failures or total.ran == 0 else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
