// SPDX-License-Identifier: MIT
// The view Configuration: every option in effect, with its default, unit and origin.
import { row } from "./table.js";

const by_id = (id) => document.getElementById(id);
const FIELDS = ["option", "value", "unit", "default", "from", "takes_effect"];

// Where an option has its value from; the folder of the file is the same for all.
export function origin(option) {
  return option.file === null ? option.origin : `${option.file.split("/").pop()}:${option.line}`;
}

// Lines of `ecdaq config show --json`, one object each.
export function parse(text) {
  return text.split("\n").filter((line) => line !== "").map((line) => JSON.parse(line));
}

export async function load_options() {
  const answer = await fetch("config.json");
  if (!answer.ok) {
    throw new Error(await answer.text());
  }
  return parse(await answer.text());
}

// What outputs[] and slaves[].outputs[] say of each output, by the name of its channel.
export function outputs_of(options) {
  const values = new Map(options.map(({ option, value }) => [option, value]));
  const found = new Map();
  for (const [option, value] of values) {
    const [, item, slave] = /^((slaves\[\d+\])?\.?outputs\[\d+\])\.channel$/.exec(option) ?? [];
    if (item) {
      const of = (name) => values.get(`${item}.${name}`);
      found.set(slave ? `${values.get(`${slave}.name`)}.${value}` : value, {
        owner: of("owner"), min: of("min"), max: of("max"), fail_safe: of("fail_safe"),
      });
    }
  }
  return found;
}

export class ConfigView {
  constructor() {
    this.options = [];
    by_id("config-filter").addEventListener("input", () => this.filter());
    by_id("config-all").addEventListener("change", () => this.filter());
    by_id("config-again").addEventListener("click", () => this.load());
  }

  async load() {
    const note = by_id("config-note");
    try {
      this.show(await load_options());
    } catch (error) {
      note.textContent = `cannot be shown: ${error.message}`;
    }
  }

  show(options) {
    this.options = options;
    const own = options.find((option) => option.file !== null);
    by_id("config-file").textContent = own ? `${own.file}, as it is now.` : "No file: all have their default.";
    by_id("config-rows").replaceChildren(...options.map((option) => {
      const cells = { ...option, from: origin(option) };
      return row(...FIELDS.map((field) => String(cells[field] ?? "")));
    }));
    this.filter();
  }

  filter() {
    const wanted = by_id("config-filter").value.toLowerCase();
    const is_all = by_id("config-all").checked;
    let shown = 0;
    Array.from(by_id("config-rows").children).forEach((line, i) => {
      const is_own = is_all || this.options[i].origin !== "default";
      line.hidden = !is_own || !line.textContent.toLowerCase().includes(wanted);
      shown += line.hidden ? 0 : 1;
    });
    by_id("config-note").textContent = `${shown} of ${this.options.length} options`;
  }
}
