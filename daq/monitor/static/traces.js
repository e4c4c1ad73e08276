// Two channels over time: the last half minute as it comes, or any span of the campaign as its server keeps it;
// behind the campaign's end the run that is looked at, from its file, or the span that was chosen.
import { TraceChart } from "./charts.js";
import { $, choices, fixed, lasting, make, put } from "./times.js";

const RENEW_MS = 2000;
const SPANS = { live: 30, run: Infinity, "300": 300, "1800": 1800, whole: Infinity };
const LEAST_S = { campaign: 1, run: 0.05 };
const panes = [];
// "of": what a span is a span of, the campaign or the run that is looked at
const state = { span: "live", of: "campaign", from: 0, to: 0, units: new Map(), last: null, busy: false, again: false, held: false, run: null };

export function begin() {
  for (const [index, id] of [[0, "stroke"], [1, "force"]]) {
    const pane = { chart: new TraceChart($(`${id}-chart`), index ? "--force" : "--stroke", { least: index ? 20 : 5, zoomed, pointed }), select: $(`${id}-channel`), index };
    pane.select.addEventListener("change", () => { pane.chart.y.reset(); label(pane); renew(); });
    panes.push(pane);
  }
  $("span").addEventListener("change", () => { span($("span").value); shown(); });
  for (const [id, act] of [["zoom-in", () => zoom(0.5)], ["zoom-out", () => zoom(2)], ["earlier", () => move(-0.5)], ["later", () => move(0.5)]]) $(id).addEventListener("click", act);
  setInterval(() => { if (!document.hidden && !state.held && state.span !== "chosen") renew(); }, RENEW_MS);
}

// every channel that is recorded can be chosen
export function setChannels(list) {
  state.units = new Map(list.map((one) => [one.name, one.unit]));
  for (const [index, pane] of panes.entries()) {
    choices(pane.select, list.map((one) => [one.name, one.unit ? `${one.name} in ${one.unit}` : one.name]), pane.select.value || (index ? "force" : "stroke"));
    label(pane);
  }
}
function span(name) {
  const of = name === "run" ? "run" : name === "chosen" ? state.of : "campaign";
  if (of !== state.of) state.last = null;
  [state.span, state.of] = [name, of];
  $("span").value = name;
  const chosen = $("span").querySelector("[value=chosen]");
  chosen.hidden = chosen.disabled = name !== "chosen";
}
function label(pane) { const unit = state.units.get(pane.select.value) || ""; pane.chart.label(`${pane.select.value} in ${unit}`, unit); }

export function isLive() { return !state.held && state.span === "live" && panes[0].select.value === "stroke" && panes[1].select.value === "force"; }
export function showRows(t, s, f, now) {
  if (!isLive()) return;
  put("trace-said", "");  // it was said of another span
  const xs = t.map((at) => at - now);
  panes[0].chart.show(xs, s, s, [-SPANS.live, 0], "seconds before now");
  panes[1].chart.show(xs, f, f, [-SPANS.live, 0], "seconds before now");
}
// a run of a campaign that has ended: at once where its half minute was looked at, or another run; else when it is asked for
export function showRun(name, file, asked) {
  state.run = { name, file };
  if (state.of === "run") state.last = null;
  if (asked || state.span === "live" || state.of === "run") span("run");
  tools();
  shown();
}
// the past has come in from the campaign's files
export function renewed() { if (!state.held) return; if (state.of === "campaign") state.last = null; tools(); renew(); }
// behind the end nothing comes any more; what was recorded can still be looked at
export function hold(on) {
  if (state.held === on) return;
  state.held = on;
  for (const one of $("span").options) if (one.value === "live" || one.value === "run") one.hidden = one.disabled = on === (one.value === "live");
  if (!on) { state.run = null; if (state.of === "run") span("live"); }
  tools();
  shown();
}
async function tools() {
  $("trace-tools").hidden = state.held && !state.run;
  $("span").querySelector("[value=run]").disabled = !state.run;
  if (!state.held) return;
  try {
    const known = (await ask("inf", "inf", "campaign")).first_s !== null;
    $("trace-tools").hidden = state.held && !state.run && !known;
    for (const one of $("span").options) if (["300", "1800", "whole"].includes(one.value)) one.hidden = one.disabled = state.held && !known;
  } catch { /* the connection's loss is said at the top */ }
}
function shown() {
  put("traces-title", state.of === "run" ? `Over time: ${state.run.name}` : "Over time");
  for (const pane of panes) { pane.chart.y.reset(); label(pane); }
  renew();
}

