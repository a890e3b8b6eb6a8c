# SPDX-License-Identifier: MIT
"""`./build.sh run` starts, ends and reports in order, whatever its programs (stand-ins here) do."""

from __future__ import annotations

import fcntl
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from project import ROOT

SCRIPT = ROOT / "app" / "tools" / "run-segment.sh"
# A program that logs its start and end, with the code; SIGTERM ends it.
STAND_IN = """#!/bin/bash
trap 'echo "end $(basename "$0")" >> "$LOG"; exit 0' TERM
trap 'echo "interrupted $(basename "$0")" >> "$LOG"' INT
[ "$1" != --check ] || exit 0
echo "start $(basename "$0") $*" >> "$LOG"
[[ $0 != */ecdaq-sim ]] || touch "$ECDAQ_RUN_DIR/edges"
{body}
while :; do sleep 0.05; done
"""
# Ends only when the others run: else they could be ended before they have logged it.
WHEN_RUN = """until [ "$(grep -c '^start' "$LOG")" -ge {count} ]; do sleep 0.01; done
"""
WHEN_ALL_RUN = WHEN_RUN.format(count=5)
WHEN_ALL_BUT_ONE_RUN = WHEN_RUN.format(count=4)
PROGRAMS = ("ecdaqd", "ecdaq-record", "ecdaq-dds", "ecdaq-sim", "ecdaq-sync0")
END_ORDER = ["ecdaq-sync0", "ecdaqd", "ecdaq-record", "ecdaq-dds", "ecdaq-sim"]
PAGE = '{"state":"STOPPED"}'
# A command of the script that logs its start, then takes its time. Ctrl-C ends it.
SLOW = """#!/bin/bash
if {condition}; then echo "slow $(basename "$0") $*" >> "$LOG"; sleep {seconds}; fi
exec {real} "$@"
"""
# Until something happens or ends, on a loaded machine.
SECONDS = 60
TOOL = """#!/bin/bash
echo "tool $*" >> "$LOG"
[ "$1" = status ] && echo '{page}'
"""


