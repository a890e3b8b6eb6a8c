# SPDX-License-Identifier: MIT
"""Bundles on the boot partition and on USB disks: which are installed, how often, and what is said.
RAUC, ecdaq-update and mount are stand-ins; the whole is shown in tests/boot/test_90_update.py."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from test_update import ROOT, SCRIPTS, Fakes

# check: a bundle is a file with its version; "?" is not signed. install: what "answer" has.
UPDATE = """
case $1 in
check)
    version=$(cat "$2")
    [ "$version" != "?" ] || { echo "ecdaq-update: $2: its signature is not known" >&2; exit 1; }
    echo "$version"
    ;;
install)
    echo "$(cat "$2")" >> BASE/calls
    sed "s|FILE|$2|" BASE/answer
    exit "$(cat BASE/code)"
    ;;
esac"""
MOUNT = """
for last; do :; done
echo "$*" >> BASE/mounts
[ ! -e BASE/broken ] || { echo "mount: wrong fs type" >&2; exit 32; }
cp BASE/stick/* "$last"/"""


class Media:
    """A machine that runs 0.2.0-a, its boot partition, and a USB disk "sda1"."""

    def __init__(self, fakes: Fakes) -> None:
        self.fakes, self.base = fakes, fakes.base
        for name in ("boot", "stick", "dev", "run"):
            (self.base / name).mkdir()
        (self.base / "image").write_text("ecdaq-image-x 0.2.0-a, Debian archive: 2026-11-22\n")
        (self.base / "dev/sda1").touch()
        (self.base / "dev/mmcblk0").touch()
        (self.base / "console").touch()
        places = {
            **{"MEDIA": "media", "BOOT_DIR": "boot", "DEVICES": "dev", "IMAGE_FILE": "image"},
            **{"OWN_DISK": "dev/mmcblk0", "DOWNLOADS": "update", "CONSOLE": "console"},
            "UPDATE": "bin/update",
        }
        for name, path in places.items():
            fakes.set(f"ECDAQ_{name}", self.base / path)
        fakes.set("RUNTIME_DIRECTORY", self.base / "run")
        fakes.program("update", UPDATE.replace("BASE", str(self.base)))
        fakes.program("mount", MOUNT.replace("BASE", str(self.base)))
        fakes.program("umount", 'rm -f "$1"/*')
        fakes.program("systemctl", f'echo "$*" >> {self.base}/restarts')
        self.answers("installed in slot B: x; it starts with the next start", 0)

    def answers(self, text: str, code: int) -> None:
        (self.base / "answer").write_text(text + "\n")
        (self.base / "code").write_text(f"{code}\n")

    def put(self, where: str, name: str, version: str) -> None:
        (self.base / where / name).write_text(version + "\n")

    def look(self, *places: str) -> list[str]:
        """The lines that it said, on journal and console alike."""
        (self.base / "media").mkdir(exist_ok=True)
        for place in places:
            (self.base / "media" / place).touch()
        (self.base / "console").write_text("")
        done = self.fakes.run(SCRIPTS / "update-media")
        assert done.returncode == 0
        assert list((self.base / "media").iterdir()) == []
        assert (self.base / "console").read_text() == done.stderr
        assert not (self.base / "update/media.raucb").exists()
        return [line.removeprefix("ecdaq-update-media: ") for line in done.stderr.splitlines()]

    def lines(self, name: str) -> list[str]:
        path = self.base / name
        return path.read_text().splitlines() if path.exists() else []


@pytest.fixture
def media(tmp_path: Path) -> Media:
    return Media(Fakes(tmp_path))


INSTALLED = "a.raucb: installed in slot B: x; it starts with the next start"


@pytest.mark.parametrize(("where", "place"), [("boot", "boot"), ("stick", "sda1")])
def test_a_bundle_that_is_there_at_the_start_is_installed_once(
    media: Media, where: str, place: str
) -> None:
    media.put(where, "a.raucb", "0.3.0")
    media.put(where, "readme.txt", "0.4.0")
    assert media.look("boot", place) == [INSTALLED, "restart into it"]
    assert media.lines("calls") == ["0.3.0"]
    assert media.lines("restarts") == ["--no-block reboot"]
    # The new slot was not good, and the old one runs again: no loop.
    left = media.look("boot", place)
    assert left == ["a.raucb: left alone, as before: " + INSTALLED.partition(": ")[2]]
    assert media.lines("calls") == ["0.3.0"]
    assert len(media.lines("restarts")) == 1


def test_a_disk_that_is_plugged_in_later_does_not_restart_the_machine(media: Media) -> None:
    assert media.look("boot") == []
    media.put("stick", "a.raucb", "0.3.0")
    assert media.look("sda1") == [INSTALLED]
    assert media.lines("restarts") == []
    assert "-t vfat -o ro,nosuid,nodev,noexec" in media.lines("mounts")[0]


def test_a_bundle_that_was_refused_is_left_alone_and_another_is_taken(media: Media) -> None:
    media.put("stick", "a.raucb", "0.1.0")
    media.answers("-- checking\necdaq-update: FILE: not installed: it is older than what runs", 1)
    assert media.look("sda1") == ["a.raucb: not installed: it is older than what runs"]
    media.put("stick", "b.raucb", "0.3.0")
    media.answers("installed in slot B: x", 0)
    said = media.look("boot", "sda1")
    assert said[0] == "a.raucb: left alone, as before: not installed: it is older than what runs"
    assert said[1:] == ["b.raucb: installed in slot B: x", "restart into it"]
    assert media.lines("calls") == ["0.1.0", "0.3.0"]


def test_the_version_that_runs_is_not_installed_again(media: Media) -> None:
    media.put("stick", "a.raucb", "0.2.0-a")
    assert media.look("boot", "sda1") == ["a.raucb: 0.2.0-a runs already"]
    assert media.lines("calls") == []


def test_nothing_of_an_unknown_key_is_copied_or_installed(media: Media) -> None:
    media.put("stick", "a.raucb", "?")
    for _ in range(2):
        assert media.look("sda1") == ["a.raucb: not installed: its signature is not known"]
    assert media.lines("calls") == []
    assert list((media.base / "update").rglob("*")) == [media.base / "update/media"]


def test_an_installation_that_gives_no_answer_is_tried_three_times(media: Media) -> None:
    """Power is cut in the middle of it."""
    media.put("boot", "a.raucb", "0.3.0")
    text = UPDATE.replace("install)", "install) kill -9 $PPID; sleep 1;")
    media.fakes.program("update", text.replace("BASE", str(media.base)))
    for tries in (1, 2, 3):
        (media.base / "media").mkdir(exist_ok=True)
        (media.base / "media/boot").touch()
        assert media.fakes.run(SCRIPTS / "update-media").returncode != 0
        (note,) = (media.base / "update/media").iterdir()
        assert note.read_text() == f"{tries}\n"
    assert media.look("boot") == ["a.raucb: not installed: interrupted 3 times"]


def test_a_disk_that_cannot_be_mounted_is_one_line(media: Media) -> None:
    (media.base / "broken").touch()
    assert media.look("boot", "sda1") == ["sda1: not read: mount: wrong fs type"]


def test_the_disk_of_the_machine_itself_is_no_medium(media: Media) -> None:
    (media.base / "dev/mmcblk0p1").touch()
    media.put("stick", "a.raucb", "0.3.0")
    assert media.look("mmcblk0p1") == []
    assert media.lines("mounts") == []


def test_no_room_for_a_copy_is_one_line(media: Media) -> None:
    media.put("boot", "a.raucb", "0.3.0")
    media.fakes.program("cp", "echo 'cp: No space left on device' >&2; exit 1")
    said = media.look("boot")
    assert said == ["a.raucb: not installed: cp: No space left on device"]
    assert media.lines("restarts") == []


def test_the_service_is_started_for_the_boot_partition_and_for_each_disk() -> None:
    units = ROOT / "usr/lib/systemd/system"
    path = (units / "ecdaq-update-media.path").read_text()
    assert "DirectoryNotEmpty=/run/ecdaq-media\n" in path
    assert "[Install]\nWantedBy=multi-user.target" in path
    rule = (ROOT / "usr/lib/udev/rules.d/85-ecdaq.rules").read_text()
    (command,) = re.findall(r'SUBSYSTEMS=="usb".*RUN\+="(.*)"', rule)
    assert command == "/usr/bin/install -D /dev/null /run/ecdaq-media/%k"
    tmpfiles = (ROOT / "usr/lib/tmpfiles.d/ecdaq.conf").read_text()
    assert "f /run/ecdaq-media/boot 0644 root root -\n" in tmpfiles
    service = (units / "ecdaq-update-media.service").read_text()
    # After it has run, the next disk starts it again.
    assert "RemainAfterExit" not in service
    assert "Requires=ecdaq-boot-good.service\n" in service
    (writes,) = re.findall(r"^ReadWritePaths=(.*)$", service, re.MULTILINE)
    assert {"/data/update", "/data/rauc", "/run/ecdaq-media"} <= set(writes.split())
