# SPDX-License-Identifier: MIT
"""Updates: what the scripts of a machine do, on made-up folders and with stand-ins of the programs
that they call.
The whole is shown in QEMU: tests/boot/test_90_update.py."""

from __future__ import annotations

import os
import re
import socketserver
import subprocess
import threading
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from conftest import TOP
from metadata import Metadata

ROOT = TOP / "recipes/recipes-core/ecdaq-config/files/root"
SCRIPTS = ROOT / "usr/lib/ecdaq"
TOOLS = TOP / "app/tools/image"
KEEP = ROOT / "usr/share/ecdaq/etc-keep"


class Fakes:
    """Programs in front of PATH, and the environment of a script that calls them."""

    def __init__(self, base: Path) -> None:
        self.base = base
        self.bin = base / "bin"
        self.bin.mkdir()
        self.environment = os.environ | {"PATH": f"{self.bin}:{os.environ['PATH']}"}
        (base / "cmdline").write_text("ro rauc.slot=A quiet\n")
        self.set("ECDAQ_CMDLINE", base / "cmdline")

    def set(self, name: str, value: Path | str) -> None:
        self.environment[name] = str(value)

    def program(self, name: str, text: str) -> None:
        (self.bin / name).write_text(f"#!/bin/sh\n{text}\n")
        (self.bin / name).chmod(0o755)

    def run(self, *command: str | Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [str(c) for c in command],
            env=self.environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )


@pytest.fixture
def fakes(tmp_path: Path) -> Fakes:
    return Fakes(tmp_path)


# /etc


def test_of_what_was_written_to_etc_only_what_is_the_machines_stays(
    fakes: Fakes, tmp_path: Path
) -> None:
    upper = tmp_path / "upper"
    kept = (
        *("machine-id", "hostname", "ssh/ssh_host_ed25519_key", "ssh/ssh_host_ed25519_key.pub"),
        *("ecdaq/keys/ca.pem", "systemd/network/50-lan.network"),
    )
    dropped = (
        *("passwd", "ssh/sshd_config", "systemd/system/multi-user.target.wants/x.service"),
        *("ssh/sshd_config.d/60-ecdaq.conf", "a name with spaces"),
    )
    for name in (*kept, *dropped):
        (upper / name).parent.mkdir(parents=True, exist_ok=True)
        (upper / name).write_text("x")
    (upper / "resolv.conf").symlink_to("/run/x")
    fakes.set("ECDAQ_ETC_KEEP", KEEP)
    for _ in range(2):
        assert fakes.run(SCRIPTS / "keep-etc", upper).returncode == 0
        found = {str(p.relative_to(upper)) for p in upper.rglob("*") if not p.is_dir()}
        assert found == {*kept, "resolv.conf"}
    assert not (upper / "systemd/system").exists()


def test_without_a_list_nothing_is_deleted(fakes: Fakes, tmp_path: Path) -> None:
    (tmp_path / "upper").mkdir()
    (tmp_path / "upper/x").write_text("x")
    fakes.set("ECDAQ_ETC_KEEP", tmp_path / "none")
    assert fakes.run(SCRIPTS / "keep-etc", tmp_path / "upper").returncode == 1
    assert (tmp_path / "upper/x").exists()


def test_a_first_start_has_nothing_to_keep(fakes: Fakes, tmp_path: Path) -> None:
    assert fakes.run(SCRIPTS / "keep-etc", tmp_path / "none").returncode == 0


# Health


class Banner(socketserver.BaseRequestHandler):
    def handle(self) -> None:
        self.request.sendall(b"SSH-2.0-test\r\n")


@pytest.fixture
def ssh() -> Iterator[int]:
    """A port that answers as sshd does."""
    with socketserver.TCPServer(("127.0.0.1", 0), Banner) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield int(server.server_address[1])
        server.shutdown()


