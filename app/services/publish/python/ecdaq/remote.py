# SPDX-License-Identifier: MIT
"""ecdaq-remote: watch, record, set and status, from a PC."""

from __future__ import annotations

import argparse
import csv
import dataclasses
import json
import os
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from ecdaq.errors import LinkError
from ecdaq.link import Channels, Link, connect


def watch(link: Link, options: argparse.Namespace) -> int:
    """One line for every slave, twice a second."""
    channels = link.channels()
    shown: dict[int, int] = {}
    every = max(1, 500_000_000 // channels.period_ns)
    for sample in link.subscribe(options.seconds):
        if sample.cycle < shown.get(sample.slave, 0):
            continue
        shown[sample.slave] = sample.cycle + every
        values = " ".join(
            f"{c.entry}={sample.values[c.place]:g}{c.unit}" for c in channels.of_slave(sample.slave)
        )
        name = channels.slave_names[sample.slave]
        good = "" if sample.is_good else " NOT GOOD"
        print(f"{name} cycle {sample.cycle}{good} {values}", flush=True)
    return report_gaps(link)


def report_gaps(link: Link) -> int:
    gaps = link.gaps
    print(f"{gaps.gaps} gaps, {gaps.missing} samples missing", file=sys.stderr)
    return 0 if gaps.gaps == 0 else 1


def header(channels: Channels, slave: int) -> list[str]:
    names = [c.entry for c in channels.of_slave(slave)]
    return ["cycle", "dc_time_ns", "utc_ns", "flags", "is_good", *names]


def record_csv(link: Link, options: argparse.Namespace) -> int:
    channels = link.channels()
    options.dir.mkdir(parents=True, exist_ok=True)
    files = [(options.dir / f"{name}.csv").open("w", newline="") for name in channels.slave_names]
    try:
        writers = [csv.writer(file) for file in files]
        for slave, writer in enumerate(writers):
            writer.writerow(header(channels, slave))
        for s in link.subscribe(options.seconds):
            if s.session != channels.session:
                print("the master was restarted: the recording ends here", file=sys.stderr)
                break
            values = [
                s.raw[c.place]
                if c.scale == 1 and c.offset == 0 and c.type.startswith(("UINT", "B"))
                else s.values[c.place]
                for c in channels.of_slave(s.slave)
            ]
            writers[s.slave].writerow(
                [s.cycle, s.dc_time_ns, s.utc_ns, s.flags, int(s.is_good), *values]
            )
    finally:
        for file in files:
            file.close()
    return report_gaps(link)


def next_channels(link: Link, session: int) -> Channels:
    """The table of a session whose samples have come: it cannot be far."""
    end = time.monotonic() + 10
    while (channels := link.channels()).session != session:
        if time.monotonic() > end:
            raise LinkError(f"no channel table of session {session}")
        time.sleep(0.01)
    return channels


def record_mcap(link: Link, options: argparse.Namespace) -> int:
    from ecdaq import __version__
    from ecdaq.mcap_file import McapFile

    file = McapFile(options.dir, link.channels(), f"ecdaq-remote {__version__}")
    look_at = 0.0
    map_told = -1
    try:
        for sample in link.subscribe(options.seconds):
            if sample.session != file.session:
                print(file.close("the master was restarted"), flush=True)
                file = McapFile(options.dir, next_channels(link, sample.session), file.program)
            file.add(sample)
            if time.monotonic() < look_at:
                continue
            look_at = time.monotonic() + 0.5
            for event in link.events(0):
                file.add_event(event)
            timemap = link.timemap()
            if timemap.session == file.session and timemap.utc_ns != map_told:
                map_told = timemap.utc_ns
                file.add_timemap(timemap)
    finally:
        print(file.close("stopped"), flush=True)
    return report_gaps(link)


def record(link: Link, options: argparse.Namespace) -> int:
    """MCAP with the topics and fields of the appliance's recordings, or a CSV file for each slave,
    raw and exact where a channel has no scale."""
    if options.csv:
        return record_csv(link, options)
    try:
        return record_mcap(link, options)
    except ImportError as why:
        raise LinkError(str(why)) from why


def set_outputs(link: Link, options: argparse.Namespace) -> int:
    """Set, and hold for some seconds: without a commander, outputs with a time-out fall back."""
    values: dict[str, float] = {}
    for word in options.assignments:
        name, equals, text = word.partition("=")
        if not equals:
            print(f"ecdaq-remote: {word}: wants OUTPUT=VALUE", file=sys.stderr)
            return 2
        try:
            values[name] = float({"on": "1", "off": "0"}.get(text, text))
        except ValueError:
            print(f"ecdaq-remote: {word}: no number", file=sys.stderr)
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


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="ecdaq-remote", description="An ecdaq appliance, seen from here over DDS."
    )
    parser.add_argument("--interface", required=True, help="our network interface for DDS")
    parser.add_argument("--domain", type=int, default=0, help="as dds.domain of the appliance")
    parser.add_argument("--tag", default="", help="as dds.tag of the appliance")
    parser.add_argument("--peer", action="append", default=[], help="address of the appliance")
    parser.add_argument("--no-multicast", action="store_true")
    parser.add_argument(
        "--security", type=Path, help="folder of our keys, if the appliance wants any"
    )
    verbs = parser.add_subparsers(required=True, metavar="VERB")
    for name, function, text in (
        ("watch", watch, "show values as they come"),
        ("record", record, "to MCAP, or CSV"),
        ("set", set_outputs, "set outputs of owner remote"),
        ("status", status, "how the master is"),
    ):
        verb = verbs.add_parser(name, help=text, description=function.__doc__)
        verb.set_defaults(function=function)
        if name in ("watch", "record"):
            verb.add_argument("--seconds", type=float, default=None)
        if name == "record":
            verb.add_argument("--dir", type=Path, default=Path("."))
            verb.add_argument("--csv", action="store_true", help="a CSV file for each slave")
        if name == "set":
            verb.add_argument("assignments", nargs="+", metavar="OUTPUT=VALUE")
            verb.add_argument("--hold", type=float, default=0, metavar="SECONDS")
        if name == "status":
            verb.add_argument("--json", action="store_true")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    options = parse(arguments)
    try:
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
    except LinkError as why:
        print(f"ecdaq-remote: {why}", file=sys.stderr)
        return 1
    except BrokenPipeError:  # who read us has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


if __name__ == "__main__":
    raise SystemExit(main())
