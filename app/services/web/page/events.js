// SPDX-License-Identifier: MIT
// The view Events: in lines as the server folds them, or each alone.
import { button, row, set_level } from "./table.js";

const by_id = (id) => document.getElementById(id);
const SEVERITIES = ["info", "notice", "warning", "error"];
const EVENTS = 500;
const FILTERS = ["event-filter", "event-severity", "event-slave", "event-kind"];

export class EventsView {
  constructor({ on_scope }) {
    this.on_scope = on_scope;
    this.events = []; // each alone, oldest first
    this.folds = [];
    for (const id of FILTERS) {
      by_id(id).addEventListener("input", () => this.filter());
    }
    by_id("event-all").addEventListener("input", () => this.show());
  }

  set_table({ slaves }) {
    const chosen = by_id("event-slave").value;
    const options = slaves.map((name, position) => new Option(`${position} ${name}`, position));
    by_id("event-slave").replaceChildren(new Option("all", ""), ...options);
    by_id("event-slave").value = chosen;
    this.filter();
  }

  clear() {
    this.events = [];
    this.folds = [];
    this.show();
  }

  add(events) {
    this.events.push(...events.map((event) => ({ ...event, kinds: [event.name], count: 1 })));
    this.events.splice(0, this.events.length - EVENTS);
    if (by_id("event-all").checked) {
      this.show();
    }
  }

  set_folds({ lines }) {
    this.folds = lines;
    if (!by_id("event-all").checked) {
      this.show();
    }
  }

  // The newest one is on top.
  show() {
    const lines = by_id("event-all").checked ? this.events : this.folds;
    this.set_kinds(new Set(lines.flatMap(({ kinds }) => kinds)));
    by_id("event-rows").replaceChildren(...lines.map((event) => this.line(event)).reverse());
    this.filter();
  }

  set_kinds(kinds) {
    const select = by_id("event-kind");
    const wanted = ["", ...kinds].sort();
    if (wanted.join() !== [...select.options].map((option) => option.value).join()) {
      const chosen = kinds.has(select.value) ? select.value : "";
      select.replaceChildren(...wanted.map((kind) => new Option(kind || "all", kind)));
      select.value = chosen;
    }
  }

  line(event) {
    const time = new Date(event.ms).toISOString().slice(0, 23).replace("T", " ");
    const line = row(time, event.severity, event.kinds.join(", "), event.text,
      button("▸", `cycle ${event.cycle} in the scope`, () => this.on_scope(event.cycle)));
    set_level(line.children[1], { info: "good", notice: "good", warning: "warning" }[event.severity] ?? "bad");
    line.event = event;
    return line;
  }

  filter() {
    const wanted = by_id("event-filter").value.toLowerCase();
    const least = SEVERITIES.indexOf(by_id("event-severity").value);
    const slave = by_id("event-slave").value;
    const kind = by_id("event-kind").value;
    for (const line of by_id("event-rows").children) {
      const { event } = line;
      line.hidden = SEVERITIES.indexOf(event.severity) < least || (slave !== "" && event.slave !== Number(slave)) ||
        (kind !== "" && !event.kinds.includes(kind)) || !line.textContent.toLowerCase().includes(wanted);
    }
  }
}