OP = '{"state":"OP","waiting":false,"cycle":{"cycles":5000},"recorded_cycles":900}'
WAITS = '{"state":"INIT","waiting":true,"recorded_cycles":0}'
FULL = '{"waiting":false,"cycles":5000,"recorded_cycles":0,"recorder":{"state":"disk full"}}'
# status, state of ecdaqd, state of the recorder, and what is said; none if it is a good start
STARTS = [
    (OP, "active", "active success", None),
    (OP, "active", "inactive success", None),
    (WAITS, "active", "active success", None),
    (FULL, "active", "active success", None),
    (OP, "activating", "active success", "ecdaqd is not ready"),
    (OP.replace("5000", "12"), "active", "active success", "ecdaqd ran 12 cycles of 1000"),
    (OP, "active", "activating exit-code", "ecdaq-record does not run"),
    (OP.replace("900", "0"), "active", "active success", "has recorded nothing"),
    ("", "active", "active success", "ecdaqd ran 0 cycles of 1000"),
]


def health(fakes: Fakes, port: int, start: tuple[str, str, str, str | None]) -> tuple[int, str]:
    status, master, recorder, _ = start
    fakes.program("ecdaq", f"echo '{status}'")
    fakes.program(
        "systemctl",
        f'case $1 in is-active) [ {master} = active ];; show) printf "%s\\n" {recorder};; esac',
    )
    fakes.set("ECDAQ_HEALTH_SECONDS", "0")
    fakes.set("ECDAQ_SSH_PORT", str(port))
    fakes.set("ECDAQ_TRIAL", fakes.base / "trial")
    fakes.set("RUNTIME_DIRECTORY", fakes.base)
    done = fakes.run(SCRIPTS / "health")
    return done.returncode, done.stderr


@pytest.mark.parametrize("start", STARTS, ids=range(len(STARTS)))
def test_a_slot_on_trial_has_to_be_healthy(
    fakes: Fakes, ssh: int, start: tuple[str, str, str, str | None]
) -> None:
    (fakes.base / "trial").write_text("A\n")
    code, said = health(fakes, ssh, start)
    if start[3] is None:
        assert (code, said) == (0, "")
    else:
        assert code == 1
        assert start[3] in said
        assert said.count("\n") == 1


def test_a_slot_on_trial_has_to_answer_by_ssh(fakes: Fakes) -> None:
    (fakes.base / "trial").write_text("A\n")
    code, said = health(fakes, 1, STARTS[0])
    assert code == 1
    assert "SSH does not answer" in said


@pytest.mark.parametrize("trial", [None, "B\n"], ids=["none", "the other slot"])
def test_a_slot_that_was_good_before_stays(fakes: Fakes, ssh: int, trial: str | None) -> None:
    """A cable or a setting is the cause then; the older version would not help."""
    if trial:
        (fakes.base / "trial").write_text(trial)
    code, said = health(fakes, ssh, STARTS[4])
    assert code == 0
    assert "ecdaqd is not ready" in said


def boot_good(fakes: Fakes, *words: str) -> str:
    fakes.program("fw_printenv", "echo 2")
    fakes.program("fw_setenv", f'echo "$*" >> {fakes.base}/calls')
    fakes.set("ECDAQ_TRIAL", fakes.base / "trial")
    assert fakes.run(SCRIPTS / "boot-good", *words).returncode == 0
    return (fakes.base / "calls").read_text()


@pytest.mark.parametrize("trial", ["A", "B"])
def test_a_good_start_ends_the_trial_of_its_own_slot(fakes: Fakes, trial: str) -> None:
    (fakes.base / "trial").write_text(trial + "\n")
    assert boot_good(fakes) == "BOOT_A_LEFT 3\n"
    assert (fakes.base / "trial").exists() is (trial == "B")


def test_a_start_that_was_not_good_leaves_its_slot_without_a_try(fakes: Fakes) -> None:
    (fakes.base / "trial").write_text("A\n")
    assert boot_good(fakes, "bad") == "BOOT_A_LEFT 0\n"
    assert (fakes.base / "trial").exists()


# The command of an operator


