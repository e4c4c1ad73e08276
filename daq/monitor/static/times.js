// Times are the laboratory's, wherever this browser is; and small helpers that every part of the page needs.
let zone = null;

export function setZone(content) { zone = content; formats = new Map(); }
export function zoneName() { return zone ? zone.name || `UTC${zone.offset_min < 0 ? "−" : "+"}${Math.abs(zone.offset_min) / 60}` : ""; }

// one formatter for each way of writing a time: a page asks twenty times a second
let formats = new Map();
function format(options, timeZone) {
  const key = JSON.stringify([options, timeZone]);
  if (!formats.has(key)) formats.set(key, new Intl.DateTimeFormat("sv-SE", { ...options, hour12: false, timeZone }));
  return formats.get(key);
}
function written(date, options) {
  if (isNaN(date)) return "";
  if (!zone) return format(options).format(date);
  try {
    if (zone.name) return format(options, zone.name).format(date);
  } catch { /* a name that this browser does not know: by the offset */ }
  return format(options, "UTC").format(new Date(date.getTime() + 60000 * zone.offset_min));
}
export function clock(when, seconds = true) {
  return written(new Date(when), { hour: "2-digit", minute: "2-digit", ...(seconds ? { second: "2-digit" } : {}) });
}
export function dayAndClock(when) {
  return written(new Date(when), { year: "numeric", month: "2-digit", day: "2-digit", hour: "2-digit", minute: "2-digit" });
}
export function lasting(seconds) {
  const s = Math.max(0, Math.round(seconds)), m = Math.floor(s / 60), h = Math.floor(m / 60);
  const two = (n) => String(n).padStart(2, "0");
  return h ? `${h}:${two(m % 60)}:${two(s % 60)}` : `${m}:${two(s % 60)}`;
}

export const $ = (id) => document.getElementById(id);
export function make(tag, className, text) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  if (text !== undefined && text !== null) element.textContent = String(text);
  return element;
}
export function put(id, text) { const element = $(id); if (element.textContent !== text) element.textContent = text; }
export function fixed(value, digits) { return value === null || value === undefined ? "–" : value.toFixed(digits).replace(/^-(?=[0.]*$)/, "").replace("-", "−"); }
export function choices(select, entries, chosen) {
  select.replaceChildren(...entries.map(([value, text]) => { const one = make("option", "", text); one.value = value; return one; }));
  select.value = entries.some(([value]) => value === chosen) ? chosen : entries[0]?.[0] ?? "";
}
// A cell of a table that a phone shows as labelled rows (monitor.css): laid out as blocks, it needs its role said.
export function cell(text, label = "", unit = "") {
  const td = make("td", text === "–" ? "none" : "", text);
  td.setAttribute("role", "cell");
  td.dataset.label = label;
  td.dataset.unit = unit;
  return td;
}
