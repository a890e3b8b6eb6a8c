# SPDX-License-Identifier: MIT
"""ecdaq-uplink: every finished recording is in the store once and verified, whatever fails."""

from __future__ import annotations

import datetime
import hashlib
import json
import os
import random
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pyarrow.parquet
import pytest
import upload_fleet
from ecdaq import CONFIG, ECDAQ, OK, ROOT, Fake, ecdaq
from recording import Bench, wait_until
from uplink_bench import (
    BUCKET,
    PART,
    UPLINK,
    GoFake,
    Link,
    Moto,
    Store,
    Uplink,
    expect_uploaded,
    pass_time,
    record_large,
    record_small,
    stores,
)


@pytest.fixture(autouse=True)
def needed() -> None:
    if not UPLINK.exists():
        pytest.skip("ecdaq-uplink is not built: it requires libcurl4-openssl-dev")


@pytest.fixture
def moto(tmp_path: Path) -> Iterator[Store]:
    yield from stores(tmp_path, Moto)


@pytest.fixture
def gofake(tmp_path: Path) -> Iterator[Store]:
    yield from stores(tmp_path, GoFake)


@pytest.fixture(params=["moto", "gofake"])
def store(request: pytest.FixtureRequest) -> Store:
    found: Store = request.getfixturevalue(request.param)
    return found


def lines(errors: str) -> list[str]:
    return [line.removeprefix("ecdaq-uplink: ") for line in errors.splitlines()]


def test_each_recording_is_there_once_byte_by_byte_with_its_manifest(
    bench: Bench, store: Store
) -> None:
    paths = [*record_small(bench, 3), record_large(bench)]
    (bench.folder / "ecdaq-20260101T000000Z-0000000a-000099.part").write_bytes(b"being recorded")
    uplink = Uplink(bench, store)
    assert uplink.finish() == ""
    expect_uploaded(uplink, paths)
    assert {store.manifest(uplink.key(p))["state"] for p in paths} == {"clean"}
    # Again: nothing is sent; also where the marks are lost, as with another disk.
    assert uplink.finish() == ""
    shutil.rmtree(uplink.marks)
    assert uplink.finish() == ""
    expect_uploaded(uplink, paths)
    if isinstance(store, Moto):
        assert [store.versions(uplink.key(p)) for p in paths] == [1] * 4