REASONS = [
    ("signature verification failed: Verify error: self-signed certificate", "key that this"),
    ("Invalid bundle format: Signature size (7278) exceeds bundle size", "cut off, damaged"),
    ("Compatible mismatch: Expected 'ecdaq-a' but bundle manifest has 'ecdaq-b'", "another mach"),
    (
        "Version mismatch: Expected at least '0.1.0-0' but bundle manifest has '0.0.9'",
        "it is older than what runs, --allow-downgrade",
    ),
    ("Unknown version of the manifest", "not installed: Unknown version of the manifest\n"),
    ("Slot has no device", "Slot has no device"),
]


@pytest.fixture
def machine(fakes: Fakes) -> Fakes:
    """A machine whose slot A runs, and whose slot B has an older version."""
    (fakes.base / "image").write_text("ecdaq-image-x 0.2.0-a, Debian archive: 2026-11-22\n")
    fakes.program("debugfs", 'echo "ecdaq-image-x 0.1.0-b, Debian archive: 2026-10-01"')
    fakes.program(
        "fw_printenv", "case $2 in BOOT_ORDER) echo A B;; BOOT_A_LEFT) echo 3;; *) echo 0;; esac"
    )
    fakes.program("rauc", f'echo "$*" >> {fakes.base}/calls; cp "$2" {fakes.base}/got || :')
    fakes.set("ECDAQ_IMAGE_FILE", fakes.base / "image")
    fakes.set("ECDAQ_NO_SUDO", "1")
    fakes.set("ECDAQ_DOWNLOADS", fakes.base / "downloads")
    (fakes.base / "x.raucb").write_bytes(os.urandom(300_000))
    return fakes


def update(machine: Fakes, *words: str | Path) -> subprocess.CompletedProcess[str]:
    return machine.run(ROOT / "usr/bin/ecdaq-update", *words)


@pytest.mark.parametrize(("said", "wanted"), REASONS)
def test_a_refused_bundle_is_one_line(machine: Fakes, said: str, wanted: str) -> None:
    machine.program("rauc", f'echo " 10% Checking"; echo "LastError: {said}"; echo idle; exit 1')
    done = update(machine, "install", machine.base / "x.raucb")
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert wanted in done.stderr and said in done.stderr


@pytest.mark.parametrize(("left", "stays"), [("3", False), ("0", True)])
def test_a_slot_that_was_not_written_is_not_on_trial(
    machine: Fakes, left: str, stays: bool
) -> None:
    """RAUC asks update-begins before it compares machine and version."""
    trial = machine.base / "trial"
    trial.write_text("B\n")
    machine.set("ECDAQ_TRIAL", trial)
    machine.program("fw_printenv", f"echo {left}")
    machine.program("rauc", "echo 'LastError: no'; exit 1")
    assert update(machine, "install", machine.base / "x.raucb").returncode == 1
    assert trial.exists() is stays


@pytest.mark.parametrize(
    "words",
    [
        ("install",),
        ("install", "a", "b"),
        ("install", "--force", "a"),
        ("install", "--stream", "a"),
        ("status", "x"),
        ("switch", "x"),
        ("update",),
    ],
    ids=" ".join,
)
def test_a_wrong_command_line_is_refused(machine: Fakes, words: tuple[str, ...]) -> None:
    done = update(machine, *words)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert not (machine.base / "calls").exists()


def test_a_file_that_is_not_there_is_named(machine: Fakes) -> None:
    done = update(machine, "install", "none.raucb")
    assert (done.returncode, done.stderr) == (1, "ecdaq-update: none.raucb: no such file\n")


def test_an_older_version_needs_a_word(machine: Fakes) -> None:
    update(machine, "install", machine.base / "x.raucb")
    update(machine, "install", "--allow-downgrade", machine.base / "x.raucb")
    calls = (machine.base / "calls").read_text().splitlines()
    assert [("--ignore-version-limit" in call) for call in calls] == [False, True]


def test_status_tells_both_slots(machine: Fakes) -> None:
    a, b = update(machine, "status").stdout.splitlines()
    assert "0.2.0-a" in a and "tries left: 3, runs, starts next" in a
    assert "0.1.0-b" in b and "tries left: 0)" in b


