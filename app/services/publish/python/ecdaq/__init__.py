# SPDX-License-Identifier: MIT
"""Recordings of an ecdaq appliance, its samples and commands over DDS, for Python.

import ecdaq
frame = ecdaq.read("build/run/record").to_pandas()
with ecdaq.connect(interface="eth0") as link:
    print(link.channels())
    for sample in link.subscribe(seconds=1):
        print(sample.cycle, sample.adc)
"""

import importlib
from typing import TYPE_CHECKING, Any

import ecdaq._private_path  # noqa: F401, before any foreign package
from ecdaq.errors import (
    InterfaceError,
    LinkError,
    MissingExtraError,
    NoAnswerError,
    RecordingError,
    RefusedError,
)

if TYPE_CHECKING:
    from ecdaq.aligned import Aligned, align
    from ecdaq.clock import Clock
    from ecdaq.link import Channel, Channels, Link, connect
    from ecdaq.recording import Recording, read
    from ecdaq.series import Gaps, Series
    from ecdaq.sine import Signal, SineFit, fit_sine
    from ecdaq.table import Gap

__all__ = [
    "Aligned",
    "Channel",
    "Channels",
    "Clock",
    "Gap",
    "Gaps",
    "InterfaceError",
    "Link",
    "LinkError",
    "MissingExtraError",
    "NoAnswerError",
    "Recording",
    "RecordingError",
    "RefusedError",
    "Series",
    "Signal",
    "SineFit",
    "align",
    "connect",
    "fit_sine",
    "read",
]
__version__ = "0.1.0"

# Imported when first used: reading needs no DDS, and DDS no numpy.
_MODULES = {
    "aligned": ("Aligned", "align"),
    "clock": ("Clock",),
    "link": ("Channel", "Channels", "Link", "connect"),
    "recording": ("Recording", "read"),
    "series": ("Gaps", "Series"),
    "sine": ("Signal", "SineFit", "fit_sine"),
    "table": ("Gap",),
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'ecdaq' has no attribute {name!r}")
    return getattr(importlib.import_module(f"ecdaq.{_MODULE_OF[name]}"), name)
