# SPDX-License-Identifier: MIT
"""A hostile writer of the board of ecdaq-dds does not stop the master."""

from __future__ import annotations

import contextlib
import ctypes
import mmap
import os
import socket
from collections.abc import Callable

import pytest
from bench import Bench

KEEP_SIZE, PUNCH_HOLE = 1, 2


def take_board(bench: Bench) -> int:
    """What the master sends to a process that may connect."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as link:
        link.settimeout(10)
        link.connect(str(bench.segment.run_dir / "commands-remote"))
        _, descriptors, _, _ = socket.recv_fds(link, 1, 1)
    assert len(descriptors) == 1
    return descriptors[0]


def test_hostile_writer_of_the_board_cannot_end_the_master(
    make_bench: Callable[..., Bench],
) -> None:
    bench = make_bench()
    bench.segment.start_all()
    board = take_board(bench)
    size = os.fstat(board).st_size
    for length in (0, 4096, 2 * size):
        with pytest.raises(PermissionError):
            os.ftruncate(board, length)
    with mmap.mmap(board, size) as page:
        for n in range(200):
            page[:] = os.urandom(size)
            page[24] = 2 * n % 256  # a complete set, by its number
    fallocate = ctypes.CDLL(None, use_errno=True).fallocate64
    fallocate.argtypes = [ctypes.c_int, ctypes.c_int, ctypes.c_int64, ctypes.c_int64]
    for _ in range(20):
        fallocate(board, PUNCH_HOLE | KEEP_SIZE, 0, size)
    os.close(board)
    # Whoever connects again and again, and does not listen, is no trouble either.
    for _ in range(100):
        with (
            contextlib.suppress(BlockingIOError),
            socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as link,
        ):
            link.setblocking(False)
            link.connect(str(bench.segment.run_dir / "commands-remote"))
    bench.segment.wait_for_cycles(1000, 30)
    bench.segment.wait_for_op()  # of the same ecdaqd
    assert bench.segment.stop("daemon") == 0
    assert bench.segment.stop("recorder") == 0
