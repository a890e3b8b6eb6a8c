# SPDX-License-Identifier: MIT
"""An installation on a clean Debian 12, in order: installed, used, upgraded, removed, purged."""

from __future__ import annotations

import json
import re

from conftest import TOP, Machine

INSTALL = "apt-get install -q -y"
# README, "Real slaves on this PC": install, port, start, look, watch.
(README,) = re.findall(
    r"^## Real slaves on this PC\n.*?```sh\n(.*?)```", (TOP / "README.md").read_text(), re.M | re.S
)
LINES = [line.partition(" #")[0].replace("sudo ", "").strip() for line in README.splitlines()]
OURS = "ecdaq ecdaq-sim libecdaq1 libecdaq-dev python3-ecdaq"
USERS = {"ecdaqd", "ecdaq-record", "ecdaq-dds", "ecdaq-sync0", "ecdaq-web"} | {"ecdaq-stream"}
USERS |= {"ecdaq-uplink", "ecdaq-web-command"}
REMOTE_LED = "outputs: [ { channel: piccolo0.led, owner: remote } ]"
AS_USER = "setpriv --reuid {} --regid ecdaq-read --init-groups {} {} > /tmp/{}.log 2>&1 &"
# What the kernel's and the package manager's own books are not asked for.
FILES = (
    "find / -xdev \\( -path /proc -o -path /mnt -o -path /var/lib/dpkg/info \\) -prune"
    " -o -name '*ecdaq*' -print"
)


def exec_start(machine: Machine, service: str) -> str:
    """The command line of the unit, as systemd would run it without ECDAQ_OPTIONS."""
    unit = machine.run(f"cat /lib/systemd/system/{service}.service")
    (command,) = re.findall(r"^ExecStart=(.*)$", unit, re.MULTILINE)
    return command.replace("$ECDAQ_OPTIONS", "")


def test_packages_are_installed_with_what_they_depend_on(machine: Machine) -> None:
    assert machine.try_run("command -v ecdaq")[0] != 0
    machine.run(f"{INSTALL} /mnt/old/*.deb")
    versions = machine.run(f"dpkg-query --show --showformat='${{Version}}\\n' {OURS}").split()
    assert len(versions) == 5
    assert all(version.endswith("~old") for version in versions)
    assert machine.run("ecdaq --version").startswith("ecdaq ")


def test_users_groups_and_directories_are_there(machine: Machine) -> None:
    users = set(re.findall(r"^(ecdaq[^:]*):", machine.run("cat /etc/passwd"), re.MULTILINE))
    assert users == USERS
    assert "ecdaq-remote" in machine.run("id --name --groups ecdaq-dds")
    assert machine.run("stat -c %U:%G:%a /run/ecdaq") == "ecdaqd:ecdaq-read:2750"
    assert machine.run("stat -c %U:%G:%a /var/lib/ecdaq/record") == "ecdaq-record:ecdaq-read:750"
    assert machine.run("stat -c %U:%G:%a /var/lib/ecdaq/uplink") == "ecdaq-uplink:ecdaq-read:2750"


def test_no_service_is_enabled_and_all_units_are_valid(machine: Machine) -> None:
    assert machine.try_run("ls /etc/systemd/system/*/ecdaq*")[0] != 0
    units = machine.run("ls /lib/systemd/system/ | grep ecdaq").split()
    assert {"ecdaqd.service", "ecdaq-record.service", "ecdaq-nic@.service"} <= set(units)
    paths = " ".join(f"/lib/systemd/system/{u.replace('@.', '@eth1.')}" for u in units)
    code, output = machine.try_run(f"systemd-analyze verify --man=no {paths}")
    assert (code, re.findall(r".*ecdaq.*", output)) == (0, [])


def test_completion_and_a_page_for_each_program_and_verb_are_installed(machine: Machine) -> None:
    installed = machine.run("cat /usr/share/bash-completion/completions/ecdaq")
    assert installed == machine.run("ecdaq completion")
    pages = machine.run("cd /usr/share/man; ls man1/*ecdaq* man1/fb1111* man8/*ecdaq*").split()
    programs = machine.run("cd /usr/bin; ls *ecdaq* fb1111*").split()
    names = {page.split("/")[1].rsplit(".", 2)[0] for page in pages}
    assert names >= {*programs, "ecdaq-sdo", "ecdaq-slaves"}
    # The verb is in section 1, the service in section 8.
    assert {"man1/ecdaq-sync0.1.gz", "man8/ecdaq-sync0.8.gz"} <= set(pages)


def test_the_default_configuration_is_valid_and_asks_for_a_port(machine: Machine) -> None:
    assert "valid" in machine.run("ecdaqd --check --config /etc/ecdaq/ecdaq.yaml")
    code, output = machine.try_run(exec_start(machine, "ecdaqd"))
    assert code == 3
    assert "bus.interface: not set" in output


def test_doctor_judges_this_machine(machine: Machine) -> None:
    code, output = machine.try_run(
        "ecdaq doctor --json --config /etc/ecdaq/ecdaq.yaml 2> /dev/null"
    )
    assert code in (0, 1)  # it is no real-time machine
    assert json.loads(output)["ok"] > 0


