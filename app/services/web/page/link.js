// SPDX-License-Identifier: MIT
// The connection to the server; it is made again when it ends.
import { decode } from "./picture.js";

const AGAIN_MS = 1000;

export class Link {
  // on_message(message) gets each text as an object and each picture; on_change(is_open) the state.
  constructor(on_message, on_change) {
    this.on_message = on_message;
    this.on_change = on_change;
    this.open();
  }

  open() {
    const address = new URL("/", location.href);
    address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
    address.hash = "";
    this.socket = new WebSocket(address, "ecdaq.page.v1");
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => this.on_change(true);
    this.socket.onclose = () => {
      this.on_change(false);
      setTimeout(() => this.open(), AGAIN_MS);
    };
    this.socket.onmessage = ({ data }) => {
      this.on_message(typeof data === "string" ? JSON.parse(data) : decode(data));
    };
  }

  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) {
      this.socket.send(JSON.stringify(message));
    }
  }
}
