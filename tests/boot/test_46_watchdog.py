# SPDX-License-Identifier: MIT
"""A machine whose system manager hangs is reset by its hardware watchdog and boots again.

QEMU's i6300ESB; a reset ends QEMU, and the test starts it again. On the host's clock: the
guest's own runs ahead while the machine waits for its disk, and the watchdog expires too early.
"""

from __future__ import annotations

from machine import Machine, profile, wait_for

TIMING = "host"
# The image's 15 s (test_10_system.py) are less than a busy emulator may take to start systemd.
TIMEOUT_S = 120
# The image's manager restarts the machine itself when it crashes; here it freezes.
START = {
    "options": ("-device", "i6300esb"),
    "append": f"systemd.watchdog_sec={TIMEOUT_S} systemd.crash_action=freeze",
}
BOOT_FILES = {"ecdaq.yaml": profile("host")}
OP_S = 900
RESET_S = 5 * TIMEOUT_S
WATCHDOG = "/sys/class/watchdog/watchdog0"


def test_systemd_feeds_it(machine: Machine) -> None:
    assert machine.run(f"cat {WATCHDOG}/state").strip() == "active"
    assert machine.run(f"cat {WATCHDOG}/timeout").strip() == str(TIMEOUT_S)


def test_a_machine_whose_manager_hangs_is_reset(machine: Machine) -> None:
    wait_for("OP", OP_S, lambda: machine.status().get("state") == "OP")
    assert machine.process is not None
    process = machine.process
    machine.run("sudo kill -SEGV 1")
    # The kernel's message: the manager has closed the watchdog, which keeps counting.
    wait_for("its end", OP_S, lambda: "watchdog did not stop" in machine.console())
    assert process.poll() is None
    wait_for("the watchdog's reset", RESET_S, lambda: process.poll() is not None)
    # QEMU ends with 0 for a reset; a signal or an error of its own would be another number.
    assert process.returncode == 0
    assert "Kernel panic" not in machine.console(), "the kernel itself rebooted, not the watchdog"


def test_it_boots_again_and_continues(machine: Machine) -> None:
    machine.process = None
    machine.start(**START)
    machine.wait_for_login()
    wait_for("OP again", OP_S, lambda: machine.status().get("state") == "OP")
    machine.run(
        "sudo find /data/record -name '*.mcap' -print0 | sudo xargs -0 ecdaq log check", 900
    )
