# SPDX-License-Identifier: MIT
"""The Python kit by itself: its types are those of the IDL, its counting is right."""

from __future__ import annotations

import dataclasses
import json
import re
import signal
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import ecdaq
import pandas
import pytest
from bench import ROOT, Bench, live, wait_for
from cyclonedds.idl import types
from ecdaq import keys
from ecdaq.idl_types import TOPICS, SampleV1, StatusV1
from ecdaq.link import domain_config

IDL = (ROOT / "app" / "services" / "publish" / "idl" / "ecdaq.idl").read_text()


def test_types_are_final_and_flat() -> None:
    text = re.sub(r"//.*", "", IDL)
    assert text.count("struct") == text.count("@final struct") == len(TOPICS)
    assert not re.search(r"\b(octet|u?int8|char|enum|typedef|optional|union|map)\b", text)


def test_types_have_the_names_members_and_keys_of_the_idl() -> None:
    """Spot checks of what is generated; a wrong type would not be matched by the C side."""
    for kind in TOPICS:
        assert kind.__idl__.idl_transformed_typename == f"ecdaq::{kind.__name__}"
        declared = re.search(rf"struct {kind.__name__} {{(.*?)}};", IDL, re.DOTALL)
        assert declared
        lines = re.findall(r"^ *(@key )?[a-z<> ]+ (\w+);", declared[1], re.MULTILINE)
        assert [name for _, name in lines] == [f.name for f in dataclasses.fields(kind)]
        key_names = {name for is_key, name in lines if is_key}
        assert set(kind.__idl_field_annotations__) == key_names
    assert SampleV1.__annotations__["raw"] == types.sequence[types.uint64]
    assert SampleV1.__annotations__["is_good"] is bool
    assert StatusV1.__annotations__["dc_diff_max_ns"] == types.int64


def sample(slave: int, cycle: int, session: int = 1) -> Any:
    return SimpleNamespace(
        slave=slave, session=session, cycle=cycle, dc_time_ns=cycle, utc_ns=cycle, flags=0,
        is_good=True, adc=1.5, counter=cycle, sample_time_ns=0, values=[0.5], raw=[7],
    )  # fmt: skip


def test_gaps_are_counted_for_each_slave_and_session() -> None:
    gaps = ecdaq.Gaps()
    missing = [gaps.take(sample(*s)) for s in ((0, 5), (1, 9), (0, 6), (1, 12), (0, 6), (0, 1, 2))]
    assert missing == [0, 0, 0, 2, 0, 0]
    assert (gaps.gaps, gaps.missing, gaps.doubled, gaps.spans) == (1, 2, 1, [(1, 10, 2)])


def test_series_of_one_slave_becomes_columns() -> None:
    series = ecdaq.Series(1)
    series.extend([sample(0, 1), sample(1, 1), sample(1, 2)])
    assert series.to_numpy()["cycle"].tolist() == [1, 2]
    frame = series.to_pandas()
    assert frame["cycle"].tolist() == [1, 2]
    assert frame.index[1] == pandas.Timestamp(2, unit="ns", tz="UTC")


def test_keys_are_used_where_they_are_there_and_the_library_can(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(ecdaq.LinkError, match=r"identity_ca.cert.pem: not there"):
        ecdaq.connect("lo", security=tmp_path)
    for name in keys.KEY_FILES:
        (tmp_path / name).touch()
    monkeypatch.setattr(keys, "plugin_folder", lambda: Path("/plugins"))
    config = keys.security_config(tmp_path)
    assert f"<PrivateKey>file:{tmp_path}/key.pem</PrivateKey>" in config
    assert 'path="/plugins/libdds_security_ac.so" initFunction="init_access_control"' in config


def test_a_library_without_security_is_said(tmp_path: Path) -> None:
    for name in keys.KEY_FILES:
        (tmp_path / name).touch()
    with pytest.raises(ecdaq.LinkError, match="built without DDS Security"):
        ecdaq.connect("lo", security=tmp_path)


def test_configuration_takes_no_markup() -> None:
    assert "<AllowMulticast>false<" in domain_config("lo", True, [], "")
    with pytest.raises(ValueError, match="is no name"):
        domain_config('eth0"/><x', True, [], "")


def test_remote_tool_watches_records_sets_and_tells_status(
    make_bench: Callable[..., Bench],
) -> None:
    bench = make_bench(**{"outputs[0].channel": "piccolo0.led", "outputs[0].owner": "remote"})
    bench.start_all()
    tool = ["--interface", "dds1", "--domain", "7"]
    for name, words, expected in (
        ("status", ["status", "--json"], '"state": "OP"'),
        ("watch", ["watch", "--seconds", "2"], "piccolo1 cycle"),
        ("set", ["set", "piccolo0.led=on"], "piccolo0.led=on from cycle"),
        ("csv", ["record", "--csv", "--seconds", "2", "--dir", str(bench.folder)], "0 gaps, 0 "),
    ):
        assert bench.module(name, "ecdaq", *tool, *words).wait(40) == 0, bench.logs()
        assert expected in bench.log(name)
    assert bench.module("refused", "ecdaq", *tool, "set", "piccolo1.led=on").wait(40) == 1
    assert "owned by local" in bench.log("refused")
    # Without an end: it is ended as by Ctrl-C, and finishes its file.
    folder = bench.folder / "mcap"
    recorder = bench.module("mcap", "ecdaq", *tool, "record", "--dir", str(folder))
    wait_for("its file", lambda: folder.exists() and list(folder.iterdir()), 60)
    bench.segment.wait_for_cycles(4000, 60)
    recorder.send_signal(signal.SIGINT)
    assert recorder.wait(40) == 0, bench.logs()
    assert "0 gaps, 0 samples missing" in bench.log("mcap")
    frame = pandas.read_csv(bench.folder / "piccolo0.csv")
    assert list(frame.columns)[:6] == ["cycle", "dc_time_ns", "utc_ns", "flags", "is_good", "led"]
    assert len(frame) > 200
    assert (frame["cycle"].diff().dropna() == 1).all()
    bench.segment.stop("daemon")
    assert bench.segment.stop("recorder") == 0
    equals_the_appliances(bench, folder)


def equals_the_appliances(bench: Bench, folder: Path) -> None:
    """`ecdaq log check` takes it, and it says the same as what was recorded on the appliance."""
    (file,) = folder.glob("*.mcap")
    checked = bench.segment.ecdaq("log", "check", "--json", str(file))
    told = json.loads(checked.stdout)
    assert told["clean"] is True
    assert told["cycles"] > 300
    for slave in ("piccolo0", "piccolo1"):
        topic = f"/ecdaq/{slave}"
        local = {m.cycle: fields(m) for m in live.recorded(bench.segment.record_dir, topic)}
        remote = {m.cycle: fields(m) for m in live.recorded(folder, topic)}
        assert len(remote) >= told["cycles"]
        assert {cycle: local[cycle] for cycle in remote} == remote
    assert list(live.recorded(folder, "/ecdaq/timemap"))
    exported = bench.segment.ecdaq("log", "export", str(file))
    assert exported.stdout.count("\n") > 300


def fields(message: Any) -> dict[str, Any]:
    return {name: getattr(message, name) for name in message.__slots__}
