// SPDX-License-Identifier: MIT
// The tree of ports as text before each name, without a DOM.

// The order in which a frame passes the ports, behind the one it came in by.
const PORT_ORDER = [0, 3, 1, 2];
const DEPTH_MAX = 8;

// Does a frame that leaves slave i by @port come to another of its branches afterwards?
function has_later_branch(slaves, children, i, port) {
  const at = PORT_ORDER.indexOf(port);
  for (let k = 1; k < PORT_ORDER.length; k++) {
    const next = PORT_ORDER[(at + k) % PORT_ORDER.length];
    if (next === slaves[i].port) {
      return false;
    }
    if (children[i].has(next)) {
      return true;
    }
  }
  return false;
}

// "│├" before the name of each slave; the last branch of a slave goes on in its own column.
export function branches(slaves) {
  const children = slaves.map(() => new Set());
  for (const { parent, parent_port } of slaves) {
    if (parent >= 0) {
      children[parent].add(parent_port);
    }
  }
  const depth = [];
  return slaves.map(({ parent, parent_port }, i) => {
    const is_branch = parent >= 0 && has_later_branch(slaves, children, parent, parent_port);
    depth[i] = parent >= 0 ? depth[parent] + Number(is_branch) : 0;
    const drawn = "│ ".repeat(Math.min(depth[i], DEPTH_MAX));
    return is_branch ? `${drawn.slice(0, -2)}├ ` : drawn;
  });
}