def test_a_killed_service_goes_on_with_the_parts_that_the_store_has(
    bench: Bench, store: Store
) -> None:
    seed = int(os.environ.get("ECDAQ_SEED", "1"))
    kills = int(os.environ.get("ECDAQ_UPLINK_KILLS", "8"))
    chance = random.Random(seed)
    paths = [*record_small(bench, 2), record_large(bench)]
    link = Link(store.port)
    uplink = Uplink(bench, store, link.port, uplink_rate_limit="12MiB")
    for _ in range(kills):
        uplink.start()
        pass_time(chance.random() * 1.2)
        uplink.kill()
    uplink.finish()
    expect_uploaded(uplink, paths)
    count = -(-paths[-1].stat().st_size // PART)
    print(f"{count} parts, {link.parts()} begun, {kills} kills")
    # What a kill may cost is the part that was on its way.
    assert count <= link.parts() <= count + kills
    if isinstance(store, Moto):
        assert store.versions(uplink.key(paths[-1])) == 1


def test_a_store_that_is_killed_and_started_again_has_all_of_them(
    bench: Bench, gofake: Store
) -> None:
    chance = random.Random(int(os.environ.get("ECDAQ_SEED", "1")))
    kills = int(os.environ.get("ECDAQ_UPLINK_KILLS", "5"))
    paths = [*record_small(bench, 2), record_large(bench), *record_small(bench)]
    uplink = Uplink(bench, gofake, uplink_rate_limit="12MiB")
    uplink.start()
    for _ in range(kills):
        pass_time(chance.random() * 2)
        gofake.kill()
        pass_time(chance.random())
        gofake.start()
    wait_until("all recordings", lambda: len(uplink.uploaded()) == len(paths))
    errors = lines(uplink.stop())
    expect_uploaded(uplink, paths)
    # One line where it fails and one when it is over.
    assert len(errors) <= 4 * kills, errors


def test_a_link_that_is_down_is_one_line_however_long_it_is(bench: Bench, moto: Store) -> None:
    paths = record_small(bench, 2)
    link = Link(moto.port)
    link.cut()
    uplink = Uplink(bench, moto, link.port)
    uplink.start()
    uplink.wait_message("Couldn't connect to server")
    pass_time(4)
    link.restore()
    wait_until("both recordings", lambda: len(uplink.uploaded()) == 2)
    link.cut()
    paths += record_small(bench)
    uplink.wait_message("Couldn't connect to server", 2)
    link.restore()
    wait_until("the third one", lambda: len(uplink.uploaded()) == 3)
    endpoint = f"http://127.0.0.1:{link.port}"
    down = f"{endpoint}/{BUCKET}: Couldn't connect to server"
    assert lines(uplink.stop()) == [down, f"{endpoint}: bucket {BUCKET}: uploading"] * 2
    expect_uploaded(uplink, paths)


def test_metrics_say_what_waits_since_when_and_whether_it_fails(bench: Bench, moto: Store) -> None:
    def metrics() -> dict[str, float]:
        words = [ECDAQ, "metrics", "--run-dir", str(bench.run_dir)]
        text = subprocess.run(words, capture_output=True, text=True, check=True).stdout
        found = (line.rpartition(" ") for line in text.splitlines() if "ecdaq_uplink_" in line)
        return {name: float(value) for name, _, value in found if not name.startswith("#")}

    paths = record_small(bench, 2)
    begun = datetime.datetime.strptime(paths[0].name[6:22], "%Y%m%dT%H%M%SZ")
    link = Link(moto.port)
    link.cut()
    uplink = Uplink(bench, moto, link.port)
    uplink.start()
    uplink.wait_message("Couldn't connect to server")
    state = 'ecdaq_uplink_state{{state="{}"}}'.format
    wait_until("a failure", lambda: metrics().get(state("retrying")) == 1)
    found = metrics()
    assert (
        found["ecdaq_uplink_waiting_timestamp_seconds"]
        == begun.replace(tzinfo=datetime.UTC).timestamp()
    )
    assert found["ecdaq_uplink_waiting_recordings"] == 2
    assert found["ecdaq_uplink_failures_total"] >= 1
    link.restore()
    wait_until("all recordings", lambda: metrics()["ecdaq_uplink_waiting_recordings"] == 0)
    wait_until("it is idle", lambda: metrics()[state("idle")] == 1)
    found = metrics()
    assert found["ecdaq_uplink_waiting_timestamp_seconds"] == 0
    assert (found[state("retrying")], found["ecdaq_uplink_recordings_total"]) == (0, 2)
    uplink.stop()


def test_wrong_credentials_are_one_line_and_renewed_ones_are_used(
    bench: Bench, moto: Store
) -> None:
    paths = record_small(bench, 2)
    uplink = Uplink(bench, moto)
    uplink.give_credentials(moto.access, "wrong")
    uplink.start()
    uplink.wait_message("secret key is wrong")
    assert moto.keys() == []
    uplink.give_credentials("AKIAUNKNOWN", moto.secret)
    uplink.wait_message("access key unknown")
    uplink.give_credentials(moto.access, moto.secret)
    wait_until("both recordings", lambda: len(uplink.uploaded()) == 2)
    base = f"http://127.0.0.1:{moto.port}"
    assert lines(uplink.stop()) == [
        f"{base}/{BUCKET}: secret key is wrong: check uplink.credentials",
        f"{base}/{BUCKET}: access key unknown to the store: check uplink.credentials",
        f"{base}: bucket {BUCKET}: uploading",
    ]
    expect_uploaded(uplink, paths)


def test_a_clock_that_is_not_set_is_one_line_and_nothing_is_lost(
    bench: Bench, gofake: Store
) -> None:
    """The store sees a request of an hour ago; it is its own judgement."""
    paths = record_small(bench, 2)
    link = Link(gofake.port)

    def shift(data: bytes) -> bytes:
        def earlier(found: re.Match[bytes]) -> bytes:
            hour = int(found[2])
            return found[1] + b"%02d" % ((hour + 22) % 24) + found[3]

        return re.sub(rb"(?i)(x-amz-date: \d{8}T)(\d\d)(\d{4}Z)", earlier, data)

    link.change = shift
    uplink = Uplink(bench, gofake, link.port)
    uplink.start()
    uplink.wait_message("the clock of this machine differs")
    assert gofake.keys() == []
    link.change = lambda data: data
    wait_until("both recordings", lambda: len(uplink.uploaded()) == 2)
    base = f"http://127.0.0.1:{link.port}"
    assert lines(uplink.stop()) == [
        f"{base}/{BUCKET}: the clock of this machine differs from the store's: set it",
        f"{base}: bucket {BUCKET}: uploading",
    ]
    expect_uploaded(uplink, paths)


def test_what_is_damaged_on_its_way_is_sent_again(bench: Bench, gofake: Store) -> None:
    paths = [record_large(bench), *record_small(bench)]
    link = Link(gofake.port)
    damaged = []

    def damage(data: bytes) -> bytes:
        is_content = len(data) > 1000 and not data.startswith(b"PUT ")
        if is_content and len(damaged) < 2 and link.parts() > len(damaged):
            damaged.append(link.parts())
            return data[:500] + bytes([data[500] ^ 1]) + data[501:]
        return data

    link.change = damage
    uplink = Uplink(bench, gofake, link.port)
    errors = lines(uplink.finish())
    assert len(damaged) == 2
    assert f"http://127.0.0.1:{link.port}/{BUCKET}: HTTP status 400, BadDigest" in errors
    expect_uploaded(uplink, paths)


def test_a_recording_that_is_deleted_meanwhile_leaves_nothing_in_the_store(
    bench: Bench, store: Store
) -> None:
    large, small = record_large(bench), record_small(bench)
    uplink = Uplink(bench, store, uplink_rate_limit="2MiB")
    uplink.start()
    wait_until("a part", lambda: store.unfinished() != [])
    large.unlink()
    wait_until("the other one", lambda: uplink.uploaded() == [small[0].name])
    assert lines(uplink.stop()) == [f"{large.name}: deleted before it was uploaded"]
    expect_uploaded(uplink, small)


def test_marks_of_recordings_that_are_deleted_go(bench: Bench, moto: Store) -> None:
    paths = record_small(bench, 2)
    uplink = Uplink(bench, moto)
    uplink.finish()
    paths[0].unlink()
    uplink.start()
    wait_until("no mark of it", lambda: uplink.uploaded() == [paths[1].name])
    assert uplink.stop() == ""
    assert len(moto.keys()) == 4  # the store keeps it


def test_another_recording_of_the_same_name_is_kept_beside_it(bench: Bench, store: Store) -> None:
    [path] = record_small(bench)
    uplink = Uplink(bench, store)
    store.client().put_object(Bucket=BUCKET, Key=uplink.key(path), Body=b"another one")
    [line] = lines(uplink.finish())
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    key = uplink.key(path).removesuffix(".mcap") + f"-{digest[:8]}.mcap"
    assert line == (f"{path.name}: the store has another recording of this name: uploaded as {key}")
    assert store.get(uplink.key(path)) == b"another one"
    assert store.get(key) == path.read_bytes()
    assert store.manifest(key)["file"] == path.name
    shutil.rmtree(uplink.marks)
    assert uplink.finish() == ""
    assert store.keys() == sorted([uplink.key(path), key, key + ".json"])


def test_the_manifest_tells_a_recovered_recording(bench: Bench, moto: Store) -> None:
    producer = bench.produce("--cycles", "2000", "--pace", "--wait")
    recorder = bench.record()
    wait_until("chunks", lambda: bench.recorded_bytes() > 20000)
    recorder.kill()
    producer.kill()
    recorder.communicate()
    recorder = bench.record()
    wait_until("a recovered file", lambda: len(bench.files()) > 0)
    recorder.kill()
    uplink = Uplink(bench, moto)
    uplink.finish()
    assert moto.manifest(uplink.key(bench.files()[0]))["state"] == "recovered"


def test_what_is_no_recording_holds_up_no_other(bench: Bench, moto: Store) -> None:
    bad = bench.folder / "ecdaq-19700101T000000Z-00000000-000000.mcap"
    bad.write_bytes(b"no recording at all")
    paths = record_small(bench, 2)
    uplink = Uplink(bench, moto)
    uplink.start()
    wait_until("both recordings", lambda: len(uplink.uploaded()) == 2)
    assert lines(uplink.stop()) == [f"{bad.name}: not a recording"]
    expect_uploaded(uplink, paths)


def test_a_bucket_that_is_not_there_is_said(bench: Bench, gofake: Store) -> None:
    record_small(bench)
    uplink = Uplink(bench, gofake, uplink_bucket="elsewhere")
    uplink.start()
    uplink.wait_message("bucket does not exist")
    base = f"http://127.0.0.1:{gofake.port}/elsewhere"
    assert lines(uplink.stop()) == [
        f"{base}: bucket does not exist: create it, or check uplink.bucket"
    ]


def test_the_budget_deletes_what_is_uploaded_first(bench: Bench, moto: Store) -> None:
    paths = record_small(bench, 4, 4000)
    uplink = Uplink(bench, moto)
    for path in paths[:2]:  # not there yet: the two others are uploaded
        path.rename(path.with_suffix(".hidden"))
    uplink.finish()
    for path in paths[:2]:
        path.with_suffix(".hidden").rename(path)
    size = sum(p.stat().st_size for p in paths)
    producer = bench.produce("--cycles", "4000")
    producer.communicate("", timeout=60)
    options = ("--set", "record.rotate_size=64KiB", "--set", f"record.budget={size}B")
    bench.record_all(*uplink.words, *options)
    left = [p.name for p in bench.files()]
    assert paths[0].name in left and paths[1].name in left
    assert paths[2].name not in left


def test_what_is_fetched_is_what_ecdaq_parquet_reads(
    bench: Bench, moto: Store, tmp_path: Path
) -> None:
    record_small(bench, 2)
    Uplink(bench, moto).finish()
    keys = moto.keys()
    for key in keys:
        path = tmp_path / "fleet" / Path(key).relative_to("plant/a")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(moto.get(key))
    done = subprocess.run(
        [sys.executable, "-m", "ecdaq.dataset", "fleet", "lake"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT / "app/services/publish/python")},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == OK, done.stderr
    rows = list((tmp_path / "lake/samples/appliance=rig1").glob("date=*/*.parquet"))
    assert sum(pyarrow.parquet.read_metadata(p).num_rows for p in rows) == 1000


def test_status_and_metrics_have_the_uplink(daemon: Fake, bench: Bench, moto: Store) -> None:
    assert daemon is not None
    paths = record_small(bench, 2)
    assert json.loads(ecdaq(bench.run_dir, "status", "--json").stdout)["uplink"] is None
    uplink = Uplink(bench, moto)
    uplink.start()
    wait_until("both recordings", lambda: uplink.uploaded() == [p.name for p in paths])
    size = sum(p.stat().st_size for p in paths)
    wait_until("its figures", lambda: uplink.status()["uploaded"] == 2)
    found = uplink.status()
    assert found["running"] and found["state"] == "idle" and found["message"] == ""
    assert (found["uploaded_bytes"], found["waiting"], found["file"]) == (size, 0, "")
    assert (found["bucket"], found["appliance"]) == (BUCKET, "rig1")
    text = ecdaq(bench.run_dir, "status").stdout
    assert re.search(rf"^uplink +idle, as rig1 in {BUCKET} at http://\S+ +2 uploaded", text, re.M)
    metrics = ecdaq(bench.run_dir, "metrics").stdout
    assert "\necdaq_uplink_recordings_total 2\n" in metrics
    assert '\necdaq_service_up{service="uplink"} 1\n' in metrics
    uplink.stop()


def test_options_that_cannot_be_used_are_one_line(bench: Bench, moto: Store) -> None:
    uplink = Uplink(bench, moto)
    assert uplink.run("--check").returncode == OK
    assert not uplink.marks.exists()
    for option, value, expected in (
        ("endpoint", "", "uplink.endpoint: is required while uplink.enable is on"),
        ("endpoint", "ftp://a", "expected https://HOST or http://HOST"),
        ("endpoint", "http://a/b", "expected https://HOST or http://HOST"),
        ("bucket", "", "uplink.bucket: is required while uplink.enable is on"),
        ("bucket", "a/b", "uplink.bucket: must be letters"),
        ("prefix", "/a", "uplink.prefix: must be"),
        ("prefix", "a b", "uplink.prefix: must be"),
        ("appliance", "a.b", "uplink.appliance: must be"),
        ("credentials", "", "uplink.credentials: is required"),
        ("credentials", "/no/such/file", "uplink.credentials: /no/such/file: No such file"),
        ("ca", "/no/such/file", "uplink.ca: /no/such/file: No such file"),
        ("part_size", "4MiB", "uplink.part_size"),
    ):
        done = uplink.run("--check", "--set", f"uplink.{option}={value}")
        assert done.returncode == CONFIG, (option, value, done)
        assert expected in done.stderr and done.stderr.count("\n") == 1, done.stderr
    uplink.credentials.chmod(0o644)
    done = uplink.run("--check")
    assert done.returncode == CONFIG
    assert "others may read it: chmod 600" in done.stderr
    uplink.credentials.chmod(0o600)
    uplink.credentials.write_text("[default]\naws_access_key_id = a\n")
    assert "expected lines aws_access_key_id" in uplink.run("--check").stderr


def test_the_recordings_of_a_fleet_go_through_one_store_to_one_query(tmp_path: Path) -> None:
    found = upload_fleet.run(tmp_path, 6, 10)
    assert (found.appliances, found.recorded) == (6, found.wanted)
    assert (found.doubled, found.missing) == (0, 0)
    assert found.files >= 12  # some of each