function range() {
  if (state.span === "chosen") return [state.from, state.to];
  const last = state.last?.last_s;
  const length = SPANS[state.span];
  return last === null || last === undefined || length === Infinity ? ["-inf", "inf"] : [last - length, "inf"];
}

async function renew() {
  if (isLive() || (state.of === "run" && !state.run)) return;
  if (state.busy) { state.again = true; return; }
  state.busy = true;
  try {
    if (!state.last) state.last = await ask("inf", "inf");
    const [from, to] = range(), of = state.of + state.run?.file, found = await ask(from, to);
    if (of === state.of + state.run?.file) { state.last = found; draw(); } else state.again = true;
  } catch { if (state.of === "run") put("trace-said", "this run cannot be read"); /* a lost connection is said at the top */ }
  state.busy = false;
  if (state.again) { state.again = false; renew(); }
}
async function ask(from, to, of = state.of) {
  const names = panes.map((pane) => pane.select.value).join(","), run = of === "run" ? `&run=${encodeURIComponent(state.run.file)}` : "";
  const response = await fetch(`/history?from=${from}&to=${to}&channels=${encodeURIComponent(names)}${run}`, { credentials: "same-origin" });
  if (!response.ok) throw new Error(String(response.status));
  return response.json();
}

function draw() {
  const h = state.last, run = state.of === "run";
  if (!h || h.first_s === null) { put("trace-said", "nothing recorded yet"); return; }
  if (h.channels.some((one) => !state.units.has(one.name))) setChannels([...h.channels, ...[...state.units].filter(([name]) => !h.channels.some((one) => one.name === name)).map(([name, unit]) => ({ name, unit }))]);
  const [from, to] = range(), low = typeof from === "number" ? Math.max(from, h.first_s) : h.first_s, high = typeof to === "number" ? Math.min(to, Math.max(h.last_s, low)) : h.last_s;
  const zero = h.first_s, xs = h.t.map((at) => at - zero), none = xs.map(() => null);
  for (const pane of panes) {
    const values = h.values[pane.select.value] || { low: none, high: none };
    pane.chart.show(xs, values.low, values.high, [low - zero, Math.max(high, low + LEAST_S[state.of]) - zero], run ? "seconds of the run" : "time since the start", run ? null : lasting);
  }
  const told = run ? (at) => `${fixed(at, high - low < 20 ? 2 : 1)} s` : lasting, width = h.width_s;
  put("trace-said", `${told(low - zero)} to ${told(high - zero)} ${run ? "of the run" : "since the start"}${run && width < 0.01 ? "" : `, least and greatest value of every ${width >= 1 ? `${Math.round(width)} s` : `${Number(width.toPrecision(2))} s`}`}`);
}

function zoomed(from, to) {
  if (isLive()) { ask("inf", "inf").then((h) => { state.last = h; if (h.last_s !== null) choose(h.last_s + from, h.last_s + to); }, () => {}); return; }
  const zero = state.last?.first_s || 0;
  choose(zero + from, zero + to);
}
function choose(from, to) { span("chosen"); [state.from, state.to] = [from, Math.max(to, from + LEAST_S[state.of])]; renew(); }
async function window_() {
  if (!state.last || isLive()) state.last = await ask("inf", "inf");
  const h = state.last, [from, to] = isLive() ? [h.last_s - SPANS.live, h.last_s] : range();
  return [typeof from === "number" ? from : h.first_s, typeof to === "number" ? to : h.last_s];
}
async function zoom(factor) { const [a, b] = await window_(), middle = (a + b) / 2, half = factor * (b - a) / 2; choose(Math.max(middle - half, state.last.first_s), Math.min(middle + half, Math.max(state.last.last_s, middle))); }
async function move(share) { const [a, b] = await window_(), by = share * (b - a), first = state.last.first_s, last = state.last.last_s; const shift = Math.max(first - a, Math.min(by, last - b)); choose(a + shift, b + shift); }

function pointed(index, x) {
  for (const pane of panes) if (pane.index !== index) pane.chart.point(x);
  if (x === null) { put("cursor", ""); return; }
  const run = state.of === "run";
  const parts = panes.map((pane) => {
    const found = pane.chart.at(x), name = pane.select.value;
    if (!found) return "";
    const [low, high] = found, unit = state.units.get(name) || (pane.index ? "kN" : "mm");
    return `${name} ${low === high ? fixed(low, 2) : `${fixed(low, 2)} … ${fixed(high, 2)}`} ${unit}`;
  });
  put("cursor", `${isLive() || run ? `${fixed(x, 2)} s` : lasting(x)}: ${parts.filter(Boolean).join(", ")}`);
}
