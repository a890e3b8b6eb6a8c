// SPDX-License-Identifier: MIT
// The controls of the scope's trigger: what is asked of the server, and what the address has of it.

const by_id = (id) => document.getElementById(id);

// Which fields each kind has.
const KINDS = {
  none: [], rising: ["channel", "level"], falling: ["channel", "level"], above: ["channel", "level"],
  below: ["channel", "level"], enters: ["channel", "level", "level2"], leaves: ["channel", "level", "level2"],
  bad: ["channel"], lost: [], event: ["severity"],
};
const PLACES = { channel: "scope-trigger", level: "scope-level", level2: "scope-level2", severity: "scope-severity" };
const MODES = ["auto", "normal", "single"];
const number_in = (id) => Number(by_id(id).value) || 0;

export class Trigger {
  // on_change() is called when a control is changed.
  constructor(on_change) {
    this.name = undefined; // of the channel that was chosen, or is in the address
    const ids = [...Object.values(PLACES), "scope-edge", "scope-mode", "scope-hold", "scope-before"];
    for (const id of ids) {
      by_id(id).addEventListener("input", () => {
        this.name = by_id("scope-trigger").selectedOptions[0]?.text ?? this.name;
        this.show();
        on_change();
      });
    }
    this.show();
  }

  kind() {
    return by_id("scope-edge").value;
  }

  mode() {
    return by_id("scope-mode").value;
  }

  channel() {
    return Number(by_id("scope-trigger").value);
  }

  // Levels to be drawn.
  levels() {
    return ["level", "level2"].filter((field) => KINDS[this.kind()].includes(field)).map((field) => number_in(PLACES[field]));
  }

  show() {
    for (const [field, id] of Object.entries(PLACES)) {
      by_id(id).closest("label").hidden = !KINDS[this.kind()].includes(field);
    }
    for (const id of ["scope-mode", "scope-hold", "scope-before"]) {
      by_id(id).closest("label").hidden = this.kind() === "none";
    }
  }

  set_channels(options, index_of) {
    by_id("scope-trigger").replaceChildren(...options);
    by_id("scope-trigger").value = String(Math.max(index_of(this.name), 0));
  }

  // The fields of a request for a picture of so many cycles; last: cycle of the trigger that is shown.
  request(cycles, period_s, last) {
    const hold = Math.max(Math.round(number_in("scope-hold") / 1000 / period_s), 0);
    return {
      edge: this.kind(), trigger: this.channel(), level: number_in("scope-level"), level2: number_in("scope-level2"),
      severity: by_id("scope-severity").value, before: Math.floor((cycles * number_in("scope-before")) / 100), hold,
      ...(hold > 0 && last !== undefined ? { last } : {}),
    };
  }

  // For the address.
  fields(name_of) {
    return {
      edge: this.kind(), t: name_of(this.channel()) ?? "", l: number_in("scope-level"), l2: number_in("scope-level2"),
      sev: by_id("scope-severity").value, hold: number_in("scope-hold"), pre: number_in("scope-before"), m: this.mode(),
    };
  }

  read(fields) {
    const choose = (id, wanted, otherwise) => {
      const values = [...by_id(id).options].map((option) => option.value);
      by_id(id).value = values.includes(wanted) ? wanted : otherwise;
    };
    this.name = fields.get("t") || undefined;
    choose("scope-edge", fields.get("edge"), "none");
    choose("scope-severity", fields.get("sev"), "warning");
    choose("scope-before", fields.get("pre"), "25");
    by_id("scope-mode").value = MODES.find((mode) => mode === fields.get("m")) ?? "auto";
    by_id("scope-level").value = String(Number(fields.get("l")) || 0);
    by_id("scope-level2").value = String(Number(fields.get("l2")) || 0);
    by_id("scope-hold").value = String(Math.max(Number(fields.get("hold")) || 0, 0));
    this.show();
  }
}
