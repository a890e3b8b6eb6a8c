# SPDX-License-Identifier: MIT
"""Build the recipes of layers/ and recipes/ on this machine: what BitBake with Isar would do,
with nothing but Debian and PyPI. Called by build-image.sh."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from execute import BuildError, Executor
from graph import Graph, Task
from metadata import Metadata, MetadataError

TOP = Path(__file__).resolve().parents[3]


def parse_arguments(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="bake")
    parser.add_argument("--machine", default="ecdaq-qemuarm64")
    parser.add_argument("--cache", type=Path, required=True)
    parser.add_argument("--build", type=Path, required=True)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--task", default="do_build")
    parser.add_argument("--dry-run", action="store_true")
    parser.add_argument("--keyring", type=Path)
    parser.add_argument("recipe")
    return parser.parse_args(arguments)


def settings(options: argparse.Namespace) -> dict[str, str]:
    """local.conf: what differs from one build to the next."""
    return {
        "MACHINE": options.machine,
        "DISTRO": "ecdaq",
        "TMPDIR": str(options.cache.resolve()),
        "DEPLOY_DIR_IMAGE": str(options.build.resolve() / options.machine),
        "ECDAQ_TOP": str(TOP),
        "ECDAQ_UPDATE_KEYRING": str(options.keyring.resolve()) if options.keyring else "",
    }


def bake(options: argparse.Namespace) -> int:
    started = time.monotonic()
    options.build.mkdir(parents=True, exist_ok=True)
    options.cache.mkdir(parents=True, exist_ok=True)
    graph = Graph(Metadata(TOP, options.build, settings(options)))
    wanted = Task(options.recipe, options.task)
    if wanted.recipe not in graph.metadata.recipes:
        raise MetadataError(f"no recipe '{options.recipe}'")
    if wanted.name not in graph.recipe(wanted).tasks:
        raise MetadataError(f"{options.recipe} has no task {options.task}")
    executor = Executor(graph, options.cache, options.jobs)
    if options.dry_run:
        for task in executor.plan(wanted):
            print(f"{task}\t{graph.hash(task)[:24]}")
        return 0
    ran = executor.run(wanted)
    print(f"-- {options.recipe}: {ran} tasks, {time.monotonic() - started:.0f} s", flush=True)
    return 0


def main(arguments: Sequence[str]) -> int:
    try:
        return bake(parse_arguments(arguments))
    except (MetadataError, BuildError) as error:
        print(f"build.sh: image: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