def test_a_switch_names_the_image_and_notes_it_for_others(machine: Fakes) -> None:
    notes = machine.base / "notes"
    notes.mkdir()
    machine.set("ECDAQ_SLOT_NOTES", notes)
    done = update(machine, "switch")
    image = update(machine, "status").stdout.splitlines()[1].split(": ", 1)[1].split(" (")[0]
    assert done.stdout == f"slot B starts with the next start: {image}\n"
    assert " " in image, "the name and the version"
    assert (notes / "slots").read_text().startswith("A runs, B: 0.1.0-b")


def test_an_empty_slot_is_not_switched_to(machine: Fakes) -> None:
    machine.program("debugfs", "exit 0")
    assert "slot B: empty" in update(machine, "status").stdout
    done = update(machine, "switch")
    assert (done.returncode, done.stderr) == (1, "ecdaq-update: slot B is empty\n")


class Server(ThreadingHTTPServer):
    """Gives `data` by ranges, and closes each of the first `cuts` answers in the middle."""

    data = b""
    cuts = 0
    ranges: list[int]


class Handler(BaseHTTPRequestHandler):
    server: Server

    def do_GET(self) -> None:
        data = self.server.data
        first = int(re.findall(r"\d+", self.headers.get("Range", "bytes=0-"))[0])
        self.server.ranges.append(first)
        if self.path != "/x.raucb":
            self.send_error(404)
            return
        self.send_response(206 if first else 200)
        self.send_header("Content-Length", str(len(data) - first))
        self.send_header("Content-Range", f"bytes {first}-{len(data) - 1}/{len(data)}")
        self.end_headers()
        end = len(data)
        if self.server.cuts > 0:
            self.server.cuts -= 1
            end = first + 100_000
        self.wfile.write(data[first:end])

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def server() -> Iterator[Server]:
    with Server(("127.0.0.1", 0), Handler) as found:
        found.ranges = []
        thread = threading.Thread(target=found.serve_forever, daemon=True)
        thread.start()
        yield found
        found.shutdown()


def test_a_download_that_was_cut_off_continues(machine: Fakes, server: Server) -> None:
    server.data = (machine.base / "x.raucb").read_bytes()
    server.cuts = 1
    url = f"http://127.0.0.1:{server.server_address[1]}/x.raucb"
    done = update(machine, "install", url)
    assert done.returncode == 0, done.stderr
    assert (machine.base / "got").read_bytes() == server.data
    assert server.ranges == [0, 100_000]
    assert list((machine.base / "downloads").iterdir()) == []


def test_an_interrupted_command_continues_where_it_was(machine: Fakes, server: Server) -> None:
    server.data = (machine.base / "x.raucb").read_bytes()
    server.cuts = 1
    url = f"http://127.0.0.1:{server.server_address[1]}/x.raucb"
    machine.set("ECDAQ_ATTEMPTS", "1")
    assert update(machine, "install", url).returncode == 1
    assert update(machine, "install", url).returncode == 0
    assert (machine.base / "got").read_bytes() == server.data
    assert server.ranges == [0, 100_000]


def test_a_page_that_is_not_there_is_one_line(machine: Fakes, server: Server) -> None:
    url = f"http://127.0.0.1:{server.server_address[1]}/none.raucb"
    done = update(machine, "install", url)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "404" in done.stderr


# The image


def test_only_root_may_tell_rauc() -> None:
    """RAUC's own file lets in every user; that of /etc is read behind it."""
    text = (ROOT / "etc/dbus-1/system.d/ecdaq-rauc.conf").read_text()
    tree = ET.fromstring(text)
    rules = [
        (policy.attrib, rule.tag, rule.attrib["send_destination"])
        for policy in tree.iter("policy")
        for rule in policy
    ]
    name = "de.pengutronix.rauc"
    assert rules == [({"context": "default"}, "deny", name), ({"user": "root"}, "allow", name)]


def configuration(metadata: Metadata) -> dict[str, str]:
    text = metadata.recipes["ecdaq-image"].value("configure_rauc")
    return dict(re.findall(r"^([a-z-]+)=(.*)$", text, re.MULTILINE))


