# SPDX-License-Identifier: MIT
"""The kernel's fragments have the drivers that the boards and the documentation need. The build of
the kernel checks that the final configuration has what the fragments request (kconfig.py)."""

from __future__ import annotations

import re

import pytest
from conftest import TOP
from kconfig import read

FRAGMENTS = sorted((TOP / "kernel-config").glob("*.cfg"))
ASKED = {name: value for path in FRAGMENTS for name, (value, _) in read(path).items()}
DRIVERS = {
    "ax88179_178a": "USB_NET_AX88179_178A",
    "asix": "USB_NET_AX8817X",
    "aqc111": "USB_NET_AQC111",
    "cdc_ether": "USB_NET_CDCETHER",
    "cdc_ncm": "USB_NET_CDC_NCM",
    "e1000e": "E1000E",
    "igb": "IGB",
    "igc": "IGC",
    "lan78xx": "USB_LAN78XX",
    "r8152": "USB_RTL8152",
    "r8169": "R8169",
    "smsc95xx": "USB_NET_SMSC95XX",
}
# Checks of memory that cost the cycle nothing; what no program of ours uses; what costs each cycle.
HARDENING = (
    *("FORTIFY_SOURCE", "HARDENED_USERCOPY", "LIST_HARDENED", "RANDOMIZE_BASE", "SECCOMP_FILTER"),
    *("SLAB_FREELIST_HARDENED", "SLAB_FREELIST_RANDOM", "STACKPROTECTOR_STRONG"),
    *("STRICT_KERNEL_RWX", "STRICT_MODULE_RWX", "UNMAP_KERNEL_AT_EL0", "VMAP_STACK"),
)
UNUSED = ("DEBUG_FS", "DEVMEM", "IO_URING", "LEGACY_PTYS", "LEGACY_TIOCSTI")
COSTLY = ("INIT_ON_ALLOC_DEFAULT_ON", "RANDOMIZE_KSTACK_OFFSET_DEFAULT")
SYSCTL_NEEDS = {
    "net.core.bpf_jit_harden": "BPF_JIT",
    "kernel.unprivileged_bpf_disabled": "BPF_SYSCALL",
    "kernel.dmesg_restrict": "PRINTK",
}
SYSCTL = TOP / "recipes/recipes-core/ecdaq-config/files/root/usr/lib/sysctl.d/60-ecdaq.conf"


def documented_drivers() -> list[str]:
    """The last column of the table of network adapters."""
    text = (TOP / "app/doc/how-to/image.md").read_text()
    section = text.partition("## Network adapters\n")[2].partition("\n## ")[0]
    rows = [line for line in section.splitlines() if line.startswith("| ")]
    return [name for row in rows[2:] for name in re.findall(r"`(\w+)`", row)]


def test_every_adapter_of_the_documentation_has_its_driver() -> None:
    names = documented_drivers()
    assert set(names) == set(DRIVERS)
    assert [n for n in names if ASKED.get(f"CONFIG_{DRIVERS[n]}") not in ("y", "m")] == []


@pytest.mark.parametrize(
    ("purpose", "symbols"),
    [
        ("SD card", ("MMC_SDHCI_IPROC", "MMC_BLOCK")),
        ("USB disk", ("USB", "USB_XHCI_PCI", "USB_STORAGE", "USB_UAS", "SCSI", "BLK_DEV_SD")),
        ("USB of a compute module", ("USB_DWC2", "USB_XHCI_PLATFORM", "NOP_USB_XCEIV")),
        ("NVMe disk", ("PCIE_BRCMSTB", "BLK_DEV_NVME")),
        ("clock chip", ("I2C_BCM2835", "I2C_MUX_PINCTRL", "RTC_DRV_PCF85063", "RTC_HCTOSYS")),
        ("clock chip set", ("RTC_SYSTOHC",)),
    ],
)
def test_what_is_needed_before_modules_can_be_loaded_is_built_in(
    purpose: str, symbols: tuple[str, ...]
) -> None:
    assert ASKED["CONFIG_BLK_DEV_INITRD"] == "n"
    assert {s: ASKED.get(f"CONFIG_{s}") for s in symbols} == dict.fromkeys(symbols, "y"), purpose


def test_every_sysctl_has_the_kernel_feature_that_it_sets() -> None:
    keys = re.findall(r"^([\w.]+) =", SYSCTL.read_text(), re.MULTILINE)
    needed = {key: SYSCTL_NEEDS[key] for key in keys if key in SYSCTL_NEEDS}
    assert len(needed) >= 2
    assert [k for k, symbol in needed.items() if ASKED.get(f"CONFIG_{symbol}") != "y"] == []


def test_the_kernel_is_hardened_where_that_costs_no_latency() -> None:
    wanted = dict.fromkeys(HARDENING, "y") | dict.fromkeys((*UNUSED, *COSTLY), "n")
    assert {symbol: ASKED.get(f"CONFIG_{symbol}") for symbol in wanted} == wanted
