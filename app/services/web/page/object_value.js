// SPDX-License-Identifier: MIT
// The value of an object's entry: its bytes as its data type says.

const NUMBERS = {
  BOOL: ["getUint8", 1], SINT: ["getInt8", 1], USINT: ["getUint8", 1], BYTE: ["getUint8", 1],
  INT: ["getInt16", 2], UINT: ["getUint16", 2], WORD: ["getUint16", 2],
  DINT: ["getInt32", 4], UDINT: ["getUint32", 4], DWORD: ["getUint32", 4],
  LINT: ["getBigInt64", 8], ULINT: ["getBigUint64", 8],
  REAL: ["getFloat32", 4], LREAL: ["getFloat64", 8],
};
const UNSIGNED = /^(U|BYTE|WORD|DWORD)/;
// The types of which `ecdaq sdo write` knows the values.
const WRITABLE = /^(BOOL|U?(S|D|L)?INT|L?REAL)$/;

export const is_number_type = (type) => WRITABLE.test(type);

// "02 00" of a UINT: "2 = 0x0002". Bytes of another type, or of another number, stay as they are.
export function decode(type, text) {
  const bytes = text.trim() === "" ? [] : text.trim().split(/\s+/).map((digits) => parseInt(digits, 16));
  const [get, count] = Object.hasOwn(NUMBERS, type) ? NUMBERS[type] : [];
  if (count === bytes.length) {
    const value = new DataView(Uint8Array.from(bytes).buffer)[get](0, true);
    return UNSIGNED.test(type) ? `${value} = 0x${value.toString(16).padStart(2 * count, "0")}` : String(value);
  }
  if (/^(VISIBLE_)?STRING/.test(type)) {
    const end = bytes.indexOf(0);
    return bytes.slice(0, end < 0 ? undefined : end).map((c) => (c < 0x20 || c > 0x7e ? "?" : String.fromCharCode(c))).join("");
  }
  return text.trim();
}
