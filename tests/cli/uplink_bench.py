# SPDX-License-Identifier: MIT
"""ecdaq-uplink on recordings without a bus, real object stores, and what a foreign client reads."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import boto3
import botocore.client
import botocore.exceptions
import go
from ecdaq import BIN, BUILD, ECDAQ
from recording import Bench, wait_until
from web_bench import free_port

UPLINK = BIN / "ecdaq-uplink"
PRODUCER_512 = BUILD / "tests" / "cli" / "test_ring_producer_512"
BUCKET = "fleet"
GOFAKES3 = ("github.com/johannesboyne/gofakes3/cmd/gofakes3", "v1.2.0")
SECONDS = 60
PART = 5 << 20
POLICY = {
    "Version": "2012-10-17",
    "Statement": [{"Effect": "Allow", "Action": "s3:*", "Resource": "*"}],
}


class Store:
    """An object store on loopback with one bucket, as a client that is none of ours sees it."""

    access = "access"
    secret = "secret"

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self.port = free_port()
        self.process: subprocess.Popen[str] | None = None
        self.start()

    def command(self) -> list[str]:
        raise NotImplementedError

    def environment(self) -> dict[str, str]:
        return dict(os.environ)

    def start(self) -> None:
        with (self.folder / "server.log").open("ab") as log:
            self.process = subprocess.Popen(
                self.command(), stdout=log, stderr=log, env=self.environment()
            )
        wait_until("a store that listens", self.listens)

    def listens(self) -> bool:
        assert self.process is not None
        assert self.process.poll() is None, (self.folder / "server.log").read_text()
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port)):
            return True
        return False

    def kill(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.wait(timeout=SECONDS)
            self.process = None

    def client(self, service: str = "s3") -> Any:
        return boto3.client(
            service,
            endpoint_url=f"http://127.0.0.1:{self.port}",
            region_name="us-east-1",
            aws_access_key_id=self.access,
            aws_secret_access_key=self.secret,
            config=botocore.client.Config(s3={"addressing_style": "path"}),
        )

    def keys(self) -> list[str]:
        found = self.client().list_objects_v2(Bucket=BUCKET)
        assert not found["IsTruncated"]
        return sorted(o["Key"] for o in found.get("Contents", []))

    def get(self, key: str) -> bytes:
        return bytes(self.client().get_object(Bucket=BUCKET, Key=key)["Body"].read())

    def manifest(self, key: str) -> dict[str, Any]:
        return dict(json.loads(self.get(key + ".json")))

    def unfinished(self) -> list[str]:
        try:
            found = self.client().list_multipart_uploads(Bucket=BUCKET)
        except botocore.exceptions.ClientError as error:  # gofakes3, before the first upload
            assert error.response["Error"]["Code"] == "NoSuchUpload", error
            return []
        return [u["Key"] for u in found.get("Uploads", [])]


class Moto(Store):
    """moto, which checks each signature and keeps every version of an object."""

    def command(self) -> list[str]:
        return [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(self.port)]

    def environment(self) -> dict[str, str]:
        # So many calls make the user, the bucket; each one after them is checked.
        return dict(os.environ) | {"INITIAL_NO_AUTH_ACTION_COUNT": "5"}

    def start(self) -> None:
        super().start()
        self.access, self.secret = "none", "none"
        iam = self.client("iam")
        iam.create_user(UserName="rig")
        iam.put_user_policy(UserName="rig", PolicyName="p", PolicyDocument=json.dumps(POLICY))
        key = iam.create_access_key(UserName="rig")["AccessKey"]
        s3 = self.client()
        s3.create_bucket(Bucket=BUCKET)
        s3.put_bucket_versioning(Bucket=BUCKET, VersioningConfiguration={"Status": "Enabled"})
        self.access, self.secret = key["AccessKeyId"], key["SecretAccessKey"]

    def versions(self, key: str) -> int:
        """How often an object was made under the key."""
        found = self.client().list_object_versions(Bucket=BUCKET, Prefix=key)
        return sum(v["Key"] == key for v in found.get("Versions", []))


class GoFake(Store):
    """gofakes3, which keeps objects over a restart, checks Content-MD5 and the clock."""

    def command(self) -> list[str]:
        program = go.program(*GOFAKES3)
        return [
            str(program), "-host", f"127.0.0.1:{self.port}", "-backend", "bolt",
            "-bolt.db", str(self.folder / "store.db"), "-initialbucket", BUCKET,
        ]  # fmt: skip


class Link:
    """A wire between the service and a store: it can be cut, and what passes can be changed."""

    def __init__(self, port: int) -> None:
        self.to = port
        self.port = free_port()
        self.change: Callable[[bytes], bytes] = lambda data: data
        self.requests: list[str] = []  # "PUT /fleet/..."
        self.open: set[socket.socket] = set()
        self.lock = threading.Lock()
        self.listener: socket.socket | None = None
        self.restore()

    def restore(self) -> None:
        listener = socket.socket()
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(("127.0.0.1", self.port))
        listener.listen()
        self.listener = listener
        threading.Thread(target=self.accept, args=(listener,), daemon=True).start()

    def cut(self) -> None:
        if self.listener is not None:
            with contextlib.suppress(OSError):
                self.listener.shutdown(socket.SHUT_RDWR)
            self.listener.close()
            self.listener = None
        with self.lock:
            for one in self.open:
                with contextlib.suppress(OSError):
                    one.shutdown(socket.SHUT_RDWR)

    def accept(self, listener: socket.socket) -> None:
        while True:
            try:
                near, _ = listener.accept()
            except OSError:
                return
            try:
                far = socket.create_connection(("127.0.0.1", self.to))
            except OSError:
                near.close()
                continue
            with self.lock:
                self.open |= {near, far}
            for pair in ((near, far, True), (far, near, False)):
                threading.Thread(target=self.carry, args=pair, daemon=True).start()

    def carry(self, source: socket.socket, target: socket.socket, is_request: bool) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(1 << 16):
                if is_request:
                    self.note(data)
                    data = self.change(data)
                target.sendall(data)
        for one in (source, target):
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)

    def note(self, data: bytes) -> None:
        first = re.match(rb"((?:GET|HEAD|PUT|POST|DELETE) \S+) HTTP/1\.1\r\n", data)
        if first is not None:
            self.requests.append(first[1].decode())

    def parts(self) -> int:
        """Parts whose sending was begun."""
        return sum(r.startswith("PUT ") and "partNumber=" in r for r in self.requests)


class Uplink:
    """ecdaq-uplink of a bench, against a store."""

    def __init__(self, bench: Bench, store: Store, port: int | None = None, **more: str) -> None:
        self.bench = bench
        self.store = store
        self.marks = bench.run_dir / "marks"
        self.credentials = bench.run_dir / "credentials"
        self.give_credentials(store.access, store.secret)
        given = {
            "uplink.enable": "on",
            "uplink.endpoint": f"http://127.0.0.1:{port or store.port}",
            "uplink.bucket": BUCKET,
            "uplink.prefix": "plant/a",
            "uplink.appliance": "rig1",
            "uplink.credentials": str(self.credentials),
            "uplink.dir": str(self.marks),
            "uplink.part_size": "5MiB",
            "record.dir": str(bench.folder),
        } | {k.replace("_", ".", 1): v for k, v in more.items()}
        self.words = [w for name, value in given.items() for w in ("--set", f"{name}={value}")]
        self.log = bench.run_dir / "uplink.log"
        self.process: subprocess.Popen[str] | None = None

    def give_credentials(self, access: str, secret: str) -> None:
        self.credentials.touch(mode=0o600)
        self.credentials.write_text(
            f"[default]\naws_access_key_id = {access}\naws_secret_access_key = {secret}\n"
        )

    def command(self, *words: str) -> list[str | Path]:
        return [UPLINK, "--run-dir", self.bench.run_dir, *self.words, *words]

    def start(self) -> None:
        with self.log.open("ab") as log:
            self.process = subprocess.Popen(self.command(), stdout=log, stderr=log, text=True)
        self.bench.processes.append(self.process)

    def kill(self) -> None:
        assert self.process is not None
        self.process.kill()
        self.process.wait(timeout=SECONDS)

    def stop(self) -> str:
        """Its messages."""
        assert self.process is not None
        self.process.terminate()
        self.process.wait(timeout=SECONDS)
        errors = self.log.read_text()
        assert self.process.returncode == 0, errors
        return errors

    def finish(self, seconds: float = 2 * SECONDS) -> str:
        """Upload all that is finished; its messages."""
        done = subprocess.run(
            self.command("--once"), capture_output=True, text=True, timeout=seconds, check=False
        )
        assert done.returncode == 0, done.stderr
        return done.stderr

    def run(self, *words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            self.command(*words), capture_output=True, text=True, timeout=SECONDS, check=False
        )

    def uploaded(self) -> list[str]:
        found = self.marks.glob("*.uploaded") if self.marks.exists() else iter(())
        return sorted(p.name.removesuffix(".uploaded") for p in found)

    def key(self, path: Path) -> str:
        return f"plant/a/rig1/{path.name}"

    def wait_message(self, part: str, count: int = 1) -> None:
        """Until an attempt has failed with it, or @count: attempts are up to a minute apart."""
        wait_until(part, lambda: self.log.read_text().count(part) >= count)

    def status(self) -> dict[str, Any]:
        done = subprocess.run(
            [ECDAQ, "status", "--json", "--run-dir", str(self.bench.run_dir)],
            capture_output=True, text=True, timeout=SECONDS, check=True,
        )  # fmt: skip
        return dict(json.loads(done.stdout)["uplink"])


def record_small(bench: Bench, count: int = 1, cycles: int = 500) -> list[Path]:
    """More recordings of two slaves, of one session each."""
    for _ in range(count):
        producer = bench.produce("--cycles", str(cycles))
        producer.communicate("", timeout=SECONDS)
        bench.record_all()
    return bench.files()[-count:]


def record_large(bench: Bench, cycles: int = 900) -> Path:
    """One of 512 slaves, not compressed: more than five parts."""
    producer = bench.start(PRODUCER_512, bench.run_dir, "--cycles", str(cycles), "--depth", "1024")
    producer.communicate("", timeout=SECONDS)
    bench.record_all("--set", "record.compression=0")
    path = bench.files()[-1]
    assert path.stat().st_size > 5 * PART, path.stat().st_size
    return path


def expect_uploaded(uplink: Uplink, paths: list[Path]) -> None:
    """Each is there once, byte by byte, with its manifest; nothing else is, and all is marked."""
    store = uplink.store
    wanted = [k for p in paths for k in (uplink.key(p), uplink.key(p) + ".json")]
    assert store.keys() == sorted(wanted)
    assert store.unfinished() == []
    assert uplink.uploaded() == sorted(p.name for p in paths)
    assert list(uplink.marks.glob("*.uploading")) == []
    for path in paths:
        data = path.read_bytes()
        assert store.get(uplink.key(path)) == data
        manifest = store.manifest(uplink.key(path))
        assert manifest["bytes"] == len(data)
        assert manifest["sha256"] == hashlib.sha256(data).hexdigest()
        assert (manifest["file"], manifest["key"]) == (path.name, uplink.key(path))
        assert manifest["appliance"] == "rig1"
        info = json.loads(uplink.bench.log("info", "--json", path).stdout)
        for name in ("cycles", "first_cycle", "last_cycle", "cycles_missing", "start_ns"):
            assert manifest[name] == info[name], name
        session = next(m for m in info["metadata"] if m["name"] == "ecdaq.session")
        assert manifest["session"] == int(session["values"]["session"])


def pass_time(seconds: float) -> None:
    """A fault at any place of an exchange: nothing waits for this."""
    end = time.monotonic() + seconds
    wait_until("a random time", lambda: time.monotonic() >= end)


def stores(tmp_path: Path, kind: type[Store]) -> Iterator[Store]:
    made = kind(tmp_path / "store")
    yield made
    made.kill()
