# SPDX-License-Identifier: MIT
"""ecdaq-remote: watch, record, set and status from a PC, over DDS."""

from __future__ import annotations

import argparse
import csv
import dataclasses
import json
import os
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from ecdaq.errors import LinkError, NoAnswerError

if TYPE_CHECKING:  # main() imports DDS, and says so if it is missing
    from ecdaq.idl_types import SampleV1
    from ecdaq.link import Channels, Link

GAPS_LISTED = 20


def watch(link: Link, options: argparse.Namespace) -> int:
    """Print one line per slave, twice a second."""
    channels = link.channels()
    shown: dict[int, int] = {}
    every = max(1, 500_000_000 // channels.period_ns)
    for sample in link.subscribe(options.seconds):
        if sample.cycle < shown.get(sample.slave, 0):
            continue
        shown[sample.slave] = sample.cycle + every
        values = " ".join(
            f"{c.entry}={format_value(c.value(sample))}{c.unit}"
            for c in channels.of_slave(sample.slave)
        )
        name = channels.slave_names[sample.slave]
        good = "" if sample.is_good else " NOT GOOD"
        print(f"{name} cycle {sample.cycle}{good} {values}", flush=True)
    return report_gaps(link)


def format_value(value: float) -> str:
    """Integers exactly, physical values with six digits."""
    return str(value) if isinstance(value, int) else f"{value:g}"


def report_gaps(link: Link) -> int:
    """How many samples are missing, and where. The exit code: 1 if any is missing."""
    gaps = link.gaps
    print(f"{gaps.gaps} gaps, {gaps.missing} samples missing", file=sys.stderr)
    names = link.channels().slave_names if gaps.spans else []
    for slave, first, count in gaps.spans[:GAPS_LISTED]:
        name = names[slave] if slave < len(names) else f"slave {slave}"
        print(f"  {name}: cycles {first} to {first + count - 1}: {count} missing", file=sys.stderr)
    if len(gaps.spans) > GAPS_LISTED:
        print(f"  and {len(gaps.spans) - GAPS_LISTED} more gaps", file=sys.stderr)
    return 0 if gaps.gaps == 0 else 1


def with_progress(link: Link, seconds: float | None) -> Iterator[SampleV1]:
    """The samples of link.subscribe(); on a terminal, a line of progress on stderr."""
    started = shown = time.monotonic()
    samples = 0
    try:
        for sample in link.subscribe(seconds):
            samples += 1
            yield sample
            now = time.monotonic()
            if now - shown >= 0.5 and sys.stderr.isatty():
                shown = now
                limit = "" if seconds is None else f" of {seconds:g}"
                text = f"{now - started:.0f}{limit} s, {samples} samples, {link.gaps.gaps} gaps"
                print(f"\r{text}\033[K", end="", file=sys.stderr, flush=True)
    finally:
        if shown > started:
            print("\r\033[K", end="", file=sys.stderr)


def header(channels: Channels, slave: int) -> list[str]:
    names = [f"{c.entry} [{c.unit}]" if c.unit else c.entry for c in channels.of_slave(slave)]
    return ["cycle", "dc_time_ns", "utc_ns", "flags", "is_good", *names]


def record_csv(link: Link, options: argparse.Namespace) -> int:
    channels = link.channels()
    options.dir.mkdir(parents=True, exist_ok=True)
    period_s = channels.period_ns / 1e9
    files = [(options.dir / f"{name}.csv").open("w", newline="") for name in channels.slave_names]
    rows = [0] * len(files)
    try:
        writers = [csv.writer(file) for file in files]
        for slave, writer in enumerate(writers):
            writer.writerow(header(channels, slave))
        for s in with_progress(link, options.seconds):
            if s.session != channels.session:
                print("the master has restarted: end of the recording", file=sys.stderr)
                break
            values = [c.value(s) for c in channels.of_slave(s.slave)]
            writers[s.slave].writerow(
                [s.cycle, s.dc_time_ns, s.utc_ns, s.flags, int(s.is_good), *values]
            )
            rows[s.slave] += 1
    finally:
        for file, count in zip(files, rows, strict=True):
            file.close()
            size = Path(file.name).stat().st_size
            print(
                f"{file.name}: {count} samples, {count * period_s:.1f} s, {size} bytes", flush=True
            )
    return report_gaps(link)


def next_channels(link: Link, session: int) -> Channels:
    """The channel table of @session, which is published before its first sample."""
    end = time.monotonic() + 10
    while (channels := link.channels()).session != session:
        if time.monotonic() > end:
            raise NoAnswerError(f"no channel table of session {session} within 10 s")
        time.sleep(0.01)
    return channels


def record_mcap(link: Link, options: argparse.Namespace) -> int:
    from ecdaq import __version__
    from ecdaq.mcap_file import McapFile  # slow to import

    def finish(file: McapFile, reason: str) -> None:
        path = file.close(reason)
        seconds = file.cycles * file.channels.period_ns / 1e9
        size = path.stat().st_size
        print(f"{path}: {file.cycles} cycles, {seconds:.1f} s, {size} bytes", flush=True)

    file = McapFile(options.dir, link.channels(), f"ecdaq-remote {__version__}")
    poll_at = 0.0
    recorded_utc_ns = -1  # of the newest time map in the file
    try:
        for sample in with_progress(link, options.seconds):
            if sample.session != file.session:
                finish(file, "the master was restarted")
                file = McapFile(options.dir, next_channels(link, sample.session), file.program)
            file.add(sample)
            if time.monotonic() < poll_at:
                continue
            poll_at = time.monotonic() + 0.5
            for event in link.events(0):
                file.add_event(event)
            timemap = link.timemap()
            if timemap.session == file.session and timemap.utc_ns != recorded_utc_ns:
                recorded_utc_ns = timemap.utc_ns
                file.add_timemap(timemap)
    finally:
        finish(file, "stopped")
    return report_gaps(link)


def record(link: Link, options: argparse.Namespace) -> int:
    """Record MCAP with the topics and fields of the appliance's own recordings, or one CSV file
    per slave. Unscaled integers are exact. Ctrl-C ends it; files and gaps are listed."""
    return record_csv(link, options) if options.csv else record_mcap(link, options)


def set_outputs(link: Link, options: argparse.Namespace) -> int:
    """Set outputs and hold them for --hold seconds; outputs with a timeout then go fail-safe."""
    values: dict[str, float] = {}
    for word in options.assignments:
        name, equals, text = word.partition("=")
        if not equals:
            print(f"ecdaq-remote: {word}: expected OUTPUT=VALUE", file=sys.stderr)
            return 2
        try:
            values[name] = float({"on": "1", "off": "0"}.get(text, text))
        except ValueError:
            print(f"ecdaq-remote: {word}: the value must be a number, on or off", file=sys.stderr)
            return 2
    cycle = link.command(values)
    print(f"{' '.join(options.assignments)} from cycle {cycle}", flush=True)
    if options.hold > 0:
        for _ in link.subscribe(options.hold):
            pass
    return 0


def status(link: Link, options: argparse.Namespace) -> int:
    found = dataclasses.asdict(link.status())
    if options.json:
        print(json.dumps(found))
    else:
        for name, value in found.items():
            print(f"{name:20} {value}")
    return 0


class Parser(argparse.ArgumentParser):
    """An error is one line, without the usage."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"ecdaq-remote: {message}: see {self.prog} --help\n")


def positive(text: str) -> float:
    """A number of seconds."""
    value = float(text)
    if not 0 <= value < float("inf"):
        raise ValueError
    return value


positive.__name__ = "number of seconds"  # as argparse calls it in its message


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = Parser(
        prog="ecdaq-remote", description="Read and command an ecdaq appliance over DDS."
    )
    add = parser.add_argument
    add("--interface", required=True, help="network interface of this PC")
    add("--domain", type=int, default=0, help="dds.domain of the appliance (default: 0)")
    add("--tag", default="", help="dds.tag of the appliance")
    add("--peer", action="append", default=[], help="address of the appliance, without multicast")
    add("--no-multicast", action="store_true", help="discover peers by address only")
    add("--security", type=Path, help="directory with our keys, if the appliance requires them")
    verbs = parser.add_subparsers(required=True, metavar="VERB")
    for name, function, text in (
        ("watch", watch, "show the values"),
        ("record", record, "record to MCAP or CSV"),
        ("set", set_outputs, "set outputs of owner remote"),
        ("status", status, "show state and counters of the master"),
    ):
        verb = verbs.add_parser(name, help=text, description=function.__doc__)
        verb.set_defaults(function=function)
        if name in ("watch", "record"):
            verb.add_argument("--seconds", type=positive, help="default: until Ctrl-C")
        if name == "record":
            verb.add_argument("--dir", type=Path, default=Path("."), help="default: this one")
            verb.add_argument("--csv", action="store_true", help="one CSV file per slave")
        if name == "set":
            verb.add_argument("assignments", nargs="+", metavar="OUTPUT=VALUE")
            verb.add_argument("--hold", type=positive, default=0, metavar="SECONDS")
        if name == "status":
            verb.add_argument("--json", action="store_true")
    return parser.parse_args(arguments)


def run(options: argparse.Namespace) -> int:
    from ecdaq.link import connect

    with connect(
        options.interface,
        domain=options.domain,
        multicast=not options.no_multicast,
        peers=options.peer,
        tag=options.tag,
        security=options.security,
    ) as link:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: link.stop())
        return options.function(link, options)


def one_line(text: object) -> str:
    return " ".join(str(text).split())


def main(arguments: Sequence[str] | None = None) -> int:
    """Every error is one line on stderr; the exit codes are those of exit-codes.md."""
    options = parse(arguments)
    try:
        return run(options)
    except LinkError as error:
        problem, code = str(error), error.exit_code
    except ValueError as error:
        problem, code = str(error), 2
    except BrokenPipeError:  # the reader of our output has ended
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        problem, code = where + (error.strerror or str(error)), 1
    except ImportError as error:
        package = (error.name or "").partition(".")[0] or "a package"
        problem, code = f"{package} cannot be imported: pip install ecdaq: {error}", 1
    except KeyboardInterrupt:
        problem, code = "interrupted before it was connected", 1
    except Exception as error:  # of the DDS library, say: never a traceback
        problem, code = f"failed: {type(error).__name__}: {error}", 1
    print(f"ecdaq-remote: {one_line(problem)}", file=sys.stderr)
    return code


if __name__ == "__main__":
    raise SystemExit(main())
