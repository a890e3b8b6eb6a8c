// SPDX-License-Identifier: MIT
// The view Bus: the tree of ports, and all that is known of one slave.
import { Dictionary } from "./dictionary.js";
import { branches } from "./tree.js";
import { button, row, set_level, set_text } from "./table.js";

const by_id = (id) => document.getElementById(id);
const PORTS = 4;

const ns = (value) => (Math.abs(value) < 1000 ? `${value} ns` : `${(value / 1000).toPrecision(4)} µs`);
const number_of = (place) => Number(new URLSearchParams(place).get("s") ?? NaN);

function fill_table(body, lines) {
  while (body.children.length > lines.length) {
    body.lastChild.remove();
  }
  lines.forEach(([name, ...values], i) => {
    let line = body.children[i];
    if (!line || line.children.length !== values.length + 1) {
      const made = row(...Array(values.length + 1).fill(""));
      line ? line.replaceWith(made) : body.append(made);
      line = made;
    }
    [name, ...values].forEach((text, k) => set_text(line.children[k], String(text)));
  });
}

const STATES = ["INIT", "PREOP", "SAFEOP", "OP"];

export class BusView {
  // on_choose(position) is called for the slave that is clicked; command(...words) is of the session.
  constructor(on_choose, command) {
    this.on_choose = on_choose;
    this.command = command;
    this.chosen = NaN;
    this.dictionary = new Dictionary(command);
    const chosen = () => [String(this.chosen)];
    this.add_buttons("bus-commands", "the bus", () => [], [["Scan anew", "rescan"], ["Reset counters", "clear"]]);
    this.add_buttons("slave-commands", "this slave", chosen, [["Reset error counters", "errors"]]);
    by_id("bus-allow").addEventListener("change", ({ target }) => {
      by_id("bus-commands").disabled = by_id("slave-commands").disabled = !target.checked;
    });
  }

  add_buttons(place, of, operands, more) {
    const all = [...STATES.map((state) => [state, "state", state]), ...more];
    by_id(place).append(...all.map(([text, ...words]) => button(text, `${text}: ${of}`, () => this.ask(...words, ...operands()))));
  }

  async ask(...words) {
    const result = by_id("bus-result");
    result.textContent = `${words.join(" ")}: …`;
    set_level(result, "");
    const { ok, text } = await this.command(...words);
    result.textContent = ok ? `${words.join(" ")}: done` : text;
    set_level(result, ok ? "good" : "bad");
  }

  // The part of the address behind "#bus?".
  read_place(place) {
    this.chosen = number_of(place);
    by_id("bus-slave").hidden = true;
    this.dictionary.choose(NaN);
    this.mark();
  }

  request() {
    return Number.isInteger(this.chosen) && this.chosen >= 0 ? { slave: this.chosen } : {};
  }

  show(bus) {
    const lines = by_id("bus-rows");
    const missing = bus.missing ?? [];
    const count = bus.slaves.length + missing.length;
    while (lines.children.length > count) {
      lines.lastChild.remove();
    }
    set_text(by_id("bus-note"), this.note(bus));
    const drawn = branches(bus.slaves);
    bus.slaves.forEach((slave, i) => {
      const line = this.line(i, "slave");
      const at = slave.parent === undefined ? "?" : slave.parent < 0 ? bus.interface : `${slave.parent}:${slave.parent_port}`;
      const errors = slave.errors + slave.links > 0;
      set_text(line.children[0], String(i));
      line.dataset.position = i;
      set_text(line.querySelector(".branch"), drawn[i]);
      set_text(line.querySelector("button"), slave.name);
      set_text(line.children[2], slave.device);
      set_text(line.children[3], slave.state);
      set_level(line.children[3], slave.level);
      set_text(line.children[4], at);
      set_text(line.children[5], slave.cable_ns === undefined ? "" : ns(slave.cable_ns));
      set_text(line.children[6], String(slave.errors));
      set_text(line.children[7], String(slave.links));
      for (const cell of [6, 7]) {
        set_level(line.children[cell], errors && line.children[cell].textContent !== "0" ? "warning" : "");
      }
    });
    missing.forEach((slave, k) => {
      const line = this.line(bus.slaves.length + k, "missing");
      set_text(line.children[1], slave.name);
      set_text(line.children[3], slave.state);
      set_level(line.children[3], slave.level);
    });
    this.mark();
  }

