# SPDX-License-Identifier: MIT
"""A function that runs in a process of its own, beside this one."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterable
from multiprocessing.connection import Connection, wait
from typing import Generic, TypeVar

from processes import adopt_orphans

Result = TypeVar("Result")


class Beside(Generic[Result]):
    """Started at once; result() waits for it. Ended with this process, by SIGTERM."""

    def __init__(self, function: Callable[[], Result]) -> None:
        context = multiprocessing.get_context("fork")
        self.connection, there = context.Pipe()
        self._process = context.Process(
            target=self._work, args=(function, self.connection, there), daemon=True
        )
        self._process.start()
        there.close()

    @staticmethod
    def _work(function: Callable[[], Result], here: Connection, there: Connection) -> None:
        here.close()
        adopt_orphans()
        there.send(function())
        # The CPU time of a child counts from its end on: not before the result is wanted.
        there.recv()

    def result(self) -> Result | None:
        """What the function returned; None if it ended without."""
        try:
            result = self.connection.recv()
            self.connection.send(None)
        except EOFError:
            result = None
        self.connection.close()
        self._process.join()
        return result


def wait_for_any(running: Iterable[Beside[Result]]) -> list[Beside[Result]]:
    """Wait until at least one has its result or has ended without; those."""
    connections = {one.connection: one for one in running}
    return [connections[ready] for ready in wait(connections) if isinstance(ready, Connection)]
