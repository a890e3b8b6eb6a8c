# SPDX-License-Identifier: MIT
"""The page "From an unknown bus to named, scaled channels in a recording", as a user follows it."""

from __future__ import annotations

import csv
import re
import shlex
from collections.abc import Callable

import yaml
from segment import BIN, ROOT, Segment

PAGE = (ROOT / "app/doc/how-to/commission-an-unknown-machine.md").read_text()
IDENTITY = ("vendor", "product", "revision")


def commands() -> list[str]:
    return [
        line
        for block in re.findall(r"```sh\n(.*?)```", PAGE, re.S)
        for line in block.split("\n")
        if line
    ]


def test_an_unknown_bus_of_eight_terminals_is_named_scaled_and_recorded(
    make_segment: Callable[..., Segment],
) -> None:
    (slaves,) = re.findall(r"--slaves (\S+)", PAGE)
    (edited,) = re.findall(r"```yaml\n(.*?)```", PAGE, re.S)
    segment = make_segment(slaves=slaves)
    # The page's own option, so that the file says it.
    del segment.settings["bus.interface"]

    def run(command: str) -> str:
        words = shlex.split(command)
        program = str(BIN / words[0]) if words[0] == "ecdaq" else words[0]
        more = ["--dir", str(segment.record_dir)] if words[1:3] == ["log", "export"] else []
        got = segment.space.run(
            *["env", "-C", str(segment.folder), f"ECDAQ_RUN_DIR={segment.run_dir}"],
            *[program, *words[1:], *more],
        )
        assert got.stderr == "" or "rows" in got.stderr, command
        return got.stdout

    look, scan, check, diff, watch, export, head = commands()
    segment.start_sim()
    segment.start_daemon("--interface", "ecat0")
    segment.wait_for_op()
    assert len(run(look).splitlines()) == 9
    run(scan)
    file = segment.folder / "machine.yaml"
    written = yaml.safe_load(file.read_text())
    wanted = yaml.safe_load(edited)
    for key in IDENTITY:
        assert [s[key] for s in wanted["slaves"]] == [s[key] for s in written["slaves"]]
    assert wanted["bus"] == written["bus"]
    assert segment.stop("daemon") == 0

    file.write_text(edited)
    assert run(check) == "machine.yaml: valid\n"
    segment.start_daemon("--config", str(file))
    segment.wait_for_op()
    segment.start_recorder()
    assert run(diff) == "configuration and bus agree\n"
    assert "pressure.tank" in run(watch)
    segment.wait_for_cycles(1500, 60)
    assert segment.stop("daemon") == 0
    assert segment.stop("recorder") == 0

    run(export)
    assert run(head) == (
        "cycle,utc_ns,pressure.tank [bar],temperature.tank [degC],setpoint.pump [V]\n"
    )
    with (segment.folder / "machine.csv").open() as table:
        rows = list(csv.DictReader(table))
    # 1 V +-0.5 V of the simulated signal: 1 bar a volt, 10 degC a volt.
    for column, low, high in (
        ("pressure.tank [bar]", 0.5, 1.5),
        ("temperature.tank [degC]", 5, 15),
    ):
        values = [float(row[column]) for row in rows if row[column]]
        assert len(values) > 1000
        assert abs(min(values) - low) < 0.05 * high and abs(max(values) - high) < 0.05 * high, (
            column
        )
