# SPDX-License-Identifier: MIT
"""Recordings in the formats of other programs, read back by these."""

from __future__ import annotations

import json
from pathlib import Path

import ecdaq
import h5py
import matplotlib
import nptdms
import numpy as np
import pyarrow.parquet
import pytest
from ecdaq.export import thinned
from ecdaq.recording import Recording

matplotlib.use("Agg")


@pytest.fixture(scope="module")
def recording(sample: Path) -> Recording:
    return ecdaq.read(sample)


def test_parquet_has_values_units_nulls_and_gaps(recording: Recording, tmp_path: Path) -> None:
    path = tmp_path / "x.parquet"
    recording.to_parquet(path)
    table = pyarrow.parquet.read_table(path)
    assert table.schema.field("piccolo0.adc").metadata == {b"unit": b"V"}
    assert table.schema.field("piccolo1.led").type == "bool"
    assert table.schema.field("piccolo0.counter").type == "uint16"
    gaps = json.loads(table.schema.metadata[b"ecdaq.gaps"])
    assert [(g["first_cycle"], g["count"]) for g in gaps] == [(300, 7)]
    frame = recording.to_pandas()
    assert table["utc"].to_pandas().astype("int64").tolist() == frame.index.asi8.tolist()
    for name, column in recording.table.columns.items():
        found = table[name]
        assert found.null_count == int((~column.valid).sum())
        assert found.is_valid().to_pylist() == column.valid.tolist()
        assert found.drop_null().to_pylist() == column.values[column.valid].tolist()


def test_hdf5_has_values_units_and_gaps(recording: Recording, tmp_path: Path) -> None:
    path = tmp_path / "x.h5"
    recording.to_hdf5(path)
    table = recording.table
    with h5py.File(path) as file:
        assert file["piccolo0.adc"].attrs["units"] == "V"
        assert file["utc_ns"][:].tolist() == table.utc_ns.tolist()
        assert file["gaps/first_cycle"][:].tolist() == [300]
        assert file["gaps/slave"].asstr()[:].tolist() == [""]
        for name, column in table.columns.items():
            if name.endswith("sample_time"):
                assert file[name][:].tolist() == column.values.tolist()
                assert file[f"{name}.valid"][:].tolist() == column.valid.tolist()
            else:
                assert np.array_equal(file[name][:], column.as_float(), equal_nan=True)


def test_tdms_has_values_units_and_gaps(recording: Recording, tmp_path: Path) -> None:
    path = tmp_path / "x.tdms"
    recording.to_tdms(path)
    table = recording.table
    file = nptdms.TdmsFile.read(path)
    assert file["ecdaq"]["piccolo0.adc"].properties["unit_string"] == "V"
    assert file["ecdaq"]["cycle"][:].tolist() == table.cycle.tolist()
    assert file["gaps"]["count"][:].tolist() == [7]
    for name, column in table.columns.items():
        if name.endswith("sample_time"):
            assert file["ecdaq"][name][:].tolist() == column.values.tolist()
        else:
            assert np.array_equal(file["ecdaq"][name][:], column.as_float(), equal_nan=True)


def test_a_plot_has_one_axes_for_each_unit_and_a_break_at_the_gap(recording: Recording) -> None:
    figure = recording.select("*.adc").plot()
    (axis,) = figure.axes
    assert axis.get_ylabel() == "V"
    assert [line.get_label() for line in axis.lines] == ["piccolo0.adc", "piccolo1.adc"]
    assert np.flatnonzero(np.isnan(axis.lines[0].get_ydata())).tolist() == list(range(300, 307))
    assert len(recording.plot().axes) == 2


def test_a_thinned_curve_keeps_extremes_and_gaps() -> None:
    values = np.sin(np.arange(1_000_003) / 1e4)
    values[123_456] = 7
    values[500_000] = np.nan
    x, y = thinned(np.arange(len(values)), values)
    assert len(y) < 20_000
    assert len(x) == len(y)
    assert np.nanmax(y) == 7
    assert 499_000 < x[np.flatnonzero(np.isnan(y))[0]] <= 500_000
