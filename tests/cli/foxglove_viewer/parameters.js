// SPDX-License-Identifier: MIT
// Parameters on the client that the makers of the protocol publish.
// usage: node parameters.js URL NAME...: the values of these, of all, and the answer to an attempt to set the first, as JSON.
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const WebSocket = require("ws");

const [url, ...names] = process.argv.slice(2);
const client = new FoxgloveClient({
  ws: new WebSocket(url, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]),
});
const found = {};

client.on("error", (error) => {
  console.error(`parameters: ${error.message}`);
  process.exit(1);
});
client.on("serverInfo", ({ capabilities }) => {
  found.capabilities = capabilities;
});
client.on("advertise", (channels) => {
  if (channels.some(({ topic }) => topic === "/ecdaq/piccolo0")) {
    client.getParameters(names, "some");
    client.getParameters([], "all");
    client.setParameters([{ name: names[0], value: 1 }], "set");
  }
});
client.on("parameterValues", ({ parameters, id }) => {
  found[id] = parameters;
  finish();
});
client.on("status", (status) => {
  found.status = status;
  finish();
});

function finish() {
  if (found.some && found.all && found.status) {
    process.stdout.write(JSON.stringify(found), () => process.exit(0));
  }
}
