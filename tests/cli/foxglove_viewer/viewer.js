// SPDX-License-Identifier: MIT
// A viewer on the client that the makers of the protocol publish.
// usage: node viewer.js URL MESSAGES TOPIC...: a line of JSON for each message, until the first topic has so many.
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const WebSocket = require("ws");

const [url, messages, ...topics] = process.argv.slice(2);
const client = new FoxgloveClient({
  ws: new WebSocket(url, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]),
});
const channels = new Map(); // by id
const topicOf = new Map(); // by subscription
const lines = [];
let count = 0;

function fail(why) {
  console.error(`viewer: ${why}`);
  process.exit(1);
}

client.on("error", (error) => fail(error.message));
client.on("close", () => fail("closed by the server"));
client.on("status", (status) => fail(`status: ${status.message}`));
client.on("advertise", (advertised) => {
  for (const channel of advertised) {
    channels.set(channel.id, channel);
    if (topics.includes(channel.topic)) {
      topicOf.set(client.subscribe(channel.id), channel);
    }
  }
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const channel = topicOf.get(subscriptionId);
  const bytes = Buffer.from(data.buffer, data.byteOffset, data.byteLength);
  lines.push(JSON.stringify({ topic: channel.topic, time: String(timestamp), data: bytes.toString("hex") }));
  if (channel.topic === topics[0] && ++count === Number(messages)) {
    for (const channel of channels.values()) {
      lines.push(JSON.stringify({ channel }));
    }
    process.stdout.write(lines.join("\n") + "\n", () => process.exit(0));
  }
});
