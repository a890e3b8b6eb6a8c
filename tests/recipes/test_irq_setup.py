# SPDX-License-Identifier: MIT
"""The programs that place interrupts, on made-up folders."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from conftest import TOP

FOLDER = TOP / "recipes/recipes-core/ecdaq-config/files/root/usr/lib/ecdaq"
TABLE = """           CPU0       CPU1
 11:      28079       5714     GICv3  27 Level     arch_timer
 20:          0          0     GICv3  40 Level     ecat0
 21:          0          0     GICv3  41 Level     ecat0-tx
 22:          0          0     GICv3  42 Level     notecat0
 23:          0          0     GICv3  43 Level     ecat01
"""


@pytest.fixture
def machine(tmp_path: Path) -> dict[str, str]:
    """Core 1 of 0-1 is isolated; port ecat0 is a virtio port of a device with interrupts 30, 31."""
    (tmp_path / "cpu").mkdir()
    (tmp_path / "cpu" / "isolated").write_text("1\n")
    (tmp_path / "cmdline").write_text("console=ttyAMA0 isolcpus=domain,1 irqaffinity=0 quiet\n")
    (tmp_path / "interrupts").write_text(TABLE)
    device = tmp_path / "pci" / "virtio2"
    device.mkdir(parents=True)
    for irq in ("30", "31"):
        (tmp_path / "pci" / "msi_irqs").mkdir(exist_ok=True)
        (tmp_path / "pci" / "msi_irqs" / irq).write_text("msix\n")
    (tmp_path / "net" / "ecat0").mkdir(parents=True)
    (tmp_path / "net" / "ecat0" / "device").symlink_to(device)
    wanted = {"11": "0", "20": "1", "22": "1", "23": "0-1", "24": "0", "30": "1", "31": "0-1"}
    for irq, cores in wanted.items():
        (tmp_path / "irq" / irq).mkdir(parents=True)
        (tmp_path / "irq" / irq / "smp_affinity_list").write_text(cores + "\n")
    return os.environ | {
        "ECDAQ_IRQ_DIR": str(tmp_path / "irq"),
        "ECDAQ_CPU_DIR": str(tmp_path / "cpu"),
        "ECDAQ_CMDLINE": str(tmp_path / "cmdline"),
        "ECDAQ_NET_DIR": str(tmp_path / "net"),
        "ECDAQ_INTERRUPTS": str(tmp_path / "interrupts"),
    }


def run(program: str, environment: dict[str, str], *arguments: str) -> str:
    done = subprocess.run(
        [FOLDER / program, *arguments], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    return done.stdout


def test_interrupts_of_a_port_are_found_by_its_device_and_by_its_name(
    machine: dict[str, str],
) -> None:
    assert run("port-irqs", machine, "ecat0").split() == ["20", "21", "30", "31"]


def test_a_port_without_hardware_has_no_interrupts(machine: dict[str, str]) -> None:
    assert run("port-irqs", machine, "ecat7") == ""


def test_only_interrupts_of_the_port_stay_on_its_core(
    machine: dict[str, str], tmp_path: Path
) -> None:
    run("irq-setup", machine)
    cores = {
        p.name: (p / "smp_affinity_list").read_text().strip() for p in (tmp_path / "irq").iterdir()
    }
    assert cores == {
        **{"11": "0", "22": "0", "23": "0", "24": "0"},
        **{"20": "1", "30": "1", "31": "0-1"},
    }


def test_without_an_isolated_core_nothing_is_moved(machine: dict[str, str], tmp_path: Path) -> None:
    (tmp_path / "cpu" / "isolated").write_text("\n")
    run("irq-setup", machine)
    assert (tmp_path / "irq" / "22" / "smp_affinity_list").read_text() == "1\n"