class Bench:
    """Stand-ins for the programs, and the log they write."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.log_file = folder / "log"
        self.log_file.touch()
        self.bin = folder / "bin"
        self.bin.mkdir()
        self.path = folder / "path"
        self.program("ecdaq", TOOL.replace("{page}", PAGE))
        for name in PROGRAMS:
            self.program(name, STAND_IN.replace("{body}", ""))

    def program(self, name: str, text: str) -> None:
        (self.bin / name).write_text(text)
        (self.bin / name).chmod(0o755)

    def make_it(self, name: str, body: str) -> None:
        self.program(name, STAND_IN.replace("{body}", body))

    def make_slow(self, name: str, seconds: int, condition: str = "true") -> None:
        """Of the commands that the script itself runs."""
        real = shutil.which(name)
        assert real is not None
        self.path.mkdir(exist_ok=True)
        text = SLOW.format(condition=condition, seconds=seconds, real=real)
        (self.path / name).write_text(text)
        (self.path / name).chmod(0o755)

    @property
    def log(self) -> list[str]:
        return self.log_file.read_text().splitlines()

    def start(self, *options: str, web: str = "--no-web") -> subprocess.Popen[str]:
        places = {"ECDAQ_BIN_DIR": str(self.bin), "LOG": str(self.log_file)}
        places["PATH"] = f"{self.path}:{os.environ['PATH']}"
        return subprocess.Popen(
            [SCRIPT, "--record", str(self.folder / "record"), *filter(None, (*options, web))],
            env=os.environ | places,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            # Whoever runs the tests in the background of a script has SIGINT ignored.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )

    def wait_for_log(self, *beginnings: str) -> None:
        end = time.monotonic() + SECONDS
        while not all(any(line.startswith(b) for line in self.log) for b in beginnings):
            assert time.monotonic() < end, self.log
            time.sleep(0.01)

    def wait_until_all_run(self) -> None:
        self.wait_for_log(*(f"start {name}" for name in PROGRAMS))


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    how = ["unshare", "--net"] if os.geteuid() == 0 else ["unshare", "-r", "--net"]
    if subprocess.run([*how, "true"], capture_output=True, check=False).returncode != 0:
        pytest.skip("cannot create a network namespace here")
    yield Bench(tmp_path)


def reports(err: str) -> list[str]:
    """Standard error without the line for the second terminal, which is the first one."""
    first, *others = err.splitlines()
    assert re.fullmatch(r"-- starting; in a second terminal: \S+/ecdaq --run-dir \S+ status", first)
    return others


def ends(bench: Bench) -> list[str]:
    return [line for line in bench.log if line.startswith("end ")]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_ends_all_in_order_with_a_summary(bench: Bench, number: int) -> None:
    run = bench.start()
    bench.wait_until_all_run()
    os.killpg(run.pid, number)
    out, err = run.communicate(timeout=SECONDS)
    assert run.returncode == 0, err
    assert ends(bench) == [f"end {name}" for name in END_ORDER]
    assert bench.log[-1] == "tool status --summary"
    assert out.splitlines()[-1] == '{"state":"STOPPED"}'
    assert not any(line.startswith("interrupted") for line in bench.log)


def test_no_command_of_the_script_that_an_interrupt_could_end_runs_after_the_start(
    bench: Bench,
) -> None:
    """Ctrl-C reaches the whole foreground group: its failure would end the script with 130."""
    bench.make_slow("mkfifo", 2, "[[ $1 == */idle ]]")
    run = bench.start()
    bench.wait_until_all_run()
    os.killpg(run.pid, signal.SIGINT)
    _, err = run.communicate(timeout=SECONDS)
    assert run.returncode == 0, err
    assert any(line.startswith("slow mkfifo") for line in bench.log)
    assert ends(bench) == [f"end {name}" for name in END_ORDER]


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupt_before_the_start_starts_nothing_and_leaves_nothing_behind(
    bench: Bench, number: int, code: int
) -> None:
    bench.make_slow("ip", 3)
    run = bench.start("--no-dds")
    bench.wait_for_log("slow ip")
    os.killpg(run.pid, number)
    _, err = run.communicate(timeout=SECONDS)
    assert run.returncode == code, err
    assert not any(line.startswith("start") for line in bench.log)
    assert not Path(err.split()[err.split().index("--run-dir") + 1]).exists()


def test_json_ends_with_the_summary_as_one_line(bench: Bench) -> None:
    bench.make_it("ecdaqd", WHEN_ALL_RUN + "exit 0")
    run = bench.start("--seconds", "1", "--json", "--slaves", "8")
    out, err = run.communicate(timeout=SECONDS)
    assert run.returncode == 0, err
    assert bench.log[-1] == "tool status --json --summary"
    assert out == '{"state":"STOPPED"}\n'
    assert any(line.startswith("start ecdaq-sim") and "--slaves 8" in line for line in bench.log)
    assert any(line.startswith("start ecdaqd") and "--seconds 1" in line for line in bench.log)


def test_a_master_that_fails_fails_the_run(bench: Bench) -> None:
    bench.make_it("ecdaqd", WHEN_ALL_RUN + "echo ecdaqd: no link >&2; exit 8")
    run = bench.start("--seconds", "1")
    _, err = run.communicate(timeout=SECONDS)
    assert run.returncode == 1
    assert err.splitlines()[-1] == "build.sh: run: ecdaqd ended with 8: no link"
    assert ends(bench) == [f"end {name}" for name in END_ORDER if name != "ecdaqd"]


def test_a_segment_that_ends_by_itself_fails_the_run(bench: Bench) -> None:
    bench.make_it("ecdaq-sim", "exit 3")
    run = bench.start()
    _, err = run.communicate(timeout=SECONDS)
    assert run.returncode == 1
    assert err.splitlines()[-1] == "build.sh: run: ecdaq-sim ended with 3"


def test_a_run_that_is_killed_leaves_nothing_behind(bench: Bench) -> None:
    run = bench.start()
    bench.wait_until_all_run()
    run.kill()
    run.communicate(timeout=SECONDS)
    bench.wait_for_log(*(f"end {name}" for name in PROGRAMS))


def test_the_run_directory_is_removed_unless_it_is_given(bench: Bench, tmp_path: Path) -> None:
    bench.make_it("ecdaqd", 'echo "run dir $ECDAQ_RUN_DIR" >> "$LOG"; exit 0')
    assert bench.start("--seconds", "1").wait(SECONDS) == 0
    (line,) = [entry for entry in bench.log if entry.startswith("run dir ")]
    # Others on this machine may make and remove theirs meanwhile.
    assert not Path(line.removeprefix("run dir ")).exists()


def test_the_directory_of_a_killed_run_is_removed_by_the_next_run(bench: Bench) -> None:
    folders = [Path(f"/dev/shm/ecdaq-run-test{os.getpid()}{name}") for name in ("a", "b")]
    for folder in folders:
        folder.mkdir()
        (folder / "run.lock").touch()
        os.utime(folder, (0, 0))
    abandoned, used = folders
    bench.make_it("ecdaqd", "exit 0")
    with (used / "run.lock").open() as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        bench.start("--seconds", "1").wait(SECONDS)
        assert not abandoned.exists()
        assert used.exists()
    shutil.rmtree(used)


@pytest.mark.parametrize("page", ['{"pid":1,"samples_good":7,}', '{"pid":PID,"samples_good":0,}'])
def test_a_failed_start_prints_its_cause_and_no_summary(bench: Bench, page: str) -> None:
    """Neither that of an earlier run in the same directory, nor an empty one."""
    body = WHEN_ALL_RUN + 'echo $$ > "$LOG.pid"; echo ecdaqd: why >&2; exit 5'
    bench.make_it("ecdaqd", body)
    bench.program("ecdaq", f"""#!/bin/bash\necho '{page}' | sed "s/PID/$(cat "$LOG.pid")/"\n""")
    run = bench.start()
    out, err = run.communicate(timeout=SECONDS)
    assert (run.returncode, out) == (1, "")
    assert err.splitlines()[-1] == "build.sh: run: ecdaqd ended with 5: why"


