// SPDX-License-Identifier: MIT
// Table rows, made and changed in place: what did not change is not touched.

// A row with a cell for each text; a text may be a node.
export function row(...cells) {
  const line = document.createElement("tr");
  for (const cell of cells) {
    const place = document.createElement("td");
    place.append(cell);
    line.append(place);
  }
  return line;
}

export function set_text(node, text) {
  if (node.textContent !== text) {
    node.textContent = text;
  }
}

export function set_level(node, level) {
  if (node.dataset.level !== level) {
    node.dataset.level = level;
  }
}

export function button(text, label, on_click) {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = text;
  made.setAttribute("aria-label", label);
  made.addEventListener("click", on_click);
  return made;
}

// A field for a number; on_change gets it.
export function number_field(value, label, on_change) {
  const made = document.createElement("input");
  made.type = "number";
  made.step = "any";
  made.value = String(value);
  made.setAttribute("aria-label", label);
  made.addEventListener("change", () => on_change(Number(made.value) || 0));
  return made;
}
