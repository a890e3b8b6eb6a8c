# SPDX-License-Identifier: MIT
"""A function that runs in a process of its own, beside this one."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Generic, TypeVar

from processes import adopt_orphans

Result = TypeVar("Result")


class Beside(Generic[Result]):
    """Started at once; result() waits for it. Ended with this process, by SIGTERM."""

    def __init__(self, function: Callable[[], Result]) -> None:
        context = multiprocessing.get_context("fork")
        self._here, there = context.Pipe()
        self._process = context.Process(
            target=self._work, args=(function, self._here, there), daemon=True
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
            result = self._here.recv()
            self._here.send(None)
        except EOFError:
            result = None
        self._here.close()
        self._process.join()
        return result
