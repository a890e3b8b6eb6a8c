# SPDX-License-Identifier: MIT
"""ecdaq-parquet: the recordings of many appliances as one partitioned Parquet dataset.

TARGET/samples/appliance=A/date=D/STEM.parquet     the recorded rows of a file, as to_arrow()
TARGET/recordings/appliance=A/date=D/STEM.parquet  one row: what the file has

D is the UTC date of the first row. Both files are written beside their place and renamed, the
second one last: a recording counts as converted only with both, and what was interrupted is done
again.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ecdaq.errors import MissingExtraError, RecordingError

if TYPE_CHECKING:
    import numpy as np

    from ecdaq.table import Table

# What may be the name of a folder, of a partition and in SQL.
APPLIANCE = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
SOURCE_KEY = b"ecdaq.source"


class DatasetError(Exception):
    """The source or the target cannot be used."""


@dataclass(frozen=True)
class Item:
    """A finished recording of an appliance."""

    appliance: str
    path: Path

    def state(self) -> str:
        """Another one when the file has changed. RecordingError: it is gone, or not ours to see."""
        try:
            stat = self.path.stat()
        except OSError as error:
            raise RecordingError(str(self.path), error.strerror or str(error)) from error
        return f"{self.path.name} {stat.st_size} {stat.st_mtime_ns}"


def size_of(state: str) -> int:
    """Bytes of the file in that state."""
    return int(state.split()[-2])


@dataclass
class Outcome:
    """What a conversion has done."""

    converted: int = 0
    converted_bytes: int = 0
    there_already: int = 0
    failures: list[str] = field(default_factory=list)


def recordings(source: Path, appliance: str | None) -> list[Item]:
    """Finished recordings below @source: of @appliance, or of each folder in it. In their order."""
    if not source.is_dir():
        raise DatasetError(f"{source}: no such folder")
    if appliance is not None:
        folders = [(appliance, source)]
    else:
        folders = [(p.name, p) for p in sorted(source.iterdir()) if p.is_dir()]
    items = []
    for name, folder in folders:
        if not APPLIANCE.fullmatch(name):
            raise DatasetError(
                f"{folder}: '{name}' is no name of an appliance: letters, digits, '.', '_', '-'"
            )
        found: dict[str, Path] = {}
        for path in sorted(folder.rglob("*.mcap")):
            if path.stem in found:
                raise DatasetError(f"{path}: {found[path.stem]} has the same name")
            found[path.stem] = path
        items += [Item(name, path) for path in found.values()]
    if not items:
        raise DatasetError(f"{source}: no finished recordings (NAME/*.mcap, or --appliance NAME)")
    return items


def converted(target: Path, appliance: str) -> dict[str, Path]:
    """The row files of an appliance by the name of the recording without suffix."""
    folder = target / "recordings" / f"appliance={appliance}"
    return {path.stem: path for path in folder.glob("date=*/*.parquet")}


def state_of(row_file: Path) -> str:
    """What the recording was when it was converted; "": not known."""
    from ecdaq.export import needed

    parquet = needed("pyarrow.parquet")
    try:
        metadata = parquet.read_schema(row_file).metadata or {}
    except (OSError, ValueError):  # cut off, say: it is made again
        return ""
    return metadata.get(SOURCE_KEY, b"").decode(errors="replace")


def write(arrow: Any, path: Path) -> None:
    """A whole file, or none. DatasetError: the target has no room, say."""
    from ecdaq.export import needed

    parquet = needed("pyarrow.parquet")
    part = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        parquet.write_table(arrow, part, compression="zstd")
        with part.open("rb") as file:
            os.fsync(file.fileno())
        part.rename(path)
    except OSError as error:  # pyarrow's has no name of a file
        why = os.strerror(error.errno) if error.errno else str(error)
        raise DatasetError(f"{path}: {why}") from error
    finally:
        with contextlib.suppress(OSError):
            part.unlink()


def row_of(item: Item, table: Table, rows: np.ndarray, state: str) -> Any:
    """The one row of a file: where it is from, and which cycles it has."""
    from ecdaq.export import needed

    pa = needed("pyarrow")
    cycles, utc = table.cycle[rows], table.utc_ns[rows]
    missing = sum(gap.count for gap in table.gaps if gap.slave == "")
    moment = pa.timestamp("ns", "UTC")
    values = [
        ("file", pa.string(), item.path.name),
        ("bytes", pa.int64(), size_of(state)),
        ("session", pa.int64(), int(table.session[rows[0]])),
        ("first_cycle", pa.int64(), int(cycles[0])),
        ("last_cycle", pa.int64(), int(cycles[-1])),
        ("cycles", pa.int64(), len(cycles)),
        ("missing_cycles", pa.int64(), missing),
        ("start", moment, int(utc.min())),
        ("end", moment, int(utc.max())),
    ]
    schema = pa.schema(
        [pa.field(name, kind) for name, kind, _ in values], metadata={SOURCE_KEY: state}
    )
    arrays = [pa.array([value], pa.int64() if kind == moment else kind).cast(kind)
              for _, kind, value in values]  # fmt: skip
    return pa.Table.from_arrays(arrays, schema=schema)


def convert(item: Item, state: str, target: Path, before: Path | None) -> int:
    """Both files of one recording; those of @before, of another date, are removed afterwards. How
    many bytes the recording has."""
    import numpy as np

    from ecdaq.aligned import recorded_rows
    from ecdaq.export import to_arrow
    from ecdaq.recording import read

    table = read(item.path).table
    rows = np.flatnonzero(recorded_rows(table))
    if len(rows) == 0:
        raise RecordingError(str(item.path), "it has no samples")
    first = np.datetime64(int(table.utc_ns[rows].min()), "ns")
    place = Path(f"appliance={item.appliance}") / f"date={first.astype('datetime64[D]')}"
    name = f"{item.path.stem}.parquet"
    samples = to_arrow(table).take(rows)
    row_file = target / "recordings" / place / name
    write(samples, target / "samples" / place / name)
    write(row_of(item, table, rows, state), row_file)
    if before is not None and before != row_file:
        before.unlink()
        (target / "samples" / before.relative_to(target / "recordings")).unlink(missing_ok=True)
    return size_of(state)


def convert_all(items: Sequence[Item], target: Path, progress: Progress) -> Outcome:
    """Those that are new or have changed; one that cannot be read does not stop the others."""
    outcome = Outcome()
    known: dict[str, dict[str, Path]] = {}
    for number, item in enumerate(items):
        progress.show(number, len(items), outcome)
        if item.appliance not in known:
            known[item.appliance] = converted(target, item.appliance)
        before = known[item.appliance].get(item.path.stem)
        try:
            state = item.state()
            if before is not None and state_of(before) == state:
                outcome.there_already += 1
                continue
            outcome.converted_bytes += convert(item, state, target, before)
            outcome.converted += 1
        except RecordingError as error:
            progress.clear()
            outcome.failures.append(str(error))
            print(f"ecdaq-parquet: {error}", file=sys.stderr)
    progress.clear()
    return outcome


class Progress:
    """One line of a terminal, with rate and time left."""

    def __init__(self) -> None:
        self.is_shown = sys.stderr.isatty()
        self.start = time.monotonic()

    def show(self, done: int, total: int, outcome: Outcome) -> None:
        spent = time.monotonic() - self.start
        if not self.is_shown or spent < 0.5 or done == 0:
            return
        left = spent / done * (total - done)
        rate = outcome.converted_bytes / spent / 1e6
        print(
            f"\r\033[K{done} of {total} recordings, {rate:.1f} MB/s, {left:.0f} s left",
            end="",
            file=sys.stderr,
            flush=True,
        )

    def clear(self) -> None:
        if self.is_shown:
            print("\r\033[K", end="", file=sys.stderr, flush=True)


@contextlib.contextmanager
def locked(target: Path) -> Iterator[None]:
    """One conversion into a target at a time."""
    import fcntl

    target.mkdir(parents=True, exist_ok=True)
    with (target / ".lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise DatasetError(f"{target}: another ecdaq-parquet writes to it") from None
        yield


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="ecdaq-parquet",
        description="Convert recordings of many appliances to one Parquet dataset, partitioned by "
        "appliance and date; what was converted before is left alone.",
        epilog="exit codes: 0 all is there, 1 a recording could not be read, 2 wrong command line",
    )
    parser.add_argument("source", type=Path, metavar="SOURCE", help="a folder for each appliance")
    parser.add_argument("target", type=Path, metavar="TARGET", help="folder of the dataset")
    parser.add_argument(
        "--appliance", metavar="NAME", help="SOURCE itself has the recordings of this one"
    )
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """Every error is one line on standard error."""
    options = parse(arguments)
    try:
        from ecdaq.export import needed

        needed("pyarrow")
        items = recordings(options.source, options.appliance)
        with locked(options.target):
            outcome = convert_all(items, options.target, Progress())
    except (DatasetError, MissingExtraError) as error:
        problem = str(error)
    except OSError as error:
        problem = f"{error.filename}: {error.strerror}" if error.filename else str(error)
    except KeyboardInterrupt:
        problem = "interrupted: what is converted stays, the next run goes on"
    else:
        appliances = len({item.appliance for item in items})
        print(
            f"{outcome.converted} recordings converted ({outcome.converted_bytes / 1e6:.1f} MB), "
            f"{outcome.there_already} were there, {len(outcome.failures)} failed; "
            f"{appliances} appliances"
        )
        return 1 if outcome.failures else 0
    print(f"ecdaq-parquet: {' '.join(problem.split())}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    raise SystemExit(main())
