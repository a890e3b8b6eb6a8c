#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Measure ecdaq beside other masters, or the simulator, on this machine: app/doc/results/.

Called by `build.sh bench`, which has built everything.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    from measure.page import Subject

ROOT = Path(__file__).resolve().parents[2]
SLAVES_MOST = 128  # what the loops have room for
CYCLES_MOST = 50000  # what the sample ring holds
CYCLES = {"peers": 4000, "sim": 20000}
# Options of the other subjects.
OTHERS = {
    "peers": ("seeds", "before"),
    "sim": ("rounds", "interface"),
    "setup": ("slaves", "cycles", "rounds", "interface", "seeds", "before", "json"),
}
SLAVES = {"peers": [2, 16, 64], "sim": [2, 16, 64, 128]}

HELP = """\
peers  ecdaq beside other masters

Runs ecdaq, SOEM, pysoem and EtherCrab in turns on a simulated segment in a network namespace of
its own, beside cyclictest and the echo of a raw packet, and writes what it found to
app/doc/results/peers.md: wake latency, interval, round trip, cycles lost per lost frame, rate,
SYNC0 spread, time to OP, instructions and system calls a cycle. Masters that cannot take part and
figures that cannot be had are listed there with the reason. The masters come from their
registries, once, into ~/.cache/ecdaq/. About 15 minutes; run it on an idle machine.

sim  how fast virtual time is

Runs the whole master with simulated slaves on virtual time, seed by seed and many seeds on all
cores at once, and writes app/doc/results/sim.md: virtual seconds in a second, instructions and
processor time a cycle. About a minute.

setup  from nothing to OP

Runs `./build.sh run` and `./build.sh build` in a Debian 12 that has nothing of what they need,
with an empty cache, and writes app/doc/results/setup.md: seconds until OP, step by step, and the
times of the groups of tests and of the slowest ten as the last `./build.sh test` left them. As
root; about 3 minutes; run it on an idle machine.

cycle, record, dds  the same as `./build.sh measure` of these

Instructions of a cycle; a recorded sample beside the official MCAP writer; what DDS delivers.
"""


class Parser(argparse.ArgumentParser):
    """One line for a wrong call."""

    def error(self, message: str) -> NoReturn:
        print(f"build.sh: bench: {message}", file=sys.stderr)
        sys.exit(2)


def number(least: int, most: int) -> object:
    def read(text: str) -> int:
        if not text.isascii() or not text.isdigit() or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"'{text}' is not a number from {least} to {most}")
        return int(text)

    return read


def numbers(text: str) -> list[int]:
    read = number(1, SLAVES_MOST)
    return [read(word) for word in text.split(",")]  # type: ignore[operator]


def interface(text: str) -> str:
    if not (Path("/sys/class/net") / text).exists() or "/" in text or not text:
        raise argparse.ArgumentTypeError(f"'{text}': no such network interface")
    return text


def check_options(parser: Parser, options: argparse.Namespace) -> None:
    for name in OTHERS[options.what]:
        if getattr(options, name) is not None:
            parser.error(f"--{name}: not an option of {options.what}")
    if options.before and not (options.before / "tests/cost/cost_virtual").exists():
        parser.error(f"--before: {options.before} has no tests/cost/cost_virtual")
    if options.interface and options.slaves:
        parser.error("--interface and --slaves exclude each other")
    if options.interface and os.geteuid() != 0:
        parser.error("--interface: only as root")
    options.cycles = options.cycles or CYCLES.get(options.what)


