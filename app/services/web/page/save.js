// SPDX-License-Identifier: MIT
// What is shown, as a file.
import { paint, plot_area } from "./chart.js";
import { SvgContext } from "./svg.js";

function follow(href, name) {
  const made = document.createElement("a");
  made.href = href;
  made.download = name;
  made.click();
}

function download(blob, name) {
  const href = URL.createObjectURL(blob);
  follow(href, name);
  setTimeout(() => URL.revokeObjectURL(href), 10000);
}

// The cycles of the picture with all channels, as they were recorded; of a live one when the newest ones are.
export function save_recording({ first, cycles }, { session, recorded_ms }, is_live) {
  const last = first + cycles - 1;
  const href = `window.mcap?session=${session}&from=${first}&to=${last}`;
  setTimeout(() => follow(href, `ecdaq-${first}-${last}.mcap`), is_live ? recorded_ms : 0);
}

// The options of chart.js, and the channels of the table.
export function save_as(kind, canvas, picture, options) {
  const name = `ecdaq-${picture.first}-${picture.first + picture.cycles - 1}.${kind}`;
  const { clientWidth: width, clientHeight: height } = canvas;
  if (kind === "png") {
    canvas.toBlob((blob) => download(blob, name), "image/png");
  } else if (kind === "svg") {
    const context = new SvgContext(width, height);
    paint(context, plot_area(width, height), picture, options);
    download(new Blob([context.text()], { type: "image/svg+xml" }), name);
  } else {
    const text = csv(picture, options.channels, options.period_s, options.zero);
    download(new Blob([text], { type: "text/csv" }), name);
  }
}

const quote = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
const number = (value) => (Number.isNaN(value) ? "" : String(Number(value.toPrecision(9))));

// A line for each column: with few samples one value, else the least and the largest. Empty: no good sample.
export function csv(picture, channels, period_s, zero) {
  const is_exact = picture.pixels === picture.cycles;
  const names = channels.flatMap(({ name, unit }) => {
    const full = unit === "" ? name : `${name} [${unit}]`;
    return is_exact ? [full] : [`${full} min`, `${full} max`];
  });
  const lines = [["cycle", "time [s]", ...names].map(quote).join(",")];
  for (let k = 0; k < picture.pixels; k++) {
    const cycle = picture.first + Math.ceil((k * picture.cycles) / picture.pixels);
    const values = picture.columns.flatMap(({ min, max }) => (is_exact ? [min[k]] : [min[k], max[k]]));
    lines.push([cycle, number((cycle - zero) * period_s), ...values.map(number)].join(","));
  }
  return `${lines.join("\r\n")}\r\n`;
}
