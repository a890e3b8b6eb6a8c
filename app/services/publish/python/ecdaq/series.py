# SPDX-License-Identifier: MIT
"""Gaps in samples, and samples as columns for numpy and pandas."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from ecdaq.link import Channels


class Sampled(Protocol):
    """The members of a sample from any source."""

    slave: int
    session: int
    cycle: int
    dc_time_ns: int
    utc_ns: int
    flags: int
    is_good: bool
    adc: float
    counter: int
    sample_time_ns: int
    values: Any
    raw: Any


@dataclass
class Gaps:
    """Missing cycles of each slave. A new session of the master is not a gap."""

    gaps: int = 0
    missing: int = 0
    doubled: int = 0
    spans: list[tuple[int, int, int]] = field(default_factory=list)  # slave, first, count
    newest: dict[int, tuple[int, int]] = field(default_factory=dict)

    def take(self, sample: Sampled) -> int:
        """Count one sample. Returns how many cycles are missing before it."""
        session, cycle = self.newest.get(sample.slave, (sample.session, sample.cycle - 1))
        if session != sample.session:
            cycle = sample.cycle - 1
        missing = sample.cycle - cycle - 1
        if missing < 0:
            self.doubled += 1
            return 0
        if missing > 0:
            self.gaps += 1
            self.missing += missing
            self.spans.append((sample.slave, cycle + 1, missing))
        self.newest[sample.slave] = (sample.session, sample.cycle)
        return missing


class Series:
    """The samples of one slave."""

    def __init__(self, slave: int, channels: Channels | None = None) -> None:
        self.slave = slave
        self.channels = channels
        self.samples: list[Sampled] = []

    def extend(self, samples: Iterable[Sampled]) -> None:
        self.samples += [s for s in samples if s.slave == self.slave]

    def columns(self) -> dict[str, list[Any]]:
        """One list per field; channels, where they are known, by their name without the slave's."""
        found: dict[str, list[Any]] = {
            name: [getattr(s, name) for s in self.samples]
            for name in ("cycle", "dc_time_ns", "utc_ns", "flags", "is_good")
        }
        for channel in self.channels.of_slave(self.slave) if self.channels else []:
            found[channel.entry] = [channel.value(s) for s in self.samples]
        return found

    def to_numpy(self) -> dict[str, Any]:
        import numpy as np

        return {name: np.asarray(column) for name, column in self.columns().items()}

    def to_pandas(self) -> Any:
        """A DataFrame with UTC as its index."""
        import pandas as pd

        frame = pd.DataFrame(self.columns())
        frame.index = pd.to_datetime(frame.pop("utc_ns"), unit="ns", utc=True)
        return frame
