# SPDX-License-Identifier: MIT
"""Samples and commands of an ecdaq appliance over DDS, for Python.

import ecdaq
with ecdaq.connect(interface="eth0") as link:
    print(link.channels())
    for sample in link.subscribe(seconds=1):
        print(sample.cycle, sample.adc)
"""

from ecdaq.errors import InterfaceError, LinkError, NoAnswerError, RefusedError
from ecdaq.link import Channel, Channels, Link, connect
from ecdaq.series import Gaps, Series

__all__ = [
    "Channel",
    "Channels",
    "Gaps",
    "InterfaceError",
    "Link",
    "LinkError",
    "NoAnswerError",
    "RefusedError",
    "Series",
    "connect",
]
__version__ = "0.1.0"