  // The i-th row, of the wanted kind.
  line(i, kind) {
    const lines = by_id("bus-rows");
    const old = lines.children[i];
    if (old?.dataset.kind === kind) {
      return old;
    }
    const name = document.createElement("span");
    if (kind === "slave") {
      const branch = document.createElement("span");
      branch.className = "branch";
      const button = document.createElement("button");
      button.type = "button";
      name.append(branch, button);
    }
    const made = row("", name, "", "", "", "", "", "");
    made.dataset.kind = kind;
    for (const cell of [0, 5, 6, 7]) {
      made.children[cell].className = "number";
    }
    if (kind === "slave") {
      made.querySelector("button").addEventListener("click", () => this.on_choose(Number(made.dataset.position)));
    }
    old ? old.replaceWith(made) : lines.append(made);
    return made;
  }

  note({ alive, slaves, expected, same_config, message }) {
    const parts = [];
    if (!alive) {
      parts.push(slaves.length ? "ecdaqd has ended; this is what it saw last" : "ecdaqd is not running");
    }
    if (expected !== undefined) {
      parts.push(`${slaves.length} slaves found${expected ? `, ${expected} expected` : ""}`);
      if (!same_config) {
        parts.push("ecdaqd has another configuration than ecdaq-web: restart ecdaq-web to see which slaves are expected");
      }
    }
    if (message) {
      parts.push(message);
    }
    return parts.join(". ");
  }

  mark() {
    for (const button of by_id("bus-rows").querySelectorAll("button")) {
      const is_it = Number(button.closest("tr").dataset.position) === this.chosen;
      button.setAttribute("aria-pressed", String(is_it));
    }
  }

  show_slave(slave) {
    const panel = by_id("bus-slave");
    if (slave.position !== this.chosen || slave.name === undefined) {
      panel.hidden = true;
      this.dictionary.choose(NaN);
      return;
    }
    panel.hidden = false;
    this.dictionary.choose(slave.position, Object.values(slave.found).join(" "));
    set_text(by_id("bus-slave-name"), `${slave.position} ${slave.name}: ${slave.state}`);
    set_level(by_id("bus-slave-name"), slave.level);
    set_text(by_id("bus-slave-hint"), slave.hint);
    const wanted = slave.expected ?? {};
    const identity = ["vendor", "product", "revision", "serial", "alias"].map((key) => {
      const found = slave.found[key];
      return [key, found, wanted[key] ?? (slave.expected ? "any" : "–")];
    });
    fill_table(by_id("bus-identity"), identity);
    [...by_id("bus-identity").children].forEach((line, i) => {
      const [, found, expected] = identity[i];
      set_level(line.children[2], String(found) === String(expected) ? "good" : expected === "any" || expected === "–" ? "" : "bad");
    });
    fill_table(by_id("bus-facts"), this.facts(slave));
    const ports = [...Array(PORTS).keys()].map((port) => [
      `${port}${(slave.open_ports >> port) & 1 ? "" : ", closed"}`,
      slave.rx_errors[port], slave.forwarded_errors[port], slave.lost_links[port],
    ]);
    fill_table(by_id("bus-ports"), ports);
    set_text(by_id("bus-short"), slave.short ? "A counter of the chip had reached its end: the sums are too low." : "");
  }

  facts({ device, group, station, code, code_text, input_bits, output_bits, clock, samples_good, samples_bad, processing_errors, pdi_errors }) {
    const lines = [
      ["device", device],
      ["station address", station],
      ["AL status code", `${code} ${code_text}`],
      ["process data", `${input_bits} bits in, ${output_bits} bits out`],
      ["samples", `${samples_good} good, ${samples_bad} bad`],
      ["processing unit errors", processing_errors],
      ["PDI errors", pdi_errors],
    ];
    if (group) {
      lines.splice(1, 0, ["group", group]);
    }
    if (clock) {
      lines.push(["clock", clock.reference ? "reference clock" : `${ns(clock.delay_ns)} behind the reference clock, difference ${ns(clock.difference_ns)}`]);
      lines.push(["SYNC0", clock.sync0_cycle_ns ? `every ${ns(clock.sync0_cycle_ns)}, shift ${ns(clock.sync0_shift_ns)}` : "none"]);
    }
    return lines;
  }
}
