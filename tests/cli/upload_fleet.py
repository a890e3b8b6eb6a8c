# SPDX-License-Identifier: MIT
"""Recordings of many appliances through one object store to one Parquet dataset, and what is lost.

python tests/cli/upload_fleet.py [APPLIANCES [SECONDS]]

Each appliance is a ring of two slaves, written at 1 kHz, an ecdaq-record and an ecdaq-uplink; all
upload to one gofakes3 on this machine while they record. What is in the store is fetched by boto3,
checked against its manifests, converted by ecdaq-parquet and counted by DuckDB.
"""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import duckdb
from ecdaq import ROOT
from recording import Bench, wait_until
from stream_fleet import cpu_seconds
from uplink_bench import BUCKET, GoFake, Store, Uplink

KIT = ROOT / "app" / "services" / "publish" / "python"
SLAVES = 2
# Some files of each appliance, also of a short run.
SMALL_FILES = ("--set", "record.rotate_size=1MiB")


class Appliance:
    def __init__(self, folder: Path, number: int, store: Store) -> None:
        self.name = f"rig{number}"
        self.run_dir = Path(tempfile.mkdtemp(prefix="ecdaq-fleet-", dir="/dev/shm"))
        (folder / self.name).mkdir(parents=True)
        self.bench = Bench(self.run_dir, folder / self.name)
        self.uplink = Uplink(self.bench, store, uplink_appliance=self.name)

    def start(self, cycles: int) -> None:
        self.producer = self.bench.produce("--cycles", str(cycles), "--pace")
        self.recorder = self.bench.record("--once", *SMALL_FILES)
        self.uplink.start()

    def finish_recording(self) -> None:
        _, errors = self.recorder.communicate(timeout=120)
        assert self.recorder.returncode == 0, errors

    def is_uploaded(self) -> bool:
        return len(self.uplink.uploaded()) == len(self.bench.files())

    def end(self) -> None:
        self.bench.close()
        shutil.rmtree(self.run_dir)


@dataclass
class Outcome:
    """Cycles are those of all appliances."""

    wanted: int
    recorded: int  # in the dataset, each once
    doubled: int
    missing: int  # by the recordings' own numbers
    appliances: int
    files: int
    stored_bytes: int
    parquet_bytes: int
    uplink_cpu_s: float
    store_cpu_s: float
    conversion_s: float
    query_s: float


def fetch(store: Store, folder: Path) -> tuple[int, int]:
    """Each recording to the folder of its appliance, compared with its manifest: files, bytes."""
    count = size = 0
    pages = store.client().get_paginator("list_objects_v2").paginate(Bucket=BUCKET)
    for key in [o["Key"] for page in pages for o in page.get("Contents", [])]:
        if key.endswith(".json"):
            continue
        data, manifest = store.get(key), store.manifest(key)
        assert manifest["sha256"] == hashlib.sha256(data).hexdigest(), key
        *_, appliance, name = key.split("/")
        assert manifest["appliance"] == appliance
        (folder / appliance).mkdir(parents=True, exist_ok=True)
        (folder / appliance / name).write_bytes(data)
        count, size = count + 1, size + len(data)
    return count, size


def counted(lake: Path) -> tuple[int, int, int, int]:
    """Appliances, cycles, cycles that are there more than once, and missing ones."""
    samples = f"read_parquet('{lake}/samples/*/*/*.parquet', hive_partitioning=true)"
    files = f"read_parquet('{lake}/recordings/*/*/*.parquet', hive_partitioning=true)"
    appliances, rows, cycles = duckdb.sql(
        f"""select count(distinct appliance), sum(n)::bigint, count(*)
            from (select appliance, session, cycle, count(*) as n from {samples} group by all)"""
    ).fetchall()[0]
    (missing,) = duckdb.sql(
        f"""select sum(last - first + 1 - cycles)::bigint
            from (select min(first_cycle) as first, max(last_cycle) as last,
                         sum(cycles) as cycles
                  from {files} group by appliance, session)"""
    ).fetchall()[0]
    return appliances, cycles, rows - cycles, missing


def convert(fleet: Path, lake: Path) -> None:
    words = [
        sys.executable,
        "-c",
        "import sys; from ecdaq import dataset; sys.exit(dataset.main())",
    ]
    done = subprocess.run(
        [*words, fleet, lake], env={"PYTHONPATH": str(KIT)}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def run(scratch: Path, count: int, seconds: int) -> Outcome:
    """Record, upload, fetch, convert and count."""
    store = GoFake(scratch / "store")
    fleet = [Appliance(scratch / "recorded", number, store) for number in range(count)]
    try:
        for appliance in fleet:
            appliance.start(seconds * 1000)
        for appliance in fleet:
            appliance.finish_recording()
        wait_until("all uploads", lambda: all(a.is_uploaded() for a in fleet), 300)
        uplinks = [appliance.uplink.process for appliance in fleet]
        uplink_cpu_s = sum(cpu_seconds(process) for process in uplinks if process is not None)
        assert store.process is not None
        store_cpu_s = cpu_seconds(store.process)
        for appliance in fleet:
            appliance.uplink.stop()
        files, size = fetch(store, scratch / "fetched")
    finally:
        for appliance in fleet:
            appliance.end()
        store.kill()
    started = time.perf_counter()
    convert(scratch / "fetched", scratch / "lake")
    converted = time.perf_counter()
    appliances, cycles, doubled, missing = counted(scratch / "lake")
    return Outcome(
        wanted=count * seconds * 1000, recorded=cycles, doubled=doubled, missing=missing,
        appliances=appliances, files=files, stored_bytes=size,
        parquet_bytes=sum(p.stat().st_size for p in (scratch / "lake").rglob("*.parquet")),
        uplink_cpu_s=uplink_cpu_s, store_cpu_s=store_cpu_s, conversion_s=converted - started,
        query_s=time.perf_counter() - converted,
    )  # fmt: skip


def main(count: int, seconds: int) -> None:
    with tempfile.TemporaryDirectory(prefix="ecdaq-upload-fleet-") as scratch:
        found = run(Path(scratch), count, seconds)
    hours = count * seconds / 3600
    print(f"{count} appliances of {SLAVES} slaves, {seconds * 1000} cycles each, at 1 kHz, into one"
          " gofakes3")  # fmt: skip
    print(f"{found.files} recordings of {found.appliances} appliances fetched, each as its manifest"
          " says")  # fmt: skip
    lost = found.wanted - found.recorded
    print(f"cycles lost {lost}, doubled {found.doubled}, missing in the recordings {found.missing},"
          f" of {found.wanted}")  # fmt: skip
    cycles = found.wanted
    print(f"bytes of a cycle in the store     {found.stored_bytes / cycles:9.1f}")
    print(f"bytes of a cycle as Parquet       {found.parquet_bytes / cycles:9.1f}")
    print(f"an appliance hour: ecdaq-uplink   {found.uplink_cpu_s / hours:9.2f} s of CPU")
    print(f"                   gofakes3       {found.store_cpu_s / hours:9.2f} s of CPU")
    print(f"                   ecdaq-parquet  {found.conversion_s / hours:9.2f} s")
    print(f"one query over all                {found.query_s:9.2f} s")
    assert (lost, found.doubled, found.missing) == (0, 0, 0)


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:]]
    main(*(numbers + [50, 20][len(numbers) :]))
