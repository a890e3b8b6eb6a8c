// SPDX-License-Identifier: MIT
// The view Recordings.
import { row, set_level } from "./table.js";

const by_id = (id) => document.getElementById(id);
const LEVELS = { recording: "good", finished: "good", unfinished: "warning", damaged: "bad", unreadable: "bad" };
const UNITS = ["B", "kB", "MB", "GB", "TB"];

export function format_bytes(bytes) {
  let unit = 0;
  let value = bytes;
  while (value >= 1000 && unit < UNITS.length - 1) {
    value /= 1000;
    unit++;
  }
  return `${unit === 0 ? value : value.toPrecision(value < 1000 && value >= 100 ? 4 : 3)} ${UNITS[unit]}`;
}

// 3725.4 is "1:02:05".
export function format_length(seconds) {
  if (seconds === undefined) {
    return "–";
  }
  if (seconds < 60) {
    return `${seconds.toFixed(1)} s`;
  }
  const whole = Math.round(seconds);
  const two = (n) => String(n).padStart(2, "0");
  return `${Math.floor(whole / 3600)}:${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}`;
}

// Cycles that are missing between the first and the last one of the file; undefined: not known.
export function format_missing(missing) {
  return missing === undefined ? "–" : missing === 0 ? "none" : `${missing} cycles`;
}

function anchor(name, text, label) {
  const made = document.createElement("a");
  made.href = `recordings/${encodeURIComponent(name)}`;
  made.download = "";
  made.textContent = text;
  made.setAttribute("aria-label", label);
  return made;
}

export class RecordingsView {
  constructor() {
    by_id("recording-filter").addEventListener("input", () => this.filter());
  }

  show({ dir, error, total, bytes, recordings }) {
    by_id("recording-note").textContent = error
      ? `${dir} cannot be read: ${error}`
      : `${total} in ${dir}, ${format_bytes(bytes)}${total > recordings.length ? `; the newest ${recordings.length} are listed` : ""}`;
    by_id("recording-rows").replaceChildren(...recordings.map((recording) => this.line(recording)));
    this.filter();
  }

  line({ name, bytes, state, kept, start_ms, seconds, missing }) {
    const start = start_ms === undefined ? "–" : new Date(start_ms).toISOString().slice(0, 19).replace("T", " ");
    const links = document.createElement("span");
    const stem = name.slice(0, name.lastIndexOf("."));
    links.append(anchor(name, "MCAP", `${name} as MCAP`));
    if (state === "finished" || state === "recording") {
      links.append(" ", anchor(`${stem}.csv`, "CSV", `${name} as CSV`));
    }
    const line = row(name, start, format_length(seconds), format_bytes(bytes),
      kept ? `${state}, kept` : state, format_missing(missing), links);
    set_level(line.children[4], LEVELS[state] ?? "bad");
    if (missing > 0) {
      set_level(line.children[5], "warning");
    }
    for (const cell of [2, 3]) {
      line.children[cell].className = "number";
    }
    return line;
  }

  filter() {
    const wanted = by_id("recording-filter").value.toLowerCase();
    for (const line of by_id("recording-rows").children) {
      line.hidden = !line.textContent.toLowerCase().includes(wanted);
    }
  }
}
