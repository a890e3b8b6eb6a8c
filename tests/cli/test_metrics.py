# SPDX-License-Identifier: MIT
"""`ecdaq metrics` for Prometheus: its own checker, its own server, and the shipped rules."""

from __future__ import annotations

import json
import re
import shutil
import socket
import subprocess
import threading
import time
import urllib.parse
import urllib.request
from collections.abc import Callable, Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from ecdaq import FAILED, OK, PERMISSION, ROOT, USAGE, Fake, ecdaq
from web_bench import Web
from web_client import http, unchunk

SHIPPED = ROOT / "app" / "packaging" / "prometheus"
RULES, DASHBOARD = SHIPPED / "ecdaq.rules.yml", SHIPPED / "ecdaq.dashboard.json"
PROMTOOL, PROMETHEUS = shutil.which("promtool"), shutil.which("prometheus")
needs_promtool = pytest.mark.skipif(not PROMTOOL, reason="no promtool here")
needs_prometheus = pytest.mark.skipif(not PROMETHEUS, reason="no prometheus here")

MakeQuery = Callable[[int, str], Callable[[str], list[dict]]]


def values(text: str) -> dict[str, float]:
    """Each series with its value."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return {series: float(value) for series, _, value in (line.rpartition(" ") for line in lines)}


def names(text: str) -> set[str]:
    return set(re.findall(r"^# TYPE (\S+)", text, re.MULTILINE))


@needs_promtool
def test_the_checker_of_prometheus_has_nothing_to_say(daemon: Fake) -> None:
    assert PROMTOOL is not None
    text = daemon("metrics").stdout
    done = subprocess.run(
        [PROMTOOL, "check", "metrics"], input=text, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_figures_are_those_of_the_status(daemon: Fake) -> None:
    before = json.loads(daemon("status", "--json").stdout)
    found = values(daemon("metrics").stdout)
    after = json.loads(daemon("status", "--json").stdout)
    for key, name in (
        ("cycles", "ecdaq_cycles_total"),
        ("frames_lost", "ecdaq_frames_lost_total"),
        ("samples_good", "ecdaq_samples_good_total"),
        ("samples_bad", "ecdaq_samples_bad_total"),
    ):
        assert before[key] <= found[name] <= after[key], name
    assert found["ecdaq_cycles_total"] > 0
    assert found["ecdaq_up"] == 1
    assert found[f'ecdaq_bus_state{{state="{before["state"]}"}}'] == 1
    assert sum(v for k, v in found.items() if k.startswith("ecdaq_bus_state{")) == 1
    slave = before["slave"][0]
    label = f'{{position="0",slave="{slave["name"]}"}}'
    assert slave["good"] <= found[f"ecdaq_slave_samples_good_total{label}"]
    assert found["ecdaq_period_seconds"] == before["period_ns"] / 1e9


def test_a_histogram_counts_up_to_all_values(daemon: Fake) -> None:
    found = values(daemon("metrics").stdout)
    name = "ecdaq_round_trip_seconds"
    pattern = re.compile(rf'{name}_bucket{{le="([^"]+)"}}')
    counts = [(float(m[1]), v) for k, v in found.items() if (m := pattern.fullmatch(k))]
    assert [bound for bound, _ in counts] == sorted(bound for bound, _ in counts)
    assert [count for _, count in counts] == sorted(count for _, count in counts)
    assert counts[-1] == (float("inf"), found[f"{name}_count"]) and counts[-1][1] > 0
    mean = found[f"{name}_sum"] / found[f"{name}_count"]
    status = json.loads(daemon("status", "--json").stdout)["round_trip_ns"]
    assert mean == pytest.approx(status["mean"] / 1e9, rel=0.2)
    # The median is in the bucket that the counts say.
    half = next(bound for bound, count in counts if count >= found[f"{name}_count"] / 2)
    assert status["p50"] / 1e9 <= half * 1.04


def test_without_a_master_there_is_one_figure(run_dir: Path) -> None:
    done = ecdaq(run_dir, "metrics")
    assert (done.returncode, done.stderr) == (OK, "")
    assert values(done.stdout) == {"ecdaq_up": 0}


def test_a_file_is_replaced_as_a_whole(daemon: Fake, tmp_path: Path) -> None:
    path = tmp_path / "ecdaq.prom"
    path.write_text("old\n")
    assert daemon("metrics", "--output", str(path)).returncode == OK
    assert names(path.read_text()) == names(daemon("metrics").stdout)
    assert [p.name for p in tmp_path.iterdir()] == ["ecdaq.prom"]


def test_a_file_that_cannot_be_written_is_one_line(daemon: Fake, tmp_path: Path) -> None:
    done = daemon("metrics", "--output", str(tmp_path / "none" / "ecdaq.prom"))
    assert done.returncode == FAILED and done.stdout == "" and done.stderr.count("\n") == 1
    assert "No such file or directory" in done.stderr
    assert daemon("metrics", "now").returncode == USAGE


def test_a_page_that_one_may_not_read_is_not_a_master_that_is_down(
    daemon: Fake, tmp_path: Path
) -> None:
    """Alerts must not say that it is down."""
    (daemon.run_dir / "status").chmod(0o600)
    done = ecdaq(daemon.run_dir, "metrics", user=65534)
    assert (done.returncode, done.stdout) == (PERMISSION, "")
    assert done.stderr.count("\n") == 1


@needs_promtool
def test_the_rules_are_valid_and_ask_for_figures_that_there_are(daemon: Fake) -> None:
    assert PROMTOOL is not None
    done = subprocess.run(
        [PROMTOOL, "check", "rules", RULES], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"\b14 rules found", done.stdout)


@needs_promtool
def test_the_rules_of_the_upload_alert_in_time_and_not_before(tmp_path: Path) -> None:
    """By promtool, over hours that nobody waits for. A recording waits from 1 h on."""
    assert PROMTOOL is not None
    up, retrying = 'ecdaq_service_up{service="uplink"}', 'ecdaq_uplink_state{state="retrying"}'
    cases = tmp_path / "cases.json"
    alert = {"instance": "rig1"}

    def case(name: str, series: dict[str, str], quiet: str, alarmed: str, **labels: str) -> dict:
        def named(metric: str) -> str:
            bare, _, more = metric.partition("{")
            return f'{bare}{{instance="rig1"{"," + more if more else "}"}'

        (rule,) = re.findall(rf"- alert: {name}\n(?:(?!\s*- alert).*\n)*", RULES.read_text())
        texts = dict(re.findall(r'(summary|description): "(.*)"', rule))
        notes = {k: v.replace("{{ $labels.instance }}", "rig1") for k, v in texts.items()}
        expected = alert | labels | {"severity": "critical" if "Deleted" in name else "warning"}
        return {
            "interval": "1m",
            "input_series": [{"series": named(k), "values": v} for k, v in series.items()],
            "alert_rule_test": [
                {"eval_time": quiet, "alertname": name, "exp_alerts": []},
                {
                    "eval_time": alarmed,
                    "alertname": name,
                    "exp_alerts": [{"exp_labels": expected, "exp_annotations": notes}],
                },
            ],
        }

    tests = [
        case("EcdaqUplinkDown", {up: "0x10 1x60 0x60"}, "74m", "80m", service="uplink"),
        case(
            "EcdaqUplinkFailing",
            {retrying: "0x30 1x60", "ecdaq_uplink_failures_total": "0x30 1+1x60"},
            "44m", "50m", state="retrying",
        ),
        case(
            "EcdaqUplinkBehind",
            {"ecdaq_uplink_waiting_timestamp_seconds": "0x59 3600x900"}, "7h4m", "7h7m",
        ),
        case("EcdaqUplinkDeleted", {"ecdaq_uplink_deleted_recordings_total": "0x30 1x60"},
             "29m", "35m"),
    ]  # fmt: skip
    cases.write_text(
        json.dumps({"rule_files": [str(RULES)], "evaluation_interval": "1m", "tests": tests})
    )
    done = subprocess.run(
        [PROMTOOL, "test", "rules", cases], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_rules_and_dashboard_ask_for_figures_that_there_are(daemon: Fake) -> None:
    known = names(daemon("metrics").stdout)
    source = (ROOT / "app" / "cli" / "metrics.c").read_text()
    # Of services that the fake does not have.
    known |= {f"ecdaq_recorder_{n}" for n in re.findall(r'RECORD\("(\w+)"', source)}
    known |= {f"ecdaq_uplink_{n}" for n in re.findall(r'UPLINK\("(\w+)"', source)}
    known |= {f"ecdaq_stream_{n}" for n in re.findall(r'STREAM\("(\w+)"', source)}
    known |= set(re.findall(r'"(ecdaq_(?:recorder|uplink)_\w+)"', source))
    dashboard = json.loads(DASHBOARD.read_text())
    asked = [t["expr"] for panel in dashboard["panels"] for t in panel["targets"]]
    for text in (RULES.read_text(), *asked):
        for name in re.findall(r"\becdaq_\w+", text):
            assert re.sub(r"_bucket$", "", name) in known, name
    assert len(asked) >= 16


@pytest.fixture
def served(tmp_path: Path) -> Iterator[tuple[Path, int]]:
    """A folder that an HTTP server on loopback serves; its port."""
    folder = tmp_path / "served"
    folder.mkdir()

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, *_: object) -> None:
            pass

        def guess_type(self, path: str) -> str:  # type: ignore[override]
            del path
            return "text/plain; version=0.0.4"

    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield folder, server.server_port
    server.shutdown()
    thread.join()
    server.server_close()


def free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return int(s.getsockname()[1])


@pytest.fixture
def make_query(tmp_path: Path) -> Iterator[MakeQuery]:
    """Starts a Prometheus that scrapes a path of a port each second, with the shipped rules; what
    asks it."""
    servers = []

    def make(scraped_port: int, path: str) -> Callable[[str], list[dict]]:
        assert PROMETHEUS is not None
        config = tmp_path / "prometheus.yml"
        config.write_text(
            "global: { scrape_interval: 1s, evaluation_interval: 1s }\n"
            f"rule_files: ['{RULES}']\n"
            "scrape_configs:\n"
            "  - job_name: ecdaq\n"
            f"    metrics_path: {path}\n"
            f"    static_configs: [{{ targets: ['127.0.0.1:{scraped_port}'] }}]\n"
        )
        port = free_port()
        with (tmp_path / "log").open("w") as log:
            server = subprocess.Popen(
                [
                    PROMETHEUS,
                    f"--config.file={config}",
                    f"--storage.tsdb.path={tmp_path / 'data'}",
                    f"--web.listen-address=127.0.0.1:{port}",
                ],
                stdout=log,
                stderr=log,
            )
        servers.append(server)

        def ask(expression: str) -> list[dict]:
            words = urllib.parse.urlencode({"query": expression})
            url = f"http://127.0.0.1:{port}/api/v1/query?{words}"
            with urllib.request.urlopen(url, timeout=20) as answer:
                return json.load(answer)["data"]["result"]

        return ask

    yield make
    for server in servers:
        server.terminate()
        server.wait(60)


def wait_for(ask: Callable[[str], list[dict]], expression: str) -> list[dict]:
    end = time.monotonic() + 90
    while True:
        try:
            if found := ask(expression):
                return found
        except OSError:
            pass
        assert time.monotonic() < end, expression
        time.sleep(0.1)


@needs_prometheus
def test_a_real_prometheus_scrapes_it_and_alerts(
    daemon: Fake, served: tuple[Path, int], make_query: MakeQuery
) -> None:
    query = make_query(served[1], "/ecdaq.prom")
    path = served[0] / "ecdaq.prom"
    assert daemon("metrics", "--output", str(path)).returncode == OK
    [cycles] = wait_for(query, "ecdaq_cycles_total > 0")
    assert float(cycles["value"][1]) <= json.loads(daemon("status", "--json").stdout)["cycles"]
    assert wait_for(query, "histogram_quantile(0.5, ecdaq_round_trip_seconds_bucket) > 0")
    # A lost slave is an alert with its name.
    text = path.read_text()
    series = 'ecdaq_slave_lost{position="1",slave="piccolo1"}'
    assert f"{series} 0\n" in text
    changed = served[0] / "new"
    changed.write_text(text.replace(f"{series} 0\n", f"{series} 1\n"))
    changed.rename(path)
    [alert] = wait_for(query, 'ALERTS{alertname="EcdaqSlaveLost"}')
    assert alert["metric"]["slave"] == "piccolo1"
    # A recording that waits too long for its upload, and one that was deleted before.
    old = time.time() - 7 * 3600
    changed.write_text(
        text + f"ecdaq_uplink_waiting_timestamp_seconds {old:.0f}\n"
        "ecdaq_uplink_deleted_recordings_total 0\n"
    )
    changed.rename(path)
    wait_for(query, 'ALERTS{alertname="EcdaqUplinkBehind",alertstate="pending"}')
    changed.write_text(
        text + "ecdaq_uplink_waiting_timestamp_seconds 0\necdaq_uplink_deleted_recordings_total 2\n"
    )
    changed.rename(path)
    wait_for(query, 'ALERTS{alertname="EcdaqUplinkDeleted"}')
    wait_for(query, 'absent(ALERTS{alertname="EcdaqUplinkBehind"})')


def test_the_server_of_the_page_has_them_too(daemon: Fake, make_web: Callable[..., Web]) -> None:
    port = make_web().port
    status, headers, body = http(port, "GET /metrics")
    assert (status, headers["content-type"]) == (200, "text/plain; version=0.0.4; charset=utf-8")
    assert "content-disposition" not in headers
    served = unchunk(body).decode()
    assert names(served) == names(daemon("metrics").stdout)
    assert values(served)["ecdaq_up"] == 1
    assert http(port, "HEAD /metrics")[::2] == (200, b"")
    assert http(port, "GET /metrics/x")[0] == 404
    assert http(port, "GET /metrics", Host="evil.example")[0] == 403
    assert http(port, "POST /metrics")[0] == 405


@needs_prometheus
def test_a_real_prometheus_scrapes_the_server_of_the_page(
    daemon: Fake, make_web: Callable[..., Web], make_query: MakeQuery
) -> None:
    query = make_query(make_web().port, "/metrics")
    wait_for(query, "rate(ecdaq_cycles_total[1m]) > 0")
    daemon.close()
    wait_for(query, "ecdaq_up == 0")