def test_a_run_that_fails_after_it_was_in_op_prints_summary_and_cause(bench: Bench) -> None:
    body = WHEN_ALL_RUN + 'echo $$ > "$LOG.pid"; exit 14'
    bench.make_it("ecdaqd", body)
    page = '{"pid":PID,"samples_good":7,"recording":"/x/a.mcap"}'
    bench.program("ecdaq", f"""#!/bin/bash\necho '{page}' | sed "s/PID/$(cat "$LOG.pid")/"\n""")
    run = bench.start()
    out, err = run.communicate(timeout=SECONDS)
    assert run.returncode == 1
    assert '"samples_good":7' in out
    assert "log list --dir" in err
    assert "log export /x/a.mcap" in err
    assert err.splitlines()[-1] == "build.sh: run: ecdaqd ended with 14"


def test_a_run_directory_is_used_by_one_run_at_a_time(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ECDAQ_RUN_DIR", str(tmp_path / "run"))
    first = bench.start()
    bench.wait_until_all_run()
    second = bench.start()
    out, err = second.communicate(timeout=SECONDS)
    assert (second.returncode, out) == (1, "")
    assert "another run uses this directory" in err
    assert err.count("\n") == 1
    assert first.poll() is None
    os.killpg(first.pid, signal.SIGINT)
    assert first.wait(SECONDS) == 0


def dds_line(bench: Bench) -> str:
    return next((line for line in bench.log if line.startswith("start ecdaq-dds")), "")


def test_dds_is_published_on_loopback_in_a_domain_and_with_a_tag_of_ones_own(bench: Bench) -> None:
    bench.make_it("ecdaqd", WHEN_ALL_RUN + "exit 0")
    run = bench.start("--seconds", "1")
    _, err = run.communicate(timeout=SECONDS)
    assert run.returncode == 0, err
    tag = f"run-{run.pid}"
    for setting in ("enable=on", "interface=lo", "multicast=off", "domain=230", f"tag={tag}"):
        assert f"--set dds.{setting}" in dds_line(bench)
    assert f"ecdaq-remote --interface lo --domain 230 --tag {tag} watch" in err


def test_a_dds_section_of_the_configuration_is_used(bench: Bench) -> None:
    config = bench.folder / "mine.yaml"
    config.write_text("dds:\n  enable: on\n  interface: eth7\n")
    bench.make_it("ecdaqd", WHEN_ALL_RUN + "exit 0")
    assert bench.start("--seconds", "1", "--config", str(config)).wait(SECONDS) == 0
    assert dds_line(bench) == f"start ecdaq-dds --config {config}"


def test_without_dds_there_is_none(bench: Bench) -> None:
    bench.make_it("ecdaqd", WHEN_ALL_BUT_ONE_RUN + "exit 0")
    run = bench.start("--seconds", "1", "--no-dds")
    _, err = run.communicate(timeout=SECONDS)
    assert run.returncode == 0
    assert "DDS" not in err
    assert not dds_line(bench)


@pytest.mark.parametrize(
    ("program", "reason"),
    [
        (None, "ecdaq-dds is not built"),
        ("#!/bin/sh\necho 'ecdaq-dds: why not' >&2\nexit 3\n", "ecdaq-dds: why not"),
    ],
)
def test_an_unavailable_dds_is_one_line_and_the_run_continues(
    bench: Bench, program: str | None, reason: str
) -> None:
    if program is None:
        (bench.bin / "ecdaq-dds").unlink()
    else:
        bench.program("ecdaq-dds", program)
    bench.make_it("ecdaqd", WHEN_ALL_BUT_ONE_RUN + "exit 0")
    run = bench.start("--seconds", "1")
    _, err = run.communicate(timeout=SECONDS)
    assert run.returncode == 0
    assert reports(err)[0].startswith(f"-- no DDS: {reason}")


def test_a_publisher_that_ends_by_itself_fails_the_run(bench: Bench) -> None:
    bench.make_it("ecdaq-dds", WHEN_ALL_RUN + "exit 1")
    run = bench.start()
    _, err = run.communicate(timeout=SECONDS)
    assert run.returncode == 1
    assert "ecdaq-dds ended by itself" in err


def sync0_line(bench: Bench) -> str:
    return next((line for line in bench.log if line.startswith("start ecdaq-sync0")), "")


def run_dir_of(bench: Bench) -> str:
    (line,) = [entry for entry in bench.log if entry.startswith("run dir ")]
    return line.removeprefix("run dir ")


def test_the_simulated_pulses_are_checked(bench: Bench) -> None:
    bench.make_it("ecdaqd", WHEN_ALL_RUN + 'echo "run dir $ECDAQ_RUN_DIR" >> "$LOG"; exit 0')
    assert bench.start("--seconds", "1").wait(SECONDS) == 0
    edges = f"{run_dir_of(bench)}/edges"
    assert sync0_line(bench) == f"start ecdaq-sync0 --edges {edges}"
    (segment,) = [line for line in bench.log if line.startswith("start ecdaq-sim")]
    assert f"--edges {edges} --edges-keep 8" in segment


@pytest.mark.parametrize(
    ("section", "is_simulated"),
    [
        ("cycle:\n  period: 2ms\n", True),
        ("sync0:\n  window: 1s\ndds:\n  enable: on\n  interface: lo\n", True),
        ("sync0:\n  # none\n  window: 1s\n\n  enable: on\n", False),
        ("sync0: { window: 1s, edges: /tmp/mine }\n", False),
        ("cycle:\n  period: 1ms\nsync0:\n  enable: off\nrecord:\n  enable: on\n", False),
    ],
)
def test_a_sync0_section_of_the_configuration_is_used(
    bench: Bench, section: str, is_simulated: bool
) -> None:
    config = bench.folder / "mine.yaml"
    config.write_text(section)
    bench.make_it("ecdaqd", WHEN_ALL_RUN + 'echo "run dir $ECDAQ_RUN_DIR" >> "$LOG"; exit 0')
    assert bench.start("--seconds", "1", "--config", str(config)).wait(SECONDS) == 0
    more = f" --edges {run_dir_of(bench)}/edges" if is_simulated else ""
    assert sync0_line(bench) == f"start ecdaq-sync0 --config {config}{more}"


def test_without_the_check_no_edges_are_written(bench: Bench) -> None:
    bench.make_it("ecdaqd", WHEN_ALL_BUT_ONE_RUN + "exit 0")
    assert bench.start("--seconds", "1", "--no-sync0").wait(SECONDS) == 0
    assert not sync0_line(bench)
    assert not any("--edges" in line for line in bench.log)


def test_an_unavailable_check_is_one_line_and_the_run_continues(bench: Bench) -> None:
    (bench.bin / "ecdaq-sync0").unlink()
    bench.make_it("ecdaqd", WHEN_RUN.format(count=3) + "exit 0")
    run = bench.start("--seconds", "1", "--no-dds")
    _, err = run.communicate(timeout=SECONDS)
    assert run.returncode == 0
    assert reports(err) == ["-- no check of SYNC0: ecdaq-sync0 is not built"]


@pytest.mark.parametrize(("code", "message"), [(0, []), (1, ["-- ecdaq-sync0 ended with 1"])])
def test_a_check_that_ends_by_itself_ends_nothing_else(
    bench: Bench, code: int, message: list[str]
) -> None:
    bench.make_it("ecdaq-sync0", f"exit {code}")
    # The script detects an end within 0.2 s. If it ended this one, too, the line would not come.
    alone = 'until grep -q "^start ecdaq-sync0" "$LOG"; do sleep 0.01; done; sleep 1\n'
    bench.make_it("ecdaqd", alone + 'echo "continues ecdaqd" >> "$LOG"')
    run = bench.start("--no-dds")
    bench.wait_for_log(*(f"start {name}" for name in PROGRAMS if name != "ecdaq-dds"))
    assert run.stderr is not None
    assert run.stderr.readline().startswith("-- starting")
    assert [run.stderr.readline().rstrip() for _ in message] == message
    bench.wait_for_log("continues ecdaqd")
    assert run.poll() is None
    assert not ends(bench)
    os.killpg(run.pid, signal.SIGINT)
    _, err = run.communicate(timeout=SECONDS)
    assert run.returncode == 0
    assert not err
    assert ends(bench) == ["end ecdaqd", "end ecdaq-record", "end ecdaq-sim"]


def web_line(bench: Bench) -> str:
    return next((line for line in bench.log if line.startswith("start ecdaq-web")), "")


def test_the_page_is_served_on_loopback_and_its_address_printed(bench: Bench) -> None:
    bench.program("ecdaq-web", STAND_IN.replace("{body}", ""))
    run = bench.start("--seconds", "1", "--no-dds", web="")
    bench.wait_for_log("start ecdaq-web", "start ecdaq-sync0", "start ecdaqd", "start ecdaq-record")
    run.terminate()
    _, err = run.communicate(timeout=SECONDS)
    assert run.returncode == 0
    [port] = re.findall(r"^-- page: http://127\.0\.0\.1:(\d+)/ \(Foxglove: ws://", err, re.M)
    settings = f"--set web.enable=on --set web.listen=loopback --set web.port={port}"
    settings += f" --set record.dir={bench.folder / 'record'}"
    assert web_line(bench) == f"start ecdaq-web {settings}"
    assert "end ecdaq-web" in ends(bench)


# As the real one: a socket in a folder of its own.
LISTEN = """python3 - "$ECDAQ_RUN_DIR/web-command" <<'EOF'
import os, socket, sys
os.makedirs(sys.argv[1])
socket.socket(socket.AF_UNIX).bind(sys.argv[1] + "/token")
EOF
"""


def test_an_address_with_a_token_is_printed_and_the_run_continues_without_commands(
    bench: Bench,
) -> None:
    bench.program("ecdaq-web", STAND_IN.replace("{body}", ""))
    ends_early = LISTEN + WHEN_RUN.format(count=6) + "sleep 1\nexit 1"
    bench.program("ecdaq-web-command", STAND_IN.replace("{body}", ends_early))
    bench.program("ecdaq", TOOL.replace("{page}", PAGE) + '[ "$3" != web-token ] || echo abc\n')
    run = bench.start("--seconds", "1", "--no-dds", web="")
    bench.wait_for_log("start ecdaq-web-command", "start ecdaqd", "start ecdaq-record")
    assert run.stderr is not None
    lines: list[str] = []
    while "-- ecdaq-web-command has ended: the page has no commands any more" not in lines:
        line = run.stderr.readline()
        assert line, lines
        lines.append(line.rstrip())
    run.terminate()
    run.communicate(timeout=SECONDS)
    assert run.returncode == 0
    assert re.search(r"^-- page with a log-in, .*: http://127\.0\.0\.1:\d+/#token=abc$",
                     "\n".join(lines), re.M)  # fmt: skip
    assert any(line.endswith(" web-token operator") for line in bench.log)


def test_a_web_section_of_the_configuration_is_used(bench: Bench) -> None:
    bench.program("ecdaq-web", STAND_IN.replace("{body}", ""))
    config = bench.folder / "ecdaq.yaml"
    config.write_text("web:\n  enable: on\n  port: 80\n")
    run = bench.start("--config", str(config), "--no-dds", web="")
    bench.wait_for_log("start ecdaq-web", "start ecdaq-sync0")
    run.terminate()
    run.communicate(timeout=SECONDS)
    settings = f"--config {config} --set record.dir={bench.folder / 'record'}"
    assert web_line(bench) == f"start ecdaq-web {settings}"


@pytest.mark.parametrize(
    ("program", "why"),
    [
        (None, "ecdaq-web is not built"),
        ("#!/bin/sh\necho 'ecdaq-web: why not' >&2\nexit 3\n", "ecdaq-web: why not"),
    ],
)
def test_an_unavailable_page_is_one_line_and_the_run_continues(
    bench: Bench, program: str | None, why: str
) -> None:
    if program is not None:
        bench.program("ecdaq-web", program)
    run = bench.start("--no-dds", web="")
    bench.wait_for_log(*(f"start {name}" for name in PROGRAMS if name != "ecdaq-dds"))
    run.terminate()
    _, err = run.communicate(timeout=SECONDS)
    assert run.returncode == 0
    assert sum(line.startswith(f"-- no page: {why}") for line in err.splitlines()) == 1


def test_the_run_continues_when_the_page_ends(bench: Bench) -> None:
    bench.program("ecdaq-web", STAND_IN.replace("{body}", WHEN_RUN.format(count=5) + "exit 1"))
    alone = 'until grep -q "^start ecdaq-web" "$LOG"; do sleep 0.01; done; sleep 2\nexit 0\n'
    bench.make_it("ecdaqd", alone)
    run = bench.start("--no-dds", web="")
    _, err = run.communicate(timeout=SECONDS)
    assert run.returncode == 0, err
    assert "-- ecdaq-web has ended: there is no page any more" in err.splitlines()
