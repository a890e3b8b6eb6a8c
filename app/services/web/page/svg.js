// SPDX-License-Identifier: MIT
// A drawing context that makes SVG: the part of CanvasRenderingContext2D that the charts use.

const ANCHORS = { left: "start", center: "middle", right: "end" };
const short = (value) => String(Math.round(value * 100) / 100);
const escape = (text) => String(text).replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);

export class SvgContext {
  constructor(width, height) {
    this.size = { width, height };
    this.parts = [];
    this.path = "";
    this.dash = [];
    this.textAlign = "left";
  }

  setTransform() {} // always 1:1

  setLineDash(dash) {
    this.dash = dash;
  }

  beginPath() {
    this.path = "";
  }

  moveTo(x, y) {
    this.path += `M${short(x)} ${short(y)}`;
  }

  lineTo(x, y) {
    this.path += `${this.path === "" ? "M" : "L"}${short(x)} ${short(y)}`;
  }

  stroke() {
    const dash = this.dash.length > 0 ? ` stroke-dasharray="${this.dash.join(" ")}"` : "";
    this.parts.push(`<path d="${this.path}" fill="none" stroke="${escape(this.strokeStyle)}" ` +
      `stroke-width="${this.lineWidth}"${dash}/>`);
  }

  fillRect(x, y, width, height) {
    this.parts.push(`<rect x="${short(x)}" y="${short(y)}" width="${short(width)}" height="${short(height)}" ` +
      `fill="${escape(this.fillStyle)}"/>`);
  }

  fillText(text, x, y) {
    this.parts.push(`<text x="${short(x)}" y="${short(y)}" text-anchor="${ANCHORS[this.textAlign]}" ` +
      `fill="${escape(this.fillStyle)}">${escape(text)}</text>`);
  }

  text() {
    const { width, height } = this.size;
    return `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" ` +
      `viewBox="0 0 ${width} ${height}" font-family="sans-serif" font-size="12">\n${this.parts.join("\n")}\n</svg>\n`;
  }
}