def test_daemon_and_recorder_work_as_their_users_by_the_units_command_lines(
    machine: Machine,
) -> None:
    machine.run(
        "ip link add ecat0 type veth peer name ecsim0; ip link set ecat0 up; ip link set ecsim0 up"
    )
    machine.run(LINES[1].replace("eth1", "ecat0"))
    machine.run(f"echo '{REMOTE_LED}' >> /etc/ecdaq/ecdaq.yaml")
    machine.run("ecdaq-sim --interface ecsim0 --slaves 2 > /tmp/sim.log 2>&1 &")
    raw = "--inh-caps +net_raw --ambient-caps +net_raw"
    machine.run(
        AS_USER.format(
            "ecdaqd", raw, exec_start(machine, "ecdaqd") + " --set dc.lock_timeout=60s", "daemon"
        )
    )
    record = "env ECDAQ_RUN_DIR=/run/ecdaq " + exec_start(machine, "ecdaq-record")
    machine.run(AS_USER.format("ecdaq-record", "", record, "record"))
    # A bounded wait for a condition.
    machine.run(
        'for i in $(seq 1200); do ecdaq status --json 2> /dev/null | grep -q \'"state": *"OP"\' && '
        "ls /var/lib/ecdaq/record/*.part > /dev/null 2>&1 && break; sleep 0.1; done"
    )
    slaves = machine.run("ecdaq slaves; cat /tmp/*.log")
    assert slaves.count("OP ") >= 2, slaves
    channels = json.loads(machine.run("ecdaq channels --json"))
    assert channels


def test_the_lines_of_readme_are_those_that_work(machine: Machine) -> None:
    install, _, start, status, watch = LINES
    assert install == "./build.sh deb && apt install ./build/deb/*_amd64.deb"
    # systemd does not run here: the units' own command lines were started above.
    assert start.startswith("systemctl enable --now ")
    machine.run(start.replace("--now ", ""))
    enabled = machine.run("ls /etc/systemd/system/*/").split()
    assert {"ecdaq-nic@eth1.service", "ecdaqd.service", "ecdaq-record.service"} <= set(enabled)
    machine.run(start.replace("enable --now ", "disable "))
    assert "OP" in machine.run(status)
    assert "piccolo0.adc" in machine.run(f"{watch} --count 1")


def test_python_reads_and_records_without_another_package(machine: Machine) -> None:
    machine.run("python3 -c 'import ecdaq, ecdaq.mcap_file; print(ecdaq.__version__)'")
    assert "usage: ecdaq-remote" in machine.run("ecdaq-remote --help")
    assert "usage: ecdaq-parquet" in machine.run("ecdaq-parquet --help")


def test_python_sets_an_output_over_dds_with_keys(machine: Machine) -> None:
    """The binding is compiled for Debian's Cyclone DDS, which has DDS Security."""
    machine.run("ip link set lo multicast on; ecdaq security init --dir /tmp/keys")
    machine.run("ecdaq security add-commander bob --dir /tmp/keys")
    machine.run("chmod 755 /tmp/keys; chown -R ecdaq-dds /tmp/keys/appliance")
    keys = " --set dds.enable=on --set dds.interface=lo --set dds.security=/tmp/keys/appliance"
    dds = "env ECDAQ_RUN_DIR=/run/ecdaq " + exec_start(machine, "ecdaq-dds") + keys
    machine.run(AS_USER.format("ecdaq-dds", "", dds, "dds"))
    script = (
        'import ecdaq; link = ecdaq.connect("lo", security="/tmp/keys/bob");'
        ' print(link.command({"piccolo0.led": 1}, seconds=60))'
    )
    # What the DDS library says of participants, on standard error, is not of interest here.
    command = f"python3 -c '{script}' 2> /tmp/said || (cat /tmp/said; exit 1)"
    assert int(machine.run(command)) > 0
    assert json.loads(machine.run("ecdaq status --json"))["dds"]["secure"] is True


def test_a_program_is_built_with_libecdaq_dev(machine: Machine) -> None:
    assert "-lecdaq" in machine.run("cat /usr/lib/*/pkgconfig/ecdaq.pc")
    assert machine.run("readlink /usr/lib/*/libecdaq.so").startswith("libecdaq.so.1")
    machine.run("ls /usr/include/ecdaq/reader.h /usr/include/ecdaq/control.h")


def test_an_upgrade_keeps_configuration_and_running_services(machine: Machine) -> None:
    pid = machine.run("pgrep -x ecdaqd")
    machine.run(f"{INSTALL} /mnt/new/*.deb")
    versions = machine.run(f"dpkg-query --show --showformat='${{Version}}\\n' {OURS}").split()
    assert not any("~old" in version for version in versions)
    assert "interface: ecat0" in machine.run("cat /etc/ecdaq/ecdaq.yaml")
    assert machine.run("pgrep -x ecdaqd") == pid
    machine.run("ecdaq status")


def test_removal_leaves_configuration_and_recordings(machine: Machine) -> None:
    machine.run("kill %4; wait %4; kill %3; wait %3; kill %2; wait %2; kill %1; wait %1; true")
    assert machine.run("ls /var/lib/ecdaq/record/*.mcap")
    machine.run(f"apt-get remove -q -y {OURS}")
    assert machine.try_run("ls /usr/bin/*ecdaq*")[0] != 0
    assert "interface: ecat0" in machine.run("cat /etc/ecdaq/ecdaq.yaml")


def test_purging_leaves_recordings_and_nothing_else(machine: Machine) -> None:
    machine.run(f"dpkg --purge {OURS}")
    left = set(machine.run(FILES).split())
    recordings = {name for name in left if name.startswith("/var/lib/ecdaq/record/")}
    assert recordings
    assert left - recordings == {"/var/lib/ecdaq"}


def test_after_purging_an_empty_installation_nothing_is_left(machine: Machine) -> None:
    machine.run(f"rm -r /var/lib/ecdaq; {INSTALL} /mnt/new/*.deb; dpkg --purge {OURS}")
    assert machine.run(FILES) == ""
