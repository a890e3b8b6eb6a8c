// SPDX-License-Identifier: MIT
// A call of a service that nobody has offered, on the client that the makers of the protocol publish, with the cookie of a log-in.
// usage: node services.js URL COOKIE: capabilities, services and the answer, as JSON.
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const WebSocket = require("ws");

const [url, cookie] = process.argv.slice(2);
const client = new FoxgloveClient({
  ws: new WebSocket(url, [FoxgloveClient.SUPPORTED_SUBPROTOCOL], { headers: { Cookie: cookie } }),
});
const found = { services: [], responses: 0 };

client.on("error", (error) => {
  console.error(`services: ${error.message}`);
  process.exit(1);
});
client.on("serverInfo", ({ capabilities }) => {
  found.capabilities = capabilities;
});
client.on("advertiseServices", (services) => found.services.push(...services));
client.on("serviceCallResponse", () => found.responses++);
client.on("serviceCallFailure", () => found.responses++);
client.on("advertise", (channels) => {
  if (channels.some(({ topic }) => topic === "/ecdaq/piccolo0")) {
    const data = new TextEncoder().encode('{"channel":"piccolo0.led","value":1}');
    client.sendServiceCallRequest({ serviceId: 1, callId: 1, encoding: "json", data: new DataView(data.buffer) });
  }
});
client.on("status", (status) => {
  found.status = status;
  process.stdout.write(JSON.stringify(found), () => process.exit(0));
});
