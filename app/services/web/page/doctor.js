// SPDX-License-Identifier: MIT
// What `ecdaq doctor` finds, in the view State: what is not as it should be, and what to do.
import { row, set_level } from "./table.js";

const by_id = (id) => document.getElementById(id);
const LEVELS = { OK: "good", WARN: "warning", FAIL: "bad" };
const ORDER = ["FAIL", "WARN", "OK", "SKIP"];

export class Doctor {
  constructor() {
    by_id("doctor-all").addEventListener("change", () => this.filter());
    by_id("doctor-again").addEventListener("click", () => this.load());
  }

  async load() {
    try {
      const answer = await fetch("doctor.json");
      if (!answer.ok) {
        throw new Error(await answer.text());
      }
      this.show(await answer.json());
    } catch (error) {
      by_id("doctor-note").textContent = `cannot be shown: ${error.message}`;
    }
  }

  show({ ok, warn, fail, skip, check }) {
    by_id("doctor-note").textContent = `${fail} to fix, ${warn} warnings, ${ok} in order, ${skip} not checked`;
    const sorted = [...check].sort((a, b) => ORDER.indexOf(a.level) - ORDER.indexOf(b.level));
    by_id("doctor-rows").replaceChildren(...sorted.map(({ name, level, value, remedy }) => {
      const line = row(name, level, value, remedy ?? "");
      if (level in LEVELS) {
        set_level(line.children[1], LEVELS[level]);
      }
      return line;
    }));
    this.filter();
  }

  filter() {
    for (const line of by_id("doctor-rows").children) {
      const level = line.children[1].textContent;
      line.hidden = !by_id("doctor-all").checked && level !== "FAIL" && level !== "WARN";
    }
  }
}
