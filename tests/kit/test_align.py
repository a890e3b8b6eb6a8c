# SPDX-License-Identifier: MIT
"""ecdaq.align(): recordings of two appliances side by side, by UTC."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import ecdaq
import numpy as np
import pytest
from ecdaq.clock import ClockAt, clock_of
from made import BIN, PERIOD_NS, files

TAI_NS = 1_900_000_000 * 10**9
# The second appliance begins so much later: 1234 cycles and 0.4 of one.
LATER_NS = 1_234_400_000
CYCLES = 5000

Make = Callable[..., Path]


def of(
    recorded: Make, name: str, tai_ns: int, first: int, *more: str, clock: str = ""
) -> ecdaq.Recording:
    words = ("--cycles", str(CYCLES), "--first", str(first), "--tai", str(tai_ns), *more)
    return ecdaq.read(recorded(*words, folder=name, clock=clock))


@pytest.fixture
def both(recorded: Make) -> dict[str, ecdaq.Recording]:
    return {
        "left": of(recorded, "left", TAI_NS, 1000),
        "right": of(recorded, "right", TAI_NS + LATER_NS, 1, "--skip", "100:10", "--bad", "50"),
    }


def expected_cycle(left: np.ndarray) -> np.ndarray:
    """Of the right one: its cycle 1 is LATER_NS behind cycle 1000 of the left one."""
    return 1 + np.rint(((left - 1000) * PERIOD_NS - LATER_NS) / PERIOD_NS).astype(int)


def test_each_row_has_the_sample_that_was_taken_nearest_to_it(
    both: dict[str, ecdaq.Recording],
) -> None:
    frame = ecdaq.align(both).to_pandas()
    cycles = expected_cycle(frame["cycle"].to_numpy())
    # Only the time that both have, which ends with the left one.
    assert frame["cycle"].iloc[-1] == 1000 + CYCLES - 1
    assert frame["cycle"].iloc[0] in (2234, 2235) and len(frame) >= CYCLES - 1236
    assert (frame["left.piccolo0.counter"] == frame["cycle"]).all()
    found = frame["right.piccolo0.counter"]
    has = found.notna()
    assert (found[has] == cycles[has]).all()
    # The gap of the right one: no sample is stretched over it.
    assert sorted(set(cycles[~has])) == list(range(100, 110))
    assert frame["right.distance_ns"].isna().tolist() == (~has).tolist()


def test_the_stated_error_covers_the_true_one(both: dict[str, ecdaq.Recording]) -> None:
    aligned = ecdaq.align(both)
    cycles = expected_cycle(aligned.table.cycle)
    true_ns = LATER_NS + (cycles - 1) * PERIOD_NS - (aligned.table.cycle - 1000) * PERIOD_NS
    has = aligned.has("right")
    off_ns = np.abs(aligned.distance_ns["right"] - true_ns)[has]
    error_ns = aligned.error_ns["right"][has]
    assert (off_ns <= error_ns).all()
    # Two times half of a round trip of 30 us at least, and a bound that means something.
    assert (error_ns >= 30_000).all() and (error_ns < PERIOD_NS).all()


def test_samples_that_are_not_good_are_missing(both: dict[str, ecdaq.Recording]) -> None:
    aligned = ecdaq.align(both)
    bad = expected_cycle(aligned.table.cycle) % 50 == 0
    column = aligned.table.columns["right.piccolo1.adc"]
    assert bad.any() and np.isnan(column.values[bad]).all()
    assert column.valid.tolist() == (~bad & aligned.has("right")).tolist()


def test_units_and_gaps_say_whose_they_are(both: dict[str, ecdaq.Recording]) -> None:
    aligned = ecdaq.align(both)
    assert aligned.to_pandas().attrs["units"]["right.piccolo0.adc"] == "V"
    assert [(g.slave, g.first_cycle, g.count) for g in aligned.table.gaps] == [("right", 100, 10)]
    assert "2 appliances" in repr(aligned) and "right: " in repr(aligned)


def test_appliances_without_a_common_time_are_refused(recorded: Make) -> None:
    left = of(recorded, "left", TAI_NS, 1)
    right = of(recorded, "right", TAI_NS + CYCLES * 2 * PERIOD_NS, 1)
    with pytest.raises(ValueError, match="left, right have no time in common"):
        ecdaq.align({"left": left, "right": right})
    with pytest.raises(ValueError, match="two appliances"):
        ecdaq.align({"left": left})


# As chrony leaves it, and as phc2sys does: error and estimate in us, TAI offset.
CHRONY, PTP = "12000 800 0", "500 0 0"


def test_the_error_of_both_hosts_clocks_is_in_the_stated_error(recorded: Make) -> None:
    left = of(recorded, "left", TAI_NS, 1000, clock=CHRONY)
    right = of(recorded, "right", TAI_NS + LATER_NS, 1, clock=PTP)
    free = of(recorded, "free", TAI_NS + LATER_NS, 1, clock="unset")
    assert (left.clock.error_ns, left.clock.estimate_ns) == (12_000_000, 800_000)
    assert (right.clock.error_ns, right.clock.estimate_ns) == (500_000, 0)
    assert left.clock.is_disciplined
    assert left.clock.total_ns == left.clock.uncertainty_ns + 12_000_000 > 12_000_000
    assert not free.clock.is_disciplined
    assert (free.clock.error_ns, free.clock.estimate_ns, free.clock.total_ns) == (None, None, None)

    aligned = ecdaq.align({"left": left, "right": right})
    error_ns = aligned.error_ns["right"]
    assert aligned.undisciplined == [] and "disciplines" not in repr(aligned)
    assert (error_ns >= 12_500_000 + 30_000).all() and (error_ns < 13_500_000).all()

    loose = ecdaq.align({"left": left, "free": free})
    assert loose.undisciplined == ["free"]
    assert loose.to_pandas().attrs["undisciplined"] == ["free"]
    assert "free: nothing disciplines its clock" in repr(loose)
    assert (loose.error_ns["free"] >= 12_030_000).all()
    assert (loose.error_ns["free"] < 13_000_000).all()


def test_a_recording_that_does_not_state_the_clock_is_taken_for_undisciplined() -> None:
    messages = {
        "log_time_ns": np.array([10, 20], np.uint64), "uncertainty_ns": np.array([5, 7]),
        "tai_offset_s": np.array([37, 37]), "steps": np.array([0, 1]),
    }  # fmt: skip
    clock = clock_of(messages, "old.mcap")
    assert clock == ecdaq.Clock(7, None, None, 37, 1)
    messages["clock_error_ns"] = np.array([None, 3], object)
    messages["clock_estimate_ns"] = np.array([2, 3])
    assert clock_of(messages, "mixed.mcap") == ecdaq.Clock(7, None, 3, 37, 1)
    at = ClockAt(messages, "mixed.mcap", np.array([9, 15, 21]))
    assert at.is_disciplined.tolist() == [False, False, True]
    assert at.error_ns.tolist() == [0, 3, 3] and at.uncertainty_ns.tolist() == [5, 7, 7]


def info(path: Path) -> str:
    words = [BIN / "ecdaq", "log", "info", path]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout


def test_the_clock_is_in_the_metadata_at_start_and_end(recorded: Make) -> None:
    said = info(*files(recorded("--cycles", "300", clock=CHRONY)))
    assert said.count("  clock_error_ns: 12000000\n") == 2
    assert said.count("  clock: disciplined (chrony, linuxptp)") == 2
    said = info(*files(recorded("--cycles", "300", folder="free", clock="unset")))
    assert said.count("  clock: nothing disciplines the host's clock") == 2
