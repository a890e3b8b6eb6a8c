# SPDX-License-Identifier: MIT
"""ENI files: the running bus as one, compared with the bus, and a bus run from one."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from segment import BIN, Segment

PICCOLOS = "2"
TERMINALS = "ek1100,el1008,el2004,el3104,el2828,el5101,el2889,el4002,el3204"
EXIT_CONFIG, EXIT_SLAVES = 3, 9


def offline(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([BIN / "ecdaq", *words], capture_output=True, text=True, timeout=60)


def in_op(folder: Path, slaves: str, *more: str) -> Segment:
    try:
        segment = Segment(folder, slaves=slaves)
    except PermissionError as why:
        pytest.skip(f"not permitted: {why}")
    try:
        segment.start_sim()
        segment.start_daemon(*more)
        segment.wait_for_op()
    except BaseException:
        segment.close()
        raise
    return segment


@pytest.fixture(scope="module", params=[PICCOLOS, TERMINALS], ids=["piccolos", "terminals"])
def bus(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    segment = in_op(tmp_path_factory.mktemp("eni"), request.param)
    yield segment
    segment.close()


def write(segment: Segment, path: Path) -> str:
    got = segment.ecdaq("eni", "write", "--output", str(path))
    assert (got.returncode, got.stdout, got.stderr) == (0, "", "")
    return path.read_text()


def differences(segment: Segment, path: Path) -> tuple[int, list[dict[str, Any]]]:
    got = segment.ecdaq("eni", "check", "--json", str(path), check=False)
    return got.returncode, json.loads(got.stdout)


def test_a_written_file_is_read_back_to_the_plan_of_the_bus(bus: Segment, tmp_path: Path) -> None:
    text = write(bus, tmp_path / "bus.xml")
    assert differences(bus, tmp_path / "bus.xml") == (0, [])
    got = bus.ecdaq("eni", "check", str(tmp_path / "bus.xml"))
    assert got.stdout.endswith("and the bus agree, with 0 allowed differences\n")
    # Nothing in it depends on the moment at which it is written.
    assert bus.ecdaq("eni", "write").stdout == text


def test_the_file_has_the_figures_of_the_bus(bus: Segment, tmp_path: Path) -> None:
    text = write(bus, tmp_path / "bus.xml")
    domains = json.loads(bus.ecdaq("domains", "--json").stdout)
    slaves = json.loads(bus.ecdaq("scan", "--json").stdout)
    channels = json.loads(bus.ecdaq("channels", "--json").stdout)
    cyclic = text[text.index("<Cyclic>") : text.index("</Cyclic>")]
    assert text.count("<Slave>") == len(slaves)
    for key, tag in (("vendor", "VendorId"), ("product", "ProductCode"), ("name", "Name")):
        for slave in slaves:
            assert f"<{tag}>{slave[key]}</{tag}>" in text
    assert re.findall(r"<DataLength>(\d+)<", cyclic) == [
        str(datagram["length"]) for datagram in domains["datagram"]
    ]
    assert re.findall(r"<Cnt>(\d+)<", cyclic) == [
        str(d["expected"]) for d in domains["datagram"] if d["expected"] is not None
    ]
    fmmus = sum(len(slave["fmmu"]) for slave in domains["slave"])
    assert len(re.findall(r"<Comment>FMMU\d+<", text)) == fmmus
    image = text[text.index("<ProcessImage>") :]
    names = re.findall(r"<Variable>\s*<Name>([^<]*)<", image)
    assert sorted(names) == sorted(channel["name"] for channel in channels)


def test_each_difference_is_named(bus: Segment, tmp_path: Path) -> None:
    path = tmp_path / "bus.xml"
    text = write(bus, path)
    path.write_text(text.replace("<CycleTime>1000<", "<CycleTime>2000<"))
    assert differences(bus, path) == (
        EXIT_CONFIG,
        [
            {
                "position": None,
                "what": "cycle time in us",
                "file": "2000",
                "bus": "1000",
                "allowed": False,
            }
        ],
    )
    path.write_text(re.sub(r"<RevisionNo>\d+<", "<RevisionNo>99<", text, count=1))
    code, found = differences(bus, path)
    assert code == EXIT_SLAVES
    assert [(d["position"], d["what"], d["file"]) for d in found] == [(0, "revision", "0x0063")]
    path.write_text(text.replace("<Addr>0</Addr>", "<Addr>16777216</Addr>"))
    code, found = differences(bus, path)
    assert code == 0
    assert all(difference["allowed"] for difference in found)
    assert found != []


def test_a_bus_is_run_from_an_imported_file(bus: Segment, tmp_path: Path) -> None:
    eni, yaml = tmp_path / "bus.xml", tmp_path / "ecdaq.yaml"
    write(bus, eni)
    got = offline("eni", "import", str(eni), "--output", str(yaml))
    assert (got.returncode, got.stdout) == (0, "")
    (tmp_path / "again").mkdir()
    segment = in_op(tmp_path / "again", bus.slaves, "--config", str(yaml))
    try:
        code, found = differences(segment, eni)
        assert (code, found) == (0, [])
        theirs = json.loads(bus.ecdaq("channels", "--json").stdout)
        ours = json.loads(segment.ecdaq("channels", "--json").stdout)
        assert [c["name"] for c in ours] == [c["name"] for c in theirs]
    finally:
        segment.close()


# As TwinCAT exports it: process data from byte 39 of an image on, 0x01000000 on the wire, decimal
# numbers, CDATA, ISO-8859-1; the status of a channel is one word over several entries.
FOREIGN = """<?xml version="1.0" encoding="ISO-8859-1"?>
<EtherCATConfig xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" Version="1.3">
<Config>
<Master><Info><Name><![CDATA[Ger\xe4t 1 (EtherCAT)]]></Name><Destination>ffffffffffff</Destination>
<Source>001bc5000000</Source><EtherType>a488</EtherType></Info>
<MailboxStates><StartAddr>150994944</StartAddr><Count>1</Count></MailboxStates>
<EoE><MaxPorts>2</MaxPorts></EoE></Master>
<Slave><Info><Name><![CDATA[Klemme 1 (EK1100)]]></Name><PhysAddr>1001</PhysAddr>
<AutoIncAddr>0</AutoIncAddr><Physics>YKY</Physics>{identity0}</Info></Slave>
<Slave><Info><Name><![CDATA[Klemme 2 (EL2004)]]></Name><PhysAddr>1002</PhysAddr>
<AutoIncAddr>65535</AutoIncAddr>{identity1}</Info>
<ProcessData><Send><BitStart>312</BitStart><BitLength>4</BitLength></Send>
<Sm0><Type>Outputs</Type><DefaultSize>1</DefaultSize><StartAddress>3840</StartAddress>
<ControlByte>68</ControlByte><Enable>1</Enable></Sm0>{outputs}</ProcessData>
<InitCmds><InitCmd><Transition>PS</Transition><Comment><![CDATA[set fmmu 0]]></Comment><Cmd>5</Cmd>
<Adp>1002</Adp><Ado>1536</Ado><Data>0000000101000003000f000201000000</Data></InitCmd></InitCmds>
</Slave>
<Slave><Info><Name><![CDATA[Klemme 3 (EL3104)]]></Name><PhysAddr>1003</PhysAddr>
<AutoIncAddr>65534</AutoIncAddr>{identity2}</Info>
<ProcessData><Recv><BitStart>320</BitStart><BitLength>64</BitLength></Recv>
<Sm3><Type>Inputs</Type><DefaultSize>8</DefaultSize><StartAddress>4480</StartAddress>
<ControlByte>32</ControlByte><Enable>1</Enable><Pdo>#x1a00</Pdo><Pdo>#x1a02</Pdo></Sm3>{inputs}</ProcessData>
<Mailbox><Send><Start>4096</Start><Length>128</Length></Send>
<Recv><Start>4224</Start><Length>128</Length><PollTime>20</PollTime></Recv>
<Protocol>CoE</Protocol><CoE><InitCmds>{commands}</InitCmds></CoE></Mailbox>
<InitCmds><InitCmd><Transition>PS</Transition><Cmd>5</Cmd><Adp>1003</Adp><Ado>1536</Ado>
<Data>01000001080000078011000101000000</Data></InitCmd></InitCmds></Slave>
<Cyclic><CycleTime>2000</CycleTime><Priority>1</Priority><Frame>
<Cmd><State>SAFEOP</State><State>OP</State><Cmd>12</Cmd><Addr>16777216</Addr>
<DataLength>9</DataLength><Cnt>3</Cnt><InputOffs>39</InputOffs><OutputOffs>39</OutputOffs></Cmd>
</Frame></Cyclic>
<ProcessImage><Inputs><ByteSize>48</ByteSize>{variables}</Inputs>
<Outputs><ByteSize>48</ByteSize><Variable><Name>Klemme 2 (EL2004).Ventil \xf6ffnen.Output</Name>
<DataType>BOOL</DataType><BitSize>1</BitSize><BitOffs>312</BitOffs></Variable></Outputs>
</ProcessImage></Config></EtherCATConfig>
"""
FOREIGN_SLAVES = "ek1100,el2004,el3104"
ASSIGNED = (0x1A00, 0x1A02)  # of the four of an EL3104


def identity(slave: dict[str, Any]) -> str:
    return (
        f"<VendorId>{slave['vendor']}</VendorId><ProductCode>{slave['product']}</ProductCode>"
        f"<RevisionNo>{slave['revision']}</RevisionNo>"
    )


def pdo_xml(pdo: dict[str, Any]) -> str:
    kind = "TxPdo" if pdo["direction"] == "input" else "RxPdo"
    entries = "".join(
        f"<Entry><Index>#x{entry['index']:04x}</Index><SubIndex>{entry.get('subindex', 0)}"
        f"</SubIndex><BitLen>{entry['bits']}</BitLen></Entry>"
        for entry in pdo["entry"]
    )
    return f'<{kind} Sm="{pdo["sm"]}"><Index>{pdo["index"]}</Index><Name>x</Name>{entries}</{kind}>'


def command(subindex: int, data: str, comment: str) -> str:
    return (
        f"<InitCmd><Transition>PS</Transition><Comment><![CDATA[{comment}]]></Comment>"
        f"<Timeout>0</Timeout><Ccs>1</Ccs><Index>7187</Index><SubIndex>{subindex}</SubIndex>"
        f"<Data>{data}</Data></InitCmd>"
    )


def variable(name: str, bits: int, at: int) -> str:
    return (
        f"<Variable><Name>{name}</Name><DataType>INT</DataType><BitSize>{bits}</BitSize>"
        f"<BitOffs>{at}</BitOffs></Variable>"
    )


def foreign(segment: Segment) -> bytes:
    slaves = json.loads(segment.ecdaq("scan", "--json").stdout)
    pdos = [slave["pdo"] for slave in json.loads(segment.ecdaq("pdo", "--json").stdout)]
    commands = [command(0, "00", "clear sm pdos (0x1C13)")]
    variables = [variable("Inputs.Frm0State", 16, 12192)]
    for number, index in enumerate(ASSIGNED):
        commands.append(command(number + 1, index.to_bytes(2, "little").hex(), "assign"))
        name = f"Klemme 3 (EL3104).Kanal {number + 1}"
        variables.append(variable(f"{name}.Status", 16, 320 + 32 * number))
        variables.append(variable(f"{name}.Wert", 16, 336 + 32 * number))
    text = FOREIGN.format(
        **{f"identity{n}": identity(slave) for n, slave in enumerate(slaves)},
        outputs="".join(pdo_xml(pdo) for pdo in pdos[1]),
        inputs="".join(pdo_xml(pdo) for pdo in pdos[2] if pdo["index"] in ASSIGNED),
        commands="".join([*commands, command(0, "02", "count")]),
        variables="".join(variables),
    )
    return text.encode("latin-1")


def test_a_file_in_the_style_of_twincat_runs_a_bus_with_its_pdos_and_names(tmp_path: Path) -> None:
    eni, yaml = tmp_path / "twincat.xml", tmp_path / "ecdaq.yaml"
    (tmp_path / "default").mkdir()
    (tmp_path / "imported").mkdir()
    segment = in_op(tmp_path / "default", FOREIGN_SLAVES)
    try:
        eni.write_bytes(foreign(segment))
        code, found = differences(segment, eni)
        assert code == EXIT_CONFIG
        named = {(d["position"], d["what"]) for d in found if not d["allowed"]}
        assert {(2, "PDOs of SM3"), (2, "SM3 bytes"), (None, "cycle time in us")} <= named
    finally:
        segment.close()
    got = offline("eni", "import", str(eni), "--output", str(yaml))
    assert got.returncode == 0
    lines = [line.removeprefix(f"ecdaq: eni: {eni}:") for line in got.stderr.splitlines()]
    assert [line.split(": ", 1)[1] for line in lines] == [
        "slave 2: variable Klemme 3 (EL3104).Kanal 1.Status: it is not one whole entry of a PDO of "
        "at most 64 bits",
        "slave 2: variable Klemme 3 (EL3104).Kanal 2.Status: it is not one whole entry of a PDO of "
        "at most 64 bits",
        "variable Inputs.Frm0State: it is no entry of an assigned PDO",
        "<EoE> in <Master>",
    ]
    segment = in_op(tmp_path / "imported", FOREIGN_SLAVES, "--config", str(yaml))
    try:
        code, found = differences(segment, eni)
        assert [d["what"] for d in found if not d["allowed"]] == []
        assert code == 0
        assert (1, "FMMU of 0x0f00.0") in {(d["position"], d["what"]) for d in found}
        names = [
            channel["name"] for channel in json.loads(segment.ecdaq("channels", "--json").stdout)
        ]
        assert "Klemme_2_EL2004.Ventil_ffnen_Output" in names
        values = [name for name in names if name.endswith("_Wert")]
        assert values == [f"Klemme_3_EL3104.Kanal_{n}_Wert" for n in (1, 2)]
        # What it writes of this bus leads back to it, with the same start-up commands.
        again = tmp_path / "again.xml"
        write(segment, again)
        assert again.read_text().count("<Ccs>1</Ccs>") == 4
        assert differences(segment, again) == (0, [])
    finally:
        segment.close()


def test_pdos_and_start_up_sdos_of_the_configuration_are_written_as_commands(
    tmp_path: Path,
) -> None:
    yaml = tmp_path / "ecdaq.yaml"
    yaml.write_text(
        "slaves:\n  - name: in\n    pdos: [0x1a02, 0x1a00]\n  - name: board\n"
        '    sdo: ["IP 0x8000:01 USINT = 0  # mode"]\n'
    )
    (tmp_path / "bus").mkdir()
    segment = in_op(tmp_path / "bus", "el3104,fb1111_piccolo", "--config", str(yaml))
    try:
        text = write(segment, tmp_path / "bus.xml")
        commands = re.findall(
            r"<Transition>(..)</Transition>\s*<Comment>([^<]*)</Comment>\s*<Timeout>\d+</Timeout>"
            r"\s*<Ccs>1</Ccs>\s*<Index>(\d+)</Index>\s*<SubIndex>(\d+)</SubIndex>"
            r"\s*<Data>([^<]*)<",
            text,
        )
        assign = [("0", "00"), ("1", "021a"), ("2", "001a"), ("0", "02")]
        assert commands == [
            *(("PS", "slaves[].pdos", str(0x1C13), sub, data) for sub, data in assign),
            ("IP", "mode", str(0x8000), "1", "00"),
        ]
    finally:
        segment.close()


def test_what_is_wrong_is_refused_with_one_line(tmp_path: Path) -> None:
    path = tmp_path / "a.xml"
    for text, why in (
        ("<html/>", ":1: no ENI: <html> instead of <EtherCATConfig>"),
        ("<!DOCTYPE a []>\n<EtherCATConfig/>", ":1: a document type declaration (<!DOCTYPE)"),
        ("<EtherCATConfig>\n<Config>\n<Slave><Info><VendorId>x<", ":3: no XML"),
        ("<EtherCATConfig/>", ": no <Slave>"),
    ):
        path.write_text(text)
        got = offline("eni", "import", str(path))
        assert (got.returncode, got.stdout) == (1, "")
        assert got.stderr.startswith(f"ecdaq: eni: {path}{why}")
        assert got.stderr.count("\n") == 1
    for words in (["eni", "write", "x"], ["eni", "check"], ["eni", "frob", "x"]):
        assert offline(*words).returncode == 2
    path.write_text("")
    got = offline("eni", "import", str(path), "--json")
    assert got.returncode == 2
