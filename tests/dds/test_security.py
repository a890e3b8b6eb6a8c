# SPDX-License-Identifier: MIT
"""With DDS Security: without a key no samples, without a commander's key no commands."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from bench import BUILD, Bench, live

LED = "piccolo0.led"
# No commands are allowed but by keys; a lease of a second.
SECURED = {
    "dds.allow_insecure_commands": "off",
    "outputs[0].channel": LED,
    "outputs[0].owner": "remote",
    "outputs[0].timeout": "4s",
}
# A handshake, the exchange of keys and the matching of encrypted endpoints, on a busy machine.
TIMEOUT_S = "30"
# How long one listens that must receive nothing, after it or others have received samples.
SILENCE_S = "5"


def security(*words: str, check: bool = True) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(live.BIN / "ecdaq"), "security", *words], capture_output=True, text=True, check=check
    )


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("keys") / "store"
    security("init", "--dir", str(folder))
    security("add-subscriber", "alice", "--dir", str(folder))
    security("add-commander", "bob", "--dir", str(folder))
    return folder


def start(bench: Bench, name: str, keys: Path | None, *words: str) -> subprocess.Popen[bytes]:
    program = str(BUILD / "tests" / "dds" / "dds_secured")
    return bench.on_pc(name, program, "7", "dds1", str(keys or "-"), *words)


def result(bench: Bench, name: str, process: subprocess.Popen[bytes]) -> Any:
    """What a participant on the PC got, and what became of its command."""
    assert process.wait(120) == 0, bench.logs()
    return json.loads(bench.log(name).splitlines()[-1])


def check_sync0(bench: Bench) -> None:
    """All that there is, and a window of ecdaq-sync0, which a subscriber that comes later gets."""
    segment = bench.segment
    edges = ["--edges", str(bench.folder / "edges")]
    segment.start_sim(*edges)
    segment.start_daemon()
    segment.start_recorder()
    segment.wait_for_op()
    bench.start_dds()
    program = str(live.BIN / "ecdaq-sync0")
    segment.start("sync0", program, *segment.options(), *edges, "--set", "sync0.window=1s")

    def has_result() -> bool:
        message = segment.ecdaq("sync0", "--json", check=False)
        return message.returncode == 0 and json.loads(message.stdout)["windows"] > 0

    live.wait_for("a window of ecdaq-sync0", has_result, 60)


def test_samples_need_a_key_and_commands_need_a_commanders_key(
    make_bench: Callable[..., Bench], store: Path, tmp_path: Path
) -> None:
    bench = make_bench(**SECURED, **{"dds.security": str(store / "appliance")})
    check_sync0(bench)
    assert "DDS Security: CN=appliance, valid until 20" in bench.segment.log("dds")
    assert "do not allow" not in bench.segment.log("dds")

    friends = {
        "alice": start(bench, "alice", store / "alice", TIMEOUT_S, TIMEOUT_S),
        "bob": start(bench, "bob", store / "bob", TIMEOUT_S, "0", LED, "1"),
    }
    alice, bob = (result(bench, name, process) for name, process in friends.items())
    assert alice["samples"] > 100 and alice["results"] > 0, alice
    assert bob["accepted"] and bob["samples"] > 100, bob

    other = tmp_path / "other"
    security("init", "--dir", str(other))
    security("add-commander", "bob", "--dir", str(other))
    strangers = {
        "mallory": start(bench, "mallory", store / "alice", SILENCE_S, "0", LED, "0"),
        "eve": start(bench, "eve", None, SILENCE_S, "0", LED, "0"),
        "fake": start(bench, "fake", other / "bob", SILENCE_S, "0", LED, "0"),
    }
    mallory, eve, fake = (result(bench, name, process) for name, process in strangers.items())
    # A subscriber's key does not command: it is refused a writer.
    assert (mallory["writer"], mallory["answered"], mallory["accepted"]) == (0, 0, 0)
    # Without keys, or with those of another store, nothing is received or accepted.
    for stranger in (eve, fake):
        assert (stranger["samples"], stranger["results"]) == (0, 0)
        assert (stranger["answered"], stranger["accepted"]) == (0, 0)

    status = json.loads(bench.segment.ecdaq("status", "--json").stdout)["dds"]
    assert (status["secure"], status["commands"]) == (True, True)
    # bob commands until one is accepted; commands of others are dropped before any reply.
    assert status["commands_accepted"] >= 1
    assert status["commands_accepted"] + status["commands_refused"] <= bob["sent"]
    assert bench.segment.stop("dds") == 0
    bench.segment.stop("daemon")
    assert bench.segment.stop("recorder") == 0
    led = [m.led for m in live.recorded(bench.segment.record_dir, "/ecdaq/piccolo0")]
    assert any(led)


def test_a_subscribers_key_with_a_commanders_permissions_is_rejected(
    make_bench: Callable[..., Bench], store: Path, tmp_path: Path
) -> None:
    """Permissions are signed: alice cannot write herself others."""
    folder = tmp_path / "alice"
    folder.mkdir(mode=0o700)
    for file in (store / "alice").iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
        (folder / file.name).chmod(0o600)
    (folder / "permissions.p7s").write_bytes((store / "bob" / "permissions.p7s").read_bytes())
    message = security("check", str(folder), check=False)
    assert message.returncode == 1
    assert "is for CN=bob, but the certificate is for CN=alice" in message.stderr


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda folder: (folder / "key.pem").unlink(), "key.pem: No such file"),
        (lambda folder: (folder / "key.pem").chmod(0o644), "key.pem: accessible to others"),
        (
            lambda folder: (folder / "identity_ca.cert.pem").write_bytes(
                (folder / "permissions_ca.cert.pem").read_bytes()
            ),
            "cert.pem: not issued by identity_ca.cert.pem",
        ),
        (
            lambda folder: (folder / "governance.p7s").write_text("nonsense"),
            "governance.p7s: not a signed document",
        ),
    ],
)
def test_unusable_keys_are_reported_in_one_line(
    make_bench: Callable[..., Bench], tmp_path: Path, spoil: Callable[[Path], None], reason: str
) -> None:
    folder = tmp_path / "store"
    security("init", "--dir", str(folder))
    spoil(folder / "appliance")
    ended = subprocess.run(
        [
            str(live.BIN / "ecdaq-dds"), "--check", "--set", "dds.enable=on",
            "--set", "dds.interface=lo", "--set", f"dds.security={folder / 'appliance'}",
        ],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 3
    assert ended.stderr.count("\n") == 1
    assert ended.stderr.startswith("ecdaq-dds: dds.security: ")
    assert reason in ended.stderr


def forget_sync0(store: Path) -> None:
    """The appliance's permissions as they were before there was ecdaq/sync0."""
    signed = store / "appliance" / "permissions.p7s"
    text = signed.read_text()
    xml = text[text.index("<?xml") : text.index("</dds>") + 7]
    line = "          <topic>ecdaq/sync0</topic>\n"
    assert line in xml
    ca = store / "ca" / "permissions_ca"
    subprocess.run(
        [
            "openssl", "smime", "-sign", "-text", "-signer", f"{ca}.cert.pem",
            "-inkey", f"{ca}.key.pem", "-out", str(signed),
        ],
        input=xml.replace(line, ""), text=True, capture_output=True, check=True,
    )  # fmt: skip


@pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl to make old keys with")
def test_keys_older_than_a_topic_are_reported_and_the_rest_is_published(
    make_bench: Callable[..., Bench], tmp_path: Path
) -> None:
    folder = tmp_path / "store"
    security("init", "--dir", str(folder))
    security("add-subscriber", "alice", "--dir", str(folder))
    forget_sync0(folder)
    bench = make_bench(**{"dds.security": str(folder / "appliance")})
    check_sync0(bench)
    assert "these keys do not allow ecdaq/sync0" in bench.segment.log("dds")
    process = start(bench, "alice", folder / "alice", TIMEOUT_S, SILENCE_S)
    alice = result(bench, "alice", process)
    assert alice["samples"] > 100
    assert alice["results"] == 0
