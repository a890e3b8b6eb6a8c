# SPDX-License-Identifier: MIT
"""ecdaq-stream on rings without a bus, a real nats-server, and what a foreign client reads."""

from __future__ import annotations

import asyncio
import json
import shutil
import subprocess
import urllib.request
from collections.abc import Coroutine
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import nats
from ecdaq import BIN
from nats.js.api import StorageType, StreamConfig
from recording import Bench, wait_until
from web_bench import free_port

STREAM = BIN / "ecdaq-stream"
SERVER = shutil.which("nats-server", path="/usr/sbin:/usr/bin:/usr/local/bin") or shutil.which(
    "nats-server"
)
SECONDS = 60


class Server:
    """nats-server on loopback, with its files in @folder; it can be killed and started again."""

    def __init__(self, folder: Path, config: str = "", **client: Any) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self.port = free_port()
        self.monitor = free_port()
        self.client = client
        self.file = folder / "server.conf"
        self.file.write_text(
            f"listen: 127.0.0.1:{self.port}\nhttp: 127.0.0.1:{self.monitor}\n"
            f'jetstream {{ store_dir: "{folder / "store"}" }}\n{config}'
        )
        self.process: subprocess.Popen[bytes] | None = None
        self.start()

    def start(self) -> None:
        log = (self.folder / "server.log").open("ab")
        assert SERVER is not None
        self.process = subprocess.Popen([SERVER, "-c", str(self.file)], stdout=log, stderr=log)
        wait_until("a JetStream that answers", self.is_ready)

    def is_ready(self) -> bool:
        assert self.process is not None
        assert self.process.poll() is None, (self.folder / "server.log").read_text()
        try:
            self.run(self.account())
        except (OSError, nats.errors.Error):
            return False
        return True

    async def account(self) -> None:
        connection = await self.connect()
        try:
            await connection.jetstream().account_info()
        finally:
            await connection.close()

    def kill(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.wait(timeout=SECONDS)
            self.process = None

    @staticmethod
    def run(job: Coroutine[Any, Any, Any]) -> Any:
        return asyncio.run(job)

    async def connect(self) -> Any:
        async def ignore(_error: Exception) -> None:
            pass

        return await nats.connect(
            f"nats://127.0.0.1:{self.port}",
            allow_reconnect=False,
            connect_timeout=5,
            error_cb=ignore,
            **self.client,
        )

    def create_stream(self, **settings: Any) -> None:
        async def create() -> None:
            connection = await self.connect()
            config = StreamConfig(
                name="ecdaq", subjects=["ecdaq.>"], storage=StorageType.FILE, **settings
            )
            await connection.jetstream().add_stream(config)
            await connection.close()

        self.run(create())

    def state(self) -> Any:
        async def ask() -> Any:
            connection = await self.connect()
            state = (await connection.jetstream().stream_info("ecdaq")).state
            await connection.close()
            return state

        return self.run(ask())

    def state_of_server(self) -> dict[str, Any]:
        with urllib.request.urlopen(f"http://127.0.0.1:{self.monitor}/varz", timeout=60) as got:
            return json.load(got)

    def messages(self) -> list[Message]:
        """All that the stream has, in its order."""

        async def read() -> list[Message]:
            connection = await self.connect()
            jet = connection.jetstream()
            state = (await jet.stream_info("ecdaq")).state
            found = []
            if state.messages:
                follow = await jet.subscribe("ecdaq.>", stream="ecdaq", ordered_consumer=True)
                for _ in range(state.messages):
                    message = await follow.next_msg(timeout=SECONDS)
                    found.append(Message(message.subject, dict(message.headers), message.data))
            await connection.close()
            return found

        return self.run(read())

    def last_cycle(self, session: int, slave: str = "piccolo1") -> int:
        """One past the newest cycle of the slave in the stream; 0: none."""

        async def ask() -> int:
            connection = await self.connect()
            try:
                message = await connection.jetstream().get_last_msg(
                    "ecdaq", f"ecdaq.rig1.{slave}.block"
                )
            except nats.js.errors.NotFoundError:
                return 0
            finally:
                await connection.close()
            headers = message.headers
            if int(headers["Ecdaq-Session"]) != session:
                return 0
            return int(headers["Ecdaq-Next-Cycle"])

        return self.run(ask())


@dataclass
class Message:
    subject: str
    headers: dict[str, str]
    data: bytes

    def number(self, name: str) -> int:
        return int(self.headers[f"Ecdaq-{name}"])

    def cycles(self) -> range:
        return range(self.number("First-Cycle"), self.number("Next-Cycle"))

    def samples(self) -> list[bytes]:
        """The recording's messages in a block."""
        count = len(self.cycles())
        size, rest = divmod(len(self.data), count)
        assert rest == 0
        return [self.data[i * size : (i + 1) * size] for i in range(count)]


def cycles_of(messages: list[Message], slave: str, session: int) -> list[int]:
    """Cycle numbers as the samples themselves have them, in the order of the stream."""
    found = []
    for message in messages:
        if message.subject == f"ecdaq.rig1.{slave}.block" and message.number("Session") == session:
            for cycle, data in zip(message.cycles(), message.samples(), strict=True):
                # Behind the CDR header: stamp (8), an empty frame_id (5), padding.
                assert int.from_bytes(data[4 + 16 : 4 + 24], "little") == cycle
                found.append(cycle)
    return found


class Stream:
    """ecdaq-stream of a bench, against a server."""

    def __init__(self, bench: Bench, port: int, **settings: str) -> None:
        self.bench = bench
        given = {
            "stream.enable": "on",
            "stream.servers": f"nats://127.0.0.1:{port}",
            "stream.appliance": "rig1",
            "record.dir": str(bench.folder),
        } | {k.replace("_", ".", 1): v for k, v in settings.items()}
        self.words = [w for name, value in given.items() for w in ("--set", f"{name}={value}")]
        self.start()

    def start(self) -> None:
        self.process = self.bench.start(STREAM, "--run-dir", self.bench.run_dir, *self.words)

    def kill(self) -> None:
        self.process.kill()
        self.process.communicate(timeout=SECONDS)

    def stop(self) -> str:
        """Its messages."""
        self.process.terminate()
        _, errors = self.process.communicate(timeout=SECONDS)
        assert self.process.returncode == 0, errors
        return errors
