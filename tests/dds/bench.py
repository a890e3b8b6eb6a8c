# SPDX-License-Identifier: MIT
"""An appliance in one network namespace, a PC in another, a veth pair between them for DDS."""

from __future__ import annotations

import csv
import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


def load_segment() -> ModuleType:
    """tests/live/segment.py, by its path: each group of tests has a path of its own."""
    spec = importlib.util.spec_from_file_location(
        "live_segment", ROOT / "tests" / "live" / "segment.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["live_segment"] = module
    spec.loader.exec_module(module)
    return module


live = load_segment()
wait_for = live.wait_for
KIT = live.BIN.parent / "share" / "ecdaq" / "python"  # installed: with the generated types
BUILD = Path(os.environ.get("ECDAQ_BUILD", ROOT / "build" / "release"))

DDS_SETTINGS = {
    "dds.enable": "on",
    "dds.interface": "dds0",
    "dds.domain": "7",
    "dds.allow_insecure_commands": "on",
}


# Of a refusal, where the machine does not run the master or the commander for a while.
PASSING_REASONS = (
    "not taken by the master in time",
    "the commander is not alive",
    "not in OP",
    "no answer",
    "no reply within",
)


def is_passing(answer: dict[str, Any]) -> bool:
    """A refusal that says nothing of the command."""
    return not answer["accepted"] and any(why in answer["reason"] for why in PASSING_REASONS)


class Commander:
    """command_python.py, spoken to in JSON."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self.process = process
        self.channels: list[str] = self._answer()["ready"]

    def _answer(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        assert line, "the commander ended"
        return json.loads(line)

    def command(self, values: dict[str, float], **more: Any) -> dict[str, Any]:
        assert self.process.stdin is not None
        self.process.stdin.write((json.dumps({"values": values} | more) + "\n").encode())
        self.process.stdin.flush()
        return self._answer()

    def settled(self, values: dict[str, float], **more: Any) -> dict[str, Any]:
        """The answer to a command; one that only a busy machine refuses is repeated for a while."""

        def answer() -> dict[str, Any]:
            got = self.command(values, **more)
            return {} if is_passing(got) else got

        return wait_for(f"answer to {values}", answer, 60)

    def accepted(self, values: dict[str, float]) -> int:
        """The cycle of a command that has to pass."""
        answer = self.settled(values)
        assert answer["accepted"], answer
        return answer["cycle"]

    def kill(self) -> None:
        self.process.kill()
        self.process.wait(10)


class Bench:
    """The appliance's programs (live.Segment) and those on the PC."""

    def __init__(self, folder: Path, settings: dict[str, str] | None = None) -> None:
        self.folder = folder
        self.segment = live.Segment(folder, settings=DDS_SETTINGS | (settings or {}))
        self.pc = live.Namespace()
        self.started: list[subprocess.Popen[bytes]] = []
        self._wire()

    def _wire(self) -> None:
        appliance = self.segment.space
        appliance.run("ip", "link", "add", "dds0", "type", "veth", "peer", "name", "dds1")
        # Moved by the PC's pid, which both namespaces know.
        appliance.run("ip", "link", "set", "dds1", "netns", str(self.pc.holder.pid))
        for space, nic, address in ((appliance, "dds0", 1), (self.pc, "dds1", 2)):
            space.run("ip", "link", "set", "lo", "up")
            space.run("ip", "address", "add", f"10.77.0.{address}/24", "dev", nic)
            space.run("ip", "link", "set", nic, "multicast", "on", "up")
            space.run("ip", "route", "add", "224.0.0.0/4", "dev", nic)

    def start_all(self) -> None:
        self.segment.start_all()
        self.start_dds()

    def start_dds(self, sessions: int = 1) -> None:
        """Returns when ecdaq-dds, this one or those before, have reported so many sessions."""
        process = self.segment.start("dds", str(live.BIN / "ecdaq-dds"), *self.segment.options())

        def is_publishing() -> bool:
            message = self.segment.log("dds")
            assert process.poll() is None, message
            return message.count("publishing session") >= sessions

        wait_for("ecdaq-dds' session", is_publishing, 20)

    def wait_for_subscribers(self, count: int) -> int:
        """Returns when ecdaq-dds knows so many readers of ecdaq/sample and ecdaq/block: a cycle,
        of later ones it repeats for each of them what got lost.

        Not more: one that ended without a word is known until its lease is over. Where others read
        already, a reader may get samples before that; of those, some may be missing, and are not
        repeated.
        """
        pid = self.segment.processes["dds"].pid

        def are_known() -> bool:
            dds = self.segment.status().get("dds") or {"pid": 0}
            return dds["pid"] == pid and dds["subscribers"] == count

        wait_for(f"{count} subscribers in the list of ecdaq-dds", are_known, 60)
        return self.segment.status()["cycle_number"]

    def logs(self) -> dict[str, str]:
        return {path.stem: path.read_text() for path in self.folder.glob("*.log")}

    def on_pc(self, name: str, *command: str) -> subprocess.Popen[bytes]:
        process: subprocess.Popen[bytes] = self.pc.start(*command, log=self.folder / f"{name}.log")
        self.started.append(process)
        return process

    def python(self, name: str, script: str, *arguments: str) -> subprocess.Popen[bytes]:
        """A program of this folder on the PC, with the kit."""
        paths = os.pathsep.join(p for p in (str(KIT), os.environ.get("PYTHONPATH")) if p)
        program = str(Path(__file__).parent / script)
        return self.on_pc(name, "env", f"PYTHONPATH={paths}", sys.executable, program, *arguments)

    def module(self, name: str, module: str, *arguments: str) -> subprocess.Popen[bytes]:
        """python -m @module on the PC, with the kit."""
        paths = os.pathsep.join(p for p in (str(KIT), os.environ.get("PYTHONPATH")) if p)
        return self.on_pc(
            name, "env", f"PYTHONPATH={paths}", sys.executable, "-m", module, *arguments
        )

    def commander(self) -> Commander:
        """A commander on the PC, driven by lines on its input (command_python.py)."""
        paths = os.pathsep.join(p for p in (str(KIT), os.environ.get("PYTHONPATH")) if p)
        program = str(Path(__file__).parent / "command_python.py")
        with (self.folder / "commander.log").open("ab") as errors:
            process = subprocess.Popen(
                [
                    *self.pc.enter,
                    "env",
                    f"PYTHONPATH={paths}",
                    sys.executable,
                    program,
                    "dds1",
                    DDS_SETTINGS["dds.domain"],
                ],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
            )
        self.started.append(process)
        return Commander(process)

    def log(self, name: str) -> str:
        path = self.folder / f"{name}.log"
        return path.read_text() if path.exists() else ""

    def close(self) -> None:
        for process in self.started:
            if process.poll() is None:
                process.kill()
                process.wait(10)
        dds = self.segment.processes.pop("dds", None)
        if dds is not None and dds.poll() is None:
            dds.terminate()
            try:
                dds.wait(20)
            except subprocess.TimeoutExpired:
                dds.kill()
                dds.wait(10)
        self.pc.close()
        self.segment.close()


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))
