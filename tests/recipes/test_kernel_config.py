# SPDX-License-Identifier: MIT
"""The kernel's fragments have the drivers that the boards and the documentation need. The build of
the kernel checks that the final configuration has what the fragments request (kconfig.py)."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from conftest import TOP
from graph import Graph, Task
from kconfig import read
from metadata import Metadata

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
        ("verity of a bundle", ("BLK_DEV_DM", "DM_VERITY", "CRYPTO_SHA256")),
        ("contents of a bundle", ("SQUASHFS", "SQUASHFS_ZSTD", "SQUASHFS_ZLIB")),
        ("bundle in a file, over HTTP", ("BLK_DEV_LOOP", "BLK_DEV_NBD")),
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


def test_wifi_is_built_on_request_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the request neither the kernel nor an image changes."""

    def parsed(name: str) -> Metadata:
        settings = {"MACHINE": "ecdaq-raspberrypi4-64", "DISTRO": "ecdaq", "TMPDIR": "/tmp"}
        return Metadata(TOP, tmp_path / name, settings | {"ECDAQ_TOP": str(TOP)})

    monkeypatch.delenv("ECDAQ_WIFI", raising=False)
    without = parsed("without")
    monkeypatch.setenv("ECDAQ_WIFI", "1")
    wifi = parsed("wifi")
    packages = {
        m: set(m.recipes["ecdaq-image"].value("IMAGE_PREINSTALL").split()) for m in (without, wifi)
    }
    assert packages[wifi] - packages[without] == {
        *("wpasupplicant", "wireless-regdb", "firmware-brcm80211")
    }
    kernels = [m.recipes["linux-ecdaq"] for m in (without, wifi)]
    fragments = [k.value("KERNEL_FRAGMENTS").split() for k in kernels]
    assert "wifi.cfg" not in fragments[0] and fragments[1] == [*fragments[0], "wifi.cfg"]
    assert ["allow_wifi" in k.flag("do_unpack", "postfuncs") for k in kernels] == [False, True]
    graphs = [Graph(m).hash(Task("linux-ecdaq", "do_dpkg_build")) for m in (without, wifi)]
    assert graphs[0] != graphs[1]
    # What the function takes away is what would contradict the fragment.
    assert ASKED["CONFIG_WLAN"] == "n"
    optional = read(TOP / "kernel-config/optional/wifi.cfg")
    assert {name for name in optional if name in ASKED} == {"CONFIG_WLAN"}
