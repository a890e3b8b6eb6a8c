# SPDX-License-Identifier: MIT
"""The Python kit by itself: its types are those of the IDL, and it counts gaps."""

from __future__ import annotations

import dataclasses
import itertools
import json
import re
import signal
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import ecdaq
import pandas
import pytest
from bench import PASSING_REASONS, ROOT, Bench, live, wait_for
from cyclonedds.idl import types
from ecdaq import NoAnswerError, keys, remote
from ecdaq.idl_types import TOPICS, ReplyV1, SampleV1, StatusV1
from ecdaq.link import Channel, Link, domain_config

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


def test_keys_are_used_if_present_and_supported_by_the_library(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(ecdaq.LinkError, match=r"identity_ca.cert.pem: no such file"):
        ecdaq.connect("lo", security=tmp_path)
    for name in keys.KEY_FILES:
        (tmp_path / name).touch()
    monkeypatch.setattr(keys, "plugin_folder", lambda: Path("/plugins"))
    config = keys.security_config(tmp_path)
    assert f"<PrivateKey>file:{tmp_path}/key.pem</PrivateKey>" in config
    assert 'path="/plugins/libdds_security_ac.so" initFunction="init_access_control"' in config


def test_a_library_without_security_is_reported(tmp_path: Path) -> None:
    for name in keys.KEY_FILES:
        (tmp_path / name).touch()
    with pytest.raises(ecdaq.LinkError, match="built without DDS Security"):
        ecdaq.connect("lo", security=tmp_path)


def test_names_with_markup_are_rejected() -> None:
    assert "<AllowMulticast>false<" in domain_config("lo", True, [], "")
    with pytest.raises(ValueError, match="invalid character"):
        domain_config('eth0"/><x', True, [], "")


@pytest.mark.parametrize(
    ("words", "code", "line"),
    [
        (["--interface", "nowhere0"], 5, "nowhere0: no such network interface: use one of "),
        (["--interface", "lo", "--domain", "999"], 1, "cannot join DDS domain 999: "),
        (["--interface", "lo", "--tag", "<x>"], 2, "'<x>': invalid character"),
        (["--interface", "lo", "--security", "/nowhere"], 1, "/nowhere/identity_ca.cert.pem: "),
    ],
)
def test_wrong_arguments_are_one_line_and_no_traceback(
    capsys: pytest.CaptureFixture[str], words: list[str], code: int, line: str
) -> None:
    assert remote.main([*words, "status"]) == code
    assert re.fullmatch(f"ecdaq-remote: {re.escape(line)}[^\n]*\n", capsys.readouterr().err)


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (OSError(28, "No space left on device"), 1, "No space left on device"),
        (PermissionError(13, "Permission denied", "here"), 1, "here: Permission denied"),
        (RuntimeError("of the\nlibrary"), 1, "failed: RuntimeError: of the library"),
        (KeyboardInterrupt(), 1, "interrupted before it was connected"),
        (ImportError("no mcap", name="mcap.writer"), 1, "mcap cannot be imported: pip install"),
        (NoAnswerError("no reply"), 16, "no reply"),
        (ecdaq.RefusedError("owned by local"), 17, "owned by local"),
    ],
)
def test_no_error_ends_in_a_traceback(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    error: BaseException,
    code: int,
    line: str,
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr("ecdaq.link.connect", fail)
    assert remote.main(["--interface", "lo", "status"]) == code
    assert re.fullmatch(f"ecdaq-remote: {re.escape(line)}[^\n]*\n", capsys.readouterr().err)


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["--interface", "lo"],
        ["--interface", "lo", "fly"],
        ["--interface", "lo", "--domain", "x", "status"],
        ["--interface", "lo", "watch", "--seconds", "-1"],
        ["--interface", "lo", "watch", "--seconds", "nan"],
        ["--interface", "lo", "set"],
    ],
)
def test_a_wrong_command_line_is_one_line_and_exit_code_2(
    capsys: pytest.CaptureFixture[str], words: list[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        remote.main(words)
    assert ended.value.code == 2
    assert re.fullmatch(r"ecdaq-remote: [^\n]+ --help\n", capsys.readouterr().err)


def test_raw_values_that_do_not_fit_are_a_value_error() -> None:
    with ecdaq.connect("lo", domain=230) as link:
        for value in (-1, 1 << 64):
            with pytest.raises(ValueError, match=re.escape("0 to 2**64 - 1")):
                link.send({"piccolo0.led": value}, raw=True)


def test_a_command_without_a_reply_is_repeated_with_its_id() -> None:
    sent: list[int] = []

    class Lossy(Link):
        """The first command, or its reply, is lost."""

        def __init__(self) -> None:
            pass

        def send(self, values: Mapping[str, float], **more: Any) -> int:
            sent.append(more["message_id"] or 7)
            return sent[-1]

        def replies(self, seconds: float) -> list[ReplyV1]:
            if len(sent) == 1:
                return []
            other = ReplyV1("me", 6, 1, True, 41, "")
            return [other, ReplyV1("me", sent[-1], 1, True, 42, "")]

    assert Lossy().command({"piccolo0.led": 1}) == 42
    assert sent == [7, 7]
    sent.clear()
    with pytest.raises(NoAnswerError, match="no reply within"):
        Lossy().command({"piccolo0.led": 1}, seconds=0.01)
    assert sent == [7]


def channel(kind: str, scale: float = 1) -> Channel:
    return Channel(
        name=f"piccolo0.{kind.lower()}", unit="", type=kind, slave=0, place=0, is_output=False,
        scale=scale, offset=0, owner="", timeout_s=0,
    )  # fmt: skip


def test_unscaled_integers_are_exact() -> None:
    at = 848_625_000_123_456_789
    found = sample(0, 1)
    found.raw, found.values = [at], [float(at)]
    assert channel("UINT64").value(found) == at
    assert remote.format_value(channel("UINT64").value(found)) == str(at)
    found.raw, found.values = [0xFFFE], [-2.0]
    assert channel("INT16").value(found) == -2
    assert remote.format_value(channel("INT16").value(found)) == "-2"
    found.values = [-1.25]
    assert channel("INT16", scale=0.625).value(found) == -1.25
    assert remote.format_value(channel("FLOAT32").value(found)) == "-1.25"


class FakeLink:
    """What remote.py uses of a link: samples, and the gaps in them."""

    def __init__(self, cycles: list[int]) -> None:
        self.gaps = ecdaq.Gaps()
        self.cycles = cycles

    def channels(self) -> Any:
        return SimpleNamespace(slave_names=["piccolo0"])

    def subscribe(self, seconds: float | None) -> Any:
        for cycle in self.cycles:
            found = sample(0, cycle)
            self.gaps.take(found)
            yield found


def test_report_names_the_gaps(capsys: pytest.CaptureFixture[str]) -> None:
    link: Any = FakeLink([1, 2, 5, 6, 7, 9])
    assert len(list(remote.with_progress(link, None))) == 6
    assert remote.report_gaps(link) == 1
    assert capsys.readouterr().err.splitlines() == [
        "2 gaps, 3 samples missing",
        "  piccolo0: cycles 3 to 4: 2 missing",
        "  piccolo0: cycles 8 to 8: 1 missing",
    ]
    every_second: Any = FakeLink(list(range(0, 100, 2)))
    list(remote.with_progress(every_second, None))
    assert remote.report_gaps(every_second) == 1
    assert capsys.readouterr().err.splitlines()[-1] == "  and 29 more gaps"


def test_progress_is_shown_on_a_terminal_and_only_there(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = itertools.count()
    monkeypatch.setattr(remote, "time", SimpleNamespace(monotonic=lambda: float(next(clock))))
    link: Any = FakeLink([1, 2, 4])
    list(remote.with_progress(link, 9))
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(remote.sys.stderr, "isatty", lambda: True)
    list(remote.with_progress(link, 9))
    shown = capsys.readouterr().err
    assert "\r2 of 9 s, 2 samples, " in shown
    assert shown.endswith("\r\033[K")  # the line is cleared at the end


TOOL = ("--interface", "dds1", "--domain", "7")


def run_tool(bench: Bench, name: str, *words: str) -> tuple[int, str]:
    """Exit code and output of ecdaq-remote; what only a busy machine refuses is repeated."""
    for n in range(20):  # a second each
        code = bench.module(f"{name}{n}", "ecdaq", *TOOL, *words).wait(60)
        text = bench.log(f"{name}{n}")
        if code == 0 or not any(why in text for why in PASSING_REASONS):
            return code, text
    raise AssertionError(text)


def test_remote_tool_watches_records_sets_and_shows_status(
    make_bench: Callable[..., Bench],
) -> None:
    bench = make_bench(**{"outputs[0].channel": "piccolo0.led", "outputs[0].owner": "remote"})
    bench.start_all()
    shown = {}
    for name, words, expected in (
        # On its way back to OP where the master was not run for 100 ms.
        ("status", ["status", "--json"], r'"state": "(OP|RECOVERING)"'),
        ("watch", ["watch", "--seconds", "2"], "piccolo1 cycle"),
        ("set", ["set", "piccolo0.led=on"], r"piccolo0\.led=on from cycle"),
        ("csv", ["record", "--csv", "--seconds", "2", "--dir", str(bench.folder)], "0 gaps, 0 "),
    ):
        code, shown[name] = run_tool(bench, name, *words)
        assert code == 0, bench.logs()
        assert re.search(expected, shown[name]), shown[name]
    code, refused = run_tool(bench, "refused", "set", "piccolo1.led=on")
    assert code == 17
    assert "owned by local" in refused
    # Nanoseconds since 2000, every digit.
    assert re.search(r" sample_time=\d{18}\b", shown["watch"])
    assert re.search(r"piccolo0\.csv: \d{3,} samples, [\d.]+ s, \d{4,} bytes\n", shown["csv"])
    # Without an end: it is ended as by Ctrl-C, and finishes its file.
    folder = bench.folder / "mcap"
    recorder = bench.module("mcap", "ecdaq", *TOOL, "record", "--dir", str(folder))
    wait_for("its file", lambda: folder.exists() and list(folder.iterdir()), 60)
    bench.segment.wait_for_cycles(4000, 60)
    recorder.send_signal(signal.SIGINT)
    assert recorder.wait(40) == 0, bench.logs()
    assert "0 gaps, 0 samples missing" in bench.log("mcap")
    assert re.search(
        r"/ecdaq-\S+\.mcap: \d{3,} cycles, [\d.]+ s, \d{4,} bytes\n", bench.log("mcap")
    )
    frame = pandas.read_csv(bench.folder / "piccolo0.csv")
    assert list(frame.columns)[:6] == ["cycle", "dc_time_ns", "utc_ns", "flags", "is_good", "led"]
    assert len(frame) > 200
    assert (frame["cycle"].diff().dropna() == 1).all()
    bench.segment.stop("daemon")
    assert bench.segment.stop("recorder") == 0
    equals_the_recording_of_the_appliance(bench, folder)


def equals_the_recording_of_the_appliance(bench: Bench, folder: Path) -> None:
    """`ecdaq log check` accepts it, and it equals the recording of the appliance."""
    (file,) = folder.glob("*.mcap")
    checked = bench.segment.ecdaq("log", "check", "--json", str(file))
    checked_file = json.loads(checked.stdout)
    assert checked_file["clean"] is True
    assert checked_file["cycles"] > 300
    for slave in ("piccolo0", "piccolo1"):
        topic = f"/ecdaq/{slave}"
        local = {m.cycle: fields(m) for m in live.recorded(bench.segment.record_dir, topic)}
        remote = {m.cycle: fields(m) for m in live.recorded(folder, topic)}
        assert len(remote) >= checked_file["cycles"]
        assert {cycle: local[cycle] for cycle in remote} == remote
    assert list(live.recorded(folder, "/ecdaq/timemap"))
    exported = bench.segment.ecdaq("log", "export", str(file))
    assert exported.stdout.count("\n") > 300


def fields(message: Any) -> dict[str, str]:
    """As text, in which NaN is equal to NaN. Without the stamp: UTC is mapped by the recorder here
    and by the publisher there."""
    return {name: repr(getattr(message, name)) for name in message.__slots__ if name != "header"}
