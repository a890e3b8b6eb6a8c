# SPDX-License-Identifier: MIT
"""Tables in the formats of other programs, each by a package that is installed on request."""

from __future__ import annotations

import dataclasses
import importlib
import json
import os
from typing import Any

import numpy as np

from ecdaq.errors import MissingExtraError
from ecdaq.table import Column, Table

# Of each package, the extra that installs it.
EXTRAS = {
    "pandas": "pandas", "pyarrow": "arrow", "h5py": "hdf5", "nptdms": "tdms",
    "matplotlib": "plot",
}  # fmt: skip
# More points than these are drawn as the smallest and largest value of this many parts.
PLOT_PARTS = 4000


def needed(module: str) -> Any:
    """The module, or MissingExtraError that names the extra."""
    package = module.partition(".")[0]
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise MissingExtraError(package, EXTRAS[package]) from error


def gaps_json(table: Table) -> str:
    return json.dumps([dataclasses.asdict(gap) for gap in table.gaps])


def to_pandas(table: Table) -> Any:
    pd = needed("pandas")
    found: dict[str, Any] = {
        "session": table.session, "cycle": table.cycle, "dc_time_ns": table.dc_time_ns
    }  # fmt: skip
    for name, column in table.columns.items():
        kind = column.values.dtype.kind
        if kind == "f":
            found[name] = column.values
        elif kind == "b":
            found[name] = pd.arrays.BooleanArray(column.values, ~column.valid)
        else:
            found[name] = pd.arrays.IntegerArray(column.values, ~column.valid)
    index = pd.DatetimeIndex(table.utc_ns.view("M8[ns]"), name="utc").tz_localize("UTC")
    frame = pd.DataFrame(found, index=index, copy=False)
    frame.attrs["units"] = {name: c.unit for name, c in table.columns.items()}
    frame.attrs["gaps"] = len(table.gaps)
    return frame


def to_arrow(table: Table) -> Any:
    pa = needed("pyarrow")
    fields = [
        (pa.field("utc", pa.timestamp("ns", "UTC")), pa.array(table.utc_ns.view("M8[ns]"))),
        *((pa.field(n, pa.int64()), pa.array(getattr(table, n))) for n in ("session", "cycle")),
        (pa.field("dc_time_ns", pa.int64(), metadata={"unit": "ns"}), pa.array(table.dc_time_ns)),
    ]
    for name, column in table.columns.items():
        array = pa.array(column.values, mask=None if column.valid.all() else ~column.valid)
        fields.append((pa.field(name, array.type, metadata={"unit": column.unit}), array))
    schema = pa.schema([f for f, _ in fields], metadata={"ecdaq.gaps": gaps_json(table)})
    arrays = [array.cast(field.type) for field, array in fields]
    return pa.Table.from_arrays(arrays, schema=schema)


def to_parquet(table: Table, path: str | os.PathLike[str]) -> None:
    parquet = needed("pyarrow.parquet")
    parquet.write_table(to_arrow(table), os.fspath(path), compression="zstd")


def plain(column: Column) -> tuple[np.ndarray, np.ndarray | None]:
    """Values for a format without nulls: float64 with NaN where that is exact, else the integers
    and which of them are valid."""
    if column.values.dtype.itemsize == 8 and column.values.dtype.kind in "iu":
        return column.values, column.valid.astype(np.uint8)
    return column.as_float(), None


def plain_columns(table: Table) -> list[tuple[str, str, np.ndarray]]:
    """Name, unit and values of what a format without nulls and without UTC gets."""
    found = [
        ("session", "", table.session), ("cycle", "", table.cycle), ("utc_ns", "ns", table.utc_ns),
        ("dc_time_ns", "ns", table.dc_time_ns),
    ]  # fmt: skip
    for name, column in table.columns.items():
        values, valid = plain(column)
        found.append((name, column.unit, values))
        if valid is not None:
            found.append((f"{name}.valid", "", valid))
    return found


def gap_columns(table: Table) -> dict[str, np.ndarray]:
    """The gaps as columns of integers; the slave's name apart."""
    names = ("session", "first_cycle", "count", "start_utc_ns", "end_utc_ns")
    return {n: np.array([getattr(gap, n) for gap in table.gaps], np.int64) for n in names}


def to_hdf5(table: Table, path: str | os.PathLike[str]) -> None:
    h5py = needed("h5py")
    with h5py.File(os.fspath(path), "w") as file:
        for name, unit, values in plain_columns(table):
            dataset = file.create_dataset(name, data=values, compression="gzip", shuffle=True)
            dataset.attrs["units"] = unit
        gaps = file.create_group("gaps")
        for name, values in gap_columns(table).items():
            gaps.create_dataset(name, data=values)
        slaves = [gap.slave for gap in table.gaps]
        gaps.create_dataset("slave", data=slaves, dtype=h5py.string_dtype())


def to_tdms(table: Table, path: str | os.PathLike[str]) -> None:
    nptdms = needed("nptdms")
    objects = [nptdms.RootObject(properties={"gaps": len(table.gaps)})]
    objects.append(nptdms.GroupObject("ecdaq"))
    for name, unit, values in plain_columns(table):
        properties = {"unit_string": unit} if unit else {}
        objects.append(nptdms.ChannelObject("ecdaq", name, values, properties=properties))
    objects.append(nptdms.GroupObject("gaps"))
    if table.gaps:
        for name, values in gap_columns(table).items():
            objects.append(nptdms.ChannelObject("gaps", name, values))
        slaves = [gap.slave for gap in table.gaps]
        objects.append(nptdms.ChannelObject("gaps", "slave", slaves))
    with nptdms.TdmsWriter(os.fspath(path)) as writer:
        writer.write_segment(objects)


def thinned(times: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For a picture: of each part its smallest and largest value, and NaN if it has any."""
    size = len(values) // PLOT_PARTS
    if size < 4:
        return times, values
    count = len(values) // size
    parts = values[: count * size].reshape(count, size)
    is_bad = np.isnan(parts)
    low = np.where(is_bad, np.inf, parts).min(axis=1)
    high = np.where(is_bad, -np.inf, parts).max(axis=1)
    low[np.isinf(low)] = high[np.isinf(high)] = np.nan
    breaks = np.where(is_bad.any(axis=1), np.nan, high)
    start = times[: count * size : size]
    xs = np.append(np.repeat(start, 3), times[count * size :])
    return xs, np.append(np.column_stack((low, high, breaks)).ravel(), values[count * size :])


def plot(table: Table) -> Any:
    pyplot = needed("matplotlib.pyplot")
    by_unit: dict[str, list[Column]] = {}
    for column in table.columns.values():
        by_unit.setdefault(column.unit, []).append(column)
    rows = max(1, len(by_unit))
    figure, axes = pyplot.subplots(rows, sharex=True, squeeze=False, figsize=(10, 1 + 2.5 * rows))
    times = table.utc_ns.view("M8[ns]")
    for axis, (unit, columns) in zip(axes[:, 0], by_unit.items(), strict=False):
        for column in columns:
            axis.plot(*thinned(times, column.as_float()), label=column.name, linewidth=1)
        axis.set_ylabel(unit)
        axis.grid(True)
        axis.legend(loc="upper right")
    axes[-1, 0].set_xlabel("UTC")
    return figure