def parse_arguments(arguments: Sequence[str]) -> argparse.Namespace:
    parser = Parser(
        prog="./build.sh bench",
        usage="./build.sh bench peers|sim|setup [OPTION...], or cycle|record|dds",
        description=HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("what", metavar="peers|sim|setup", nargs="?", help="what to measure")
    parser.add_argument(
        "--slaves",
        type=numbers,
        metavar="N,...",
        help="FB1111-Piccolos (default: 2,16,64; sim: 128, too)",
    )
    parser.add_argument(
        "--cycles", type=number(100, CYCLES_MOST), metavar="N",
        help=f"of 1 ms in each run (default: {CYCLES['peers']}; sim: {CYCLES['sim']})",
    )  # fmt: skip
    parser.add_argument(
        "--rounds", type=number(1, 100), metavar="N",
        help="peers: how often each master has its turn (default: 2)",
    )  # fmt: skip
    parser.add_argument(
        "--seeds", type=number(1, 1000), metavar="N",
        help="sim: runs of each number of slaves (default: 8)",
    )  # fmt: skip
    parser.add_argument(
        "--before", type=Path, metavar="FOLDER",
        help="sim: build/release of another tree, which is measured in turns with this one",
    )  # fmt: skip
    parser.add_argument(
        "--interface", type=interface, metavar="IF",
        help="peers: a network interface of this machine with real slaves on it, instead of the "
        "simulated segment. They are led to OP, with all outputs 0; as root",
    )  # fmt: skip
    parser.add_argument("--json", type=Path, metavar="FILE", help="the same for programs")
    parser.add_argument(
        "--page", type=Path, metavar="FILE", help="write the page there, and no list of pages"
    )
    # build.sh calls this before it prepares anything.
    parser.add_argument("--check", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.what not in OTHERS:
        there_are = "peers sim setup cycle record dds"  # the last three are not for this program
        parser.error(f"name what to measure: {there_are}" if options.what is None
                     else f"no subject '{options.what}'; there are: {there_are}")  # fmt: skip
    check_options(parser, options)
    return options


def command_of(arguments: Sequence[str]) -> str:
    return " ".join(["./build.sh bench", *arguments])


def write(
    options: argparse.Namespace,
    subject: Subject,
    arguments: Sequence[str],
    run: Callable[[Path], list[str]],
    reason: Callable[[], str] = str,
) -> int:
    """The page of @subject, with the lines of @run; the exit code. @reason: what else is said where
    there are none."""
    from measure.page import NotMeasuredError, write_index, write_page
    from measure.subjects import PAGES

    try:
        made = replace(subject, commands=(command_of(arguments),), measure=run)
        page = write_page(ROOT, made, options.page)
    except (NotMeasuredError, FileNotFoundError, RuntimeError) as why:
        print(f"build.sh: bench: {why}{reason()}", file=sys.stderr)
        return 1
    if not options.page:
        write_index(ROOT, PAGES)
    print(f"{subject.name}: wrote {page}", flush=True)
    return 0


def measure(options: argparse.Namespace, arguments: Sequence[str]) -> int:
    from bench.page import lines_of
    from bench.rounds import Bench, Plan, write_json
    from bench.running import programs_are_there
    from foreign import Unavailable
    from measure.page import commit, machine
    from measure.subjects import PEERS

    slaves = [0] if options.interface else options.slaves or SLAVES["peers"]
    try:
        programs_are_there()
        bench = Bench(Plan(slaves, options.cycles, options.rounds or 2, options.interface))
    except (Unavailable, PermissionError) as why:
        print(f"build.sh: bench: {why}", file=sys.stderr)
        return 1

    def run(_: Path) -> list[str]:
        at = commit(ROOT)
        bench.run()
        if options.json:
            head = {"command": command_of(arguments), "commit": at, "machine": machine()}
            write_json(options.json, bench, head)
        return lines_of(bench)

    # The page has the commit from before the run.
    return write(options, PEERS, arguments, run, lambda: f"; {bench.first_reason()}")


def measure_virtual(options: argparse.Namespace, arguments: Sequence[str]) -> int:
    from bench import virtual
    from measure.page import commit, machine
    from measure.subjects import SIM

    cores = os.cpu_count() or 1
    seeds = options.seeds or 8

    def run(_: Path) -> list[str]:
        at = commit(ROOT)
        rows = [
            virtual.measure_row(slaves, options.cycles, seeds, options.before, cores)
            for slaves in options.slaves or SLAVES["sim"]
        ]
        if options.json:
            head = {
                "command": command_of(arguments),
                "commit": at,
                "machine": machine(),
                "seeds": seeds,
            }
            whole = head | {"cycles": options.cycles, "rows": virtual.figures(rows)}
            options.json.write_text(json.dumps(whole, indent=1) + "\n")
        return virtual.lines_of(rows, options.cycles, seeds, cores)

    return write(options, SIM, arguments, run)


def measure_setup(options: argparse.Namespace, arguments: Sequence[str]) -> int:
    from bench import setup
    from measure.subjects import SETUP

    return write(options, SETUP, arguments, setup.lines_of)


def main(arguments: Sequence[str]) -> int:
    options = parse_arguments(arguments)
    if options.check:
        return 0
    whats = {"peers": measure, "sim": measure_virtual, "setup": measure_setup}
    return whats[options.what](options, arguments)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
