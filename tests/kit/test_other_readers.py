# SPDX-License-Identifier: MIT
"""Software that knows nothing of ecdaq reads volts from a recording."""

from __future__ import annotations

from pathlib import Path

import duckdb
import ecdaq
import numpy as np
import pandas
import pytest
from made import BIN, decoded, files, run
from rosbags.highlevel import AnyReader

CYCLES = 3000


def assert_is_the_sine(volts: list[float]) -> None:
    """0.5 V around 1 V, and nothing where a sample was not good."""
    found = np.asarray(volts, float)
    assert np.nanmax(found) == pytest.approx(1.5, abs=1e-3)
    assert np.nanmin(found) == pytest.approx(0.5, abs=1e-3)
    assert np.isnan(found).sum() == 59  # every 50th but the one in the gap


def test_the_package_mcap(sample: Path) -> None:
    (path,) = files(sample)
    assert_is_the_sine([m.adc for _, m in decoded(path)["/ecdaq/piccolo1"]])


def test_rosbags(sample: Path) -> None:
    volts = []
    with AnyReader(files(sample)) as reader:
        connections = [c for c in reader.connections if c.topic == "/ecdaq/piccolo1"]
        for connection, time_ns, raw in reader.messages(connections):
            message = reader.deserialize(raw, connection.msgtype)
            stamp = message.header.stamp
            assert stamp.sec * 10**9 + stamp.nanosec == time_ns
            volts.append(message.adc)
    assert_is_the_sine(volts)


def test_pandas_and_duckdb_on_csv(sample: Path, tmp_path: Path) -> None:
    path = tmp_path / "all.csv"
    run(BIN / "ecdaq", "log", "export", "--output", path, *files(sample))
    assert_is_the_sine(pandas.read_csv(path)["piccolo1.adc [V]"].tolist())
    rows = duckdb.sql(f"""SELECT "piccolo1.adc [V]" FROM '{path}'""").fetchall()
    assert_is_the_sine([np.nan if row[0] is None else row[0] for row in rows])


def test_duckdb_on_parquet(sample: Path, tmp_path: Path) -> None:
    path = tmp_path / "all.parquet"
    ecdaq.read(sample).to_parquet(path)
    [(low, high, count)] = duckdb.sql(
        f"""SELECT min("piccolo1.adc"), max("piccolo1.adc"), count("piccolo1.adc") FROM '{path}'"""
    ).fetchall()
    assert (low, high) == pytest.approx((0.5, 1.5), abs=1e-3)
    assert count == CYCLES - 7 - 59