def test_a_machine_takes_its_own_bundles_of_no_older_version(metadata: Metadata) -> None:
    found = configuration(metadata)
    image = metadata.recipes["ecdaq-image"]
    assert found["compatible"] == image.value("MACHINE")
    assert found["min-bundle-version"] == f"{image.value('PV')}-0"
    assert found["bundle-formats"] == "verity"
    # What outlives an update is on the data partition.
    assert found["data-directory"].startswith("/data/")


def test_rauc_and_the_boot_script_count_alike(metadata: Metadata) -> None:
    found = configuration(metadata)
    script = (TOP / "recipes/recipes-bsp/u-boot-ecdaq/files/boot.cmd").read_text()
    (tries,) = re.findall(r"^setenv tries (\d)$", script, re.MULTILINE)
    assert found["boot-attempts"] == found["boot-attempts-primary"] == tries
    preinit = (SCRIPTS / "preinit").read_text()
    text = metadata.recipes["ecdaq-image"].value("configure_rauc")
    for slot, part in re.findall(r"test \$\{slot\} = (\w); then\n\t\tsetenv part (\d)", script):
        device = f"/dev/ecdaq-slot-{slot.lower()}"
        assert f'{part}) ln -sf "$name" {device} ;;' in preinit
        assert f"device={device}\ntype=raw\nbootname={slot}\n" in text


def test_which_units_start_is_decided_in_the_slot(metadata: Metadata) -> None:
    """First boot's preset is in /etc of the data partition, and of the first slot only."""
    image = metadata.recipes["ecdaq-image"]
    assert "enable_units" in image.value("ROOTFS_POSTPROCESS_COMMAND").split()
    assert "systemctl preset-all" in image.value("enable_units")


# Keys


@pytest.fixture
def keyring(tmp_path: Path) -> Path:
    """A certificate that is not for development."""
    make_certificate(tmp_path / "release.pem", "/CN=release")
    return tmp_path / "release.pem"


def make_certificate(path: Path, subject: str) -> None:
    subprocess.run(
        [
            *("openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256"),
            *("-nodes", "-days", "10", "-subj", subject, "-keyout", f"{path}.key", "-out", path),
        ],
        check=True,
        capture_output=True,
    )


def make_development_key(tmp_path: Path) -> Path:
    """As the build makes it."""
    subprocess.run(
        ["sh", "-euc", f'. "{TOOLS}/update-keys.sh"; make_development_key'],
        env=os.environ | {"XDG_CACHE_HOME": str(tmp_path)},
        check=True,
    )
    return tmp_path / "ecdaq/update-keys/cert.pem"


def test_the_development_key_is_only_the_builders(tmp_path: Path) -> None:
    cert = make_development_key(tmp_path)
    assert (cert.parent / "key.pem").stat().st_mode & 0o077 == 0
    before = cert.read_bytes()
    make_development_key(tmp_path)
    assert cert.read_bytes() == before


@pytest.mark.parametrize("only", [True, False], ids=["alone", "beside another"])
def test_no_development_key_is_in_a_release(tmp_path: Path, keyring: Path, only: bool) -> None:
    cert = make_development_key(tmp_path)
    ring = tmp_path / "ring.pem"
    ring.write_text(("" if only else keyring.read_text()) + cert.read_text())
    for command in (
        [TOOLS / "build-image.sh", "--release", "--keyring", ring],
        [TOOLS / "build-bundle.sh", "--release", "--key", keyring, "--cert", ring],
    ):
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
        assert done.returncode == 1
        assert "development key" in done.stderr
        assert done.stderr.count("\n") == 1


def test_a_release_needs_keys(keyring: Path) -> None:
    for command in (
        [TOOLS / "build-image.sh", "--release", "--check"],
        [TOOLS / "build-bundle.sh", "--release", "--check"],
        [TOOLS / "build-bundle.sh", "--cert", keyring, "--check"],
    ):
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
        assert done.returncode == 2, command
        assert done.stderr.count("\n") == 1
    good = [TOOLS / "build-image.sh", "--release", "--keyring", keyring, "--check"]
    subprocess.run(good, check=True, timeout=60)
