// SPDX-License-Identifier: MIT
// The table below the scope: numbers of each channel, and the scale and offset that its line is drawn with.
import { PLAIN, format, format_seconds, value_at } from "./picture.js";
import { button, number_field, row, set_text } from "./table.js";

const by_id = (id) => document.getElementById(id);
const NUMBERS = 8; // columns behind name and unit
const LISTED = 5;

export class ScopeTable {
  constructor({ on_scale, on_remove }) {
    this.on_scale = on_scale;
    this.on_remove = on_remove;
    this.scales = new Map(); // { scale, offset } by name, where they are not 1 and 0
  }

  scale_of(name) {
    return this.scales.get(name) ?? PLAIN;
  }

  set_scale(name, changed) {
    const scale = { ...this.scale_of(name), ...changed };
    scale.scale === 1 && scale.offset === 0 ? this.scales.delete(name) : this.scales.set(name, scale);
    this.on_scale();
  }

  // For the address: "10:0,1:-2.5"; nothing if all are plain.
  fields(names) {
    const pairs = names.map((name) => this.scale_of(name)).map(({ scale, offset }) => `${scale}:${offset}`);
    return names.some((name) => this.scales.has(name)) ? { y: pairs.join(",") } : {};
  }

  read(names, fields) {
    this.scales.clear();
    (fields.get("y") ?? "").split(",").forEach((pair, i) => {
      const [scale, offset] = pair.split(":").map(Number);
      if (names[i] !== undefined && Number.isFinite(scale) && scale !== 0 && Number.isFinite(offset)) {
        this.scales.set(names[i], { scale, offset });
      }
    });
  }

  show_rows(names, unit_of) {
    const lines = names.map((name, i) => {
      const { scale, offset } = this.scale_of(name);
      const field = (what, value, change) =>
        number_field(value, `${what} of ${name} in the picture`, (text) => this.set_scale(name, change(text)));
      const line = row(name, unit_of(name), ...Array(NUMBERS).fill(""),
        field("scale", scale, (value) => ({ scale: value || 1 })), field("offset", offset, (value) => ({ offset: value })),
        button("✕", `remove ${name}`, () => this.on_remove(name)));
      line.children[0].className = `c${i}`;
      for (let k = 2; k < 2 + NUMBERS; k++) {
        line.children[k].className = "number";
      }
      return line;
    });
    by_id("scope-rows").replaceChildren(...lines);
  }

  // cursors: two cycles; null: there are none.
  show_numbers(picture, cursors, period_s) {
    const lines = by_id("scope-rows").children;
    picture.sums.forEach((sum, i) => {
      const [a, b] = [at_cursor(picture, i, cursors?.[0]), at_cursor(picture, i, cursors?.[1])];
      const hertz = sum.period === null ? null : 1 / (sum.period * period_s);
      const texts = [sum.min, sum.max, sum.mean, sum.rms, hertz, a, b, a === null || b === null ? null : b - a];
      texts.forEach((value, k) => lines[i] && set_text(lines[i].children[2 + k], format(value)));
    });
    const time = cursors ? (cursors[1] - cursors[0]) * period_s : 0;
    set_text(by_id("scope-cursor-text"), cursors
      ? `B − A: ${format_seconds(time)}${time === 0 ? "" : `, ${format(1 / Math.abs(time))} Hz`}` : "");
  }
}

function at_cursor(picture, i, cycle) {
  return cycle === undefined ? null
    : value_at(picture, i, Math.floor(((cycle - picture.first) * picture.pixels) / picture.cycles));
}

// The newest of the events that are marks in the picture.
export function list_events(events, zero, period_s) {
  const texts = events.slice(-LISTED).map(({ cycle, severity, text }) =>
    `${format_seconds((cycle - zero) * period_s)}: ${severity}: ${text}`);
  const head = events.length > LISTED ? `${events.length} events, the newest: ` : "";
  set_text(by_id("scope-events"), `${head}${texts.join(" · ")}`);
}
