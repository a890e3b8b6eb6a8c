# SPDX-License-Identifier: MIT
"""Without --run-dir ecdaq finds what runs; in a mount namespace that hides what runs here."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from ecdaq import ECDAQ, NO_DAEMON, OK, Fake, Result, environment, fails, works

HIDE = "mount -t tmpfs tmpfs /dev/shm && mount -t tmpfs tmpfs /run && echo ready && exec cat"
USER = [] if os.geteuid() == 0 else ["--user", "--map-root-user"]


class Place:
    """A mount namespace with empty /dev/shm and /run."""

    def __init__(self) -> None:
        self.keeper = subprocess.Popen(
            ["unshare", *USER, "--mount", "sh", "-c", HIDE],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.keeper.stdout is not None
        assert self.keeper.stdout.readline() == "ready\n", "no mount namespace"
        enter_user = ["--user", "--preserve-credentials"] if USER else []
        self.inside = ["nsenter", "--target", str(self.keeper.pid), *enter_user, "--mount"]
        self.fakes: list[Fake] = []

    def fake(self, run_dir: str) -> Fake:
        subprocess.run([*self.inside, "mkdir", run_dir], check=True)
        self.fakes.append(Fake(Path(run_dir), how=self.inside))
        return self.fakes[-1]

    def __call__(self, *words: str, run_dir: str | None = None) -> Result:
        return subprocess.run(
            [*self.inside, ECDAQ, *words],
            env=environment(None if run_dir is None else Path(run_dir)),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )

    def close(self) -> None:
        for fake in self.fakes:
            fake.close()
        self.keeper.communicate("", timeout=20)


@pytest.fixture
def place() -> Iterator[Place]:
    place = Place()
    yield place
    place.close()


def test_where_none_runs_the_error_is_that_of_the_default_directory(place: Place) -> None:
    fails(place("slaves"), NO_DAEMON, "is ecdaqd running?")


@pytest.mark.parametrize("run_dir", ["/run/ecdaq", "/dev/shm/ecdaq-1000", "/dev/shm/ecdaq-run-Xy1"])
def test_the_one_that_runs_is_taken(place: Place, run_dir: str) -> None:
    place.fake(run_dir)
    assert "piccolo1" in works(place("slaves"))
    assert "piccolo1" in works(place("slaves", "--run-dir", run_dir))


def test_an_ended_one_is_skipped(place: Place) -> None:
    place.fake("/dev/shm/ecdaq-run-a").kill()
    place.fake("/dev/shm/ecdaq-run-b")
    assert "piccolo1" in works(place("slaves"))


def test_the_last_state_of_the_default_one_can_still_be_read(place: Place) -> None:
    place.fake("/run/ecdaq").kill()
    assert "piccolo1" in works(place("slaves"))


def test_several_are_listed_with_the_option_that_selects(place: Place) -> None:
    first = place.fake("/run/ecdaq")
    second = place.fake("/dev/shm/ecdaq-run-b")
    result = place("slaves")
    assert result.returncode == NO_DAEMON and result.stdout == ""
    message, *rows = result.stderr.splitlines()
    assert message == "ecdaq: slaves: several ecdaqd are running: select one:"
    assert len(rows) == 2
    for row, fake in zip(rows, (first, second), strict=True):
        option = f"--run-dir {fake.run_dir}"
        assert row.startswith(f"  {option}  (") and "ecat0, pid " in row
        assert "piccolo1" in works(place(*option.split(), "slaves"))
    second.kill()
    assert place("slaves").returncode == OK


def chosen(option: str, tmp_path: Path) -> tuple[list[str], str | None]:
    """The run directory a by option, configuration or environment."""
    config = tmp_path / "ecdaq.yaml"
    config.write_text("runtime:\n  run_dir: /dev/shm/ecdaq-run-a\n")
    if option == "--run-dir":
        return ["--run-dir", "/dev/shm/ecdaq-run-a"], None
    return (
        (["--config", str(config)], None) if option == "--config" else ([], "/dev/shm/ecdaq-run-a")
    )


@pytest.mark.parametrize("option", ["--run-dir", "--config", "$ECDAQ_RUN_DIR"])
def test_a_named_directory_wins_over_what_runs(place: Place, option: str, tmp_path: Path) -> None:
    place.fake("/dev/shm/ecdaq-run-b")
    words, run_dir = chosen(option, tmp_path)
    fails(place(*words, "slaves", run_dir=run_dir), NO_DAEMON, "/dev/shm/ecdaq-run-a")
    place.fake("/dev/shm/ecdaq-run-a")
    assert "piccolo1" in works(place(*words, "slaves", run_dir=run_dir))
