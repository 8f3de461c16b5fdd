"use strict";
// What pages share: `about`, which says what is shown, `c` of the columns of numbers (parts.py), and elements.
const about = JSON.parse(document.getElementById("about").textContent), c = {};
const dark = matchMedia("(prefers-color-scheme: dark)").matches && !matchMedia("print").matches;
const ink = dark ? "#e6e9ef" : "#1d2430", dim = dark ? "#97a1b2" : "#667085", rule = dark ? "#2e3744" : "#d9dee7";
const element = (id) => document.getElementById(id);
const make = (tag, text, className) => {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  return made;
};
const digits = (value, n = 4) => (value === null || value === undefined || !Number.isFinite(value) ? "–" : Number(value.toPrecision(n)).toString());
const short = (value) => (Math.abs(value) < 5e-5 ? "0" : digits(value)); // in narrow columns
const fixed = (value, n) => (Number.isFinite(value ?? NaN) ? value.toFixed(n) : "–"); // so many digits after the point
const ARRAYS = { f8: Float64Array, f4: Float32Array, i4: Int32Array, u1: Uint8Array };
function bytesOf(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let k = 0; k < bytes.length; k++) bytes[k] = raw.charCodeAt(k);
  return bytes;
}
async function unpack(name, type) {
  const held = element("column-" + name), bytes = bytesOf(held.textContent);
  held.remove();
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const buffer = await new Response(stream).arrayBuffer();
  c[name] = new ARRAYS[type](buffer);
}
