# SPDX-License-Identifier: MIT
"""Run tasks: stamps record what is done, kept results are restored instead of made again."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
import traceback
from dataclasses import dataclass, field
from pathlib import Path

from graph import Graph, Task

STILL_EVERY_S = 60.0
# Of each task of a recipe this many kept results stay, those that were used last.
RESULTS_KEPT = 8


def copy_tree(source: Path, target: Path) -> None:
    """Unchanged; holes take no space: a disk image is mostly holes."""
    target.parent.mkdir(parents=True, exist_ok=True)
    subprocess.run(["cp", "-a", "--reflink=auto", "--sparse=always", source, target], check=True)


class BuildError(Exception):
    """A task failed; the message names it and its log."""


@dataclass
class Running:
    """A task in a process of its own."""

    task: Task
    started: float
    reported: float = field(default=0.0)


class Executor:
    """Runs a task and what it needs, at most `jobs` at a time."""

    def __init__(self, graph: Graph, cache: Path, jobs: int) -> None:
        self.graph = graph
        self.objects = cache / "objects"
        self.jobs = jobs
        self.running: dict[int, Running] = {}
        self.failed: list[Task] = []
        self.count = 0

    def _stamp(self, task: Task) -> Path:
        return Path(self.graph.recipe(task).value("STAMP")) / task.name

    def _object(self, task: Task) -> Path:
        return self.objects / task.recipe / f"{task.name}-{self.graph.hash(task)[:24]}"

    def _kept(self, task: Task) -> Path | None:
        keep = self.graph.recipe(task).flag(task.name, "keep")
        return Path(keep) if keep else None

    def is_done(self, task: Task) -> bool:
        """Whether its stamp has the hash of these inputs."""
        stamp = self._stamp(task)
        if self.graph.recipe(task).flag(task.name, "nostamp"):
            return False
        return stamp.exists() and stamp.read_text() == self.graph.hash(task)

    def _write_stamp(self, task: Task) -> None:
        stamp = self._stamp(task)
        stamp.parent.mkdir(parents=True, exist_ok=True)
        stamp.write_text(self.graph.hash(task))

    def plan(self, goal: Task) -> list[Task]:
        """What has to run for `goal`, in order; nothing below an existing result."""
        order: list[Task] = []
        seen: set[Task] = set()

        def visit(task: Task) -> None:
            if task in seen:
                return
            seen.add(task)
            if self.is_done(task) or self._object(task).exists():
                if not self.is_done(task):
                    order.append(task)
                return
            for other in self.graph.needs(task):
                visit(other)
            order.append(task)

        visit(goal)
        return order

    def _restore(self, task: Task) -> None:
        kept = self._kept(task)
        assert kept is not None
        shutil.rmtree(kept, ignore_errors=True)
        copy_tree(self._object(task), kept)
        os.utime(self._object(task))

    def _keep(self, task: Task) -> None:
        kept = self._kept(task)
        if kept is None:
            return
        target = self._object(task)
        part = target.with_name(target.name + f".part-{os.getpid()}")
        shutil.rmtree(part, ignore_errors=True)
        part.parent.mkdir(parents=True, exist_ok=True)
        copy_tree(kept, part)
        shutil.rmtree(target, ignore_errors=True)
        part.rename(target)
        os.utime(target)
        self.make_room(task)

    def make_room(self, task: Task) -> None:
        """Kept results of `task` that were not used for long go."""
        kept = self._object(task).parent.glob(f"{task.name}-*")
        for old in sorted(kept, key=lambda p: p.stat().st_mtime)[:-RESULTS_KEPT]:
            shutil.rmtree(old, ignore_errors=True)

    def _child(self, task: Task) -> int:
        """In a process of its own: BitBake changes environment, folder and descriptors."""
        bb = self.graph.metadata.bb
        if self._object(task).exists():
            self._restore(task)
            return 0
        data = self.graph.recipe(task).data.createCopy()
        os.environ.clear()
        os.environ.update(bb.utils.build_environment(data) or {})
        for name in list(data.keys()):
            if data.getVarFlag(name, "export", False) and data.getVar(name) is not None:
                os.environ[name] = data.getVar(name)
        data.setVarFlag(task.name, "nostamp", "1")
        status = bb.build.exec_task(str(self.graph.recipe(task).file), task.name, data)
        if status == 0:
            self._keep(task)
        return int(status)

    def _start(self, task: Task, total: int) -> None:
        self.count += 1
        if self.graph.recipe(task).flag(task.name, "noexec"):
            self._write_stamp(task)
            return
        verb = "restore " if self._object(task).exists() else ""
        print(f"[{self.count}/{total}] {verb}{task}", flush=True)
        self._stamp(task).unlink(missing_ok=True)
        pid = os.fork()
        if pid == 0:
            status = 1
            try:
                status = self._child(task)
            except Exception:
                traceback.print_exc()
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
        now = time.monotonic()
        self.running[pid] = Running(task, now, now)

    def _finish(self, pid: int, status: int) -> Task:
        run = self.running.pop(pid)
        spent = time.monotonic() - run.started
        if os.waitstatus_to_exitcode(status) == 0:
            self._write_stamp(run.task)
            if spent >= 1:
                print(f"      {run.task}: {spent:.0f} s", flush=True)
        else:
            self.failed.append(run.task)
            print(f"      {run.task}: failed after {spent:.0f} s", flush=True)
        return run.task

    def _wait(self) -> Task | None:
        """The next task that ends; prints once a minute which are still running."""
        while True:
            pid, status = os.waitpid(-1, os.WNOHANG)
            if pid in self.running:
                return self._finish(pid, status)
            now = time.monotonic()
            for run in self.running.values():
                if now - run.reported >= STILL_EVERY_S:
                    run.reported = now
                    print(f"      {run.task}: {now - run.started:.0f} s so far", flush=True)
            time.sleep(0.05)

    def log_of(self, task: Task) -> Path:
        """The log of a task, as BitBake writes it."""
        return Path(self.graph.recipe(task).value("T")) / f"log.{task.name}"

    def run(self, goal: Task) -> int:
        """Run what `goal` needs. The number of tasks that ran; BuildError if one failed."""
        order = self.plan(goal)
        waiting = {t: {o for o in self.graph.needs(t) if o in order} for t in order}
        for task in order:
            if self._object(task).exists():
                waiting[task] = set()
        while waiting or self.running:
            ready = [t for t in order if t in waiting and not waiting[t]]
            while ready and len(self.running) < self.jobs and not self.failed:
                task = ready.pop(0)
                del waiting[task]
                before = len(self.running)
                self._start(task, len(order))
                if len(self.running) == before:
                    self._release(waiting, task)
                    ready = [t for t in order if t in waiting and not waiting[t]]
            if self.running:
                ended = self._wait()
                if ended is not None and ended not in self.failed:
                    self._release(waiting, ended)
            elif self.failed:
                break
        if self.failed:
            raise BuildError("\n".join(self._report(task) for task in self.failed))
        return len(order)

    @staticmethod
    def _release(waiting: dict[Task, set[Task]], done: Task) -> None:
        for others in waiting.values():
            others.discard(done)

    def _report(self, task: Task) -> str:
        log = self.log_of(task)
        text = log.read_text(errors="replace") if log.exists() else ""
        tail = "\n".join("    " + line for line in text.splitlines()[-25:])
        return f"{task} failed; its log is {log}\n{tail}"
