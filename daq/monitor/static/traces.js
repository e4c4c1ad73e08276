// Two channels over time: the last half minute as it comes, or any span of the campaign as its server keeps it;
// behind the campaign's end the run that is looked at, or the span that was chosen.
import { TraceChart } from "./charts.js";
import { $, choices, fixed, lasting, make, put } from "./times.js";

const RENEW_MS = 2000;
const SPANS = { live: 30, run: null, "300": 300, "1800": 1800, whole: Infinity, chosen: null };
const panes = [];
const state = { span: "live", from: 0, to: 0, units: new Map(), last: null, busy: false, again: false, held: false, run: null };

export function begin() {
  for (const [index, id] of [[0, "stroke"], [1, "force"]]) {
    const pane = { chart: new TraceChart($(`${id}-chart`), index ? "--force" : "--stroke", { least: index ? 20 : 5, zoomed, pointed }), select: $(`${id}-channel`), index };
    pane.select.addEventListener("change", () => { pane.chart.y.reset(); label(pane); renew(); });
    panes.push(pane);
  }
  $("span").addEventListener("change", () => { state.span = $("span").value; shown(); });
  for (const [id, act] of [["zoom-in", () => zoom(0.5)], ["zoom-out", () => zoom(2)], ["earlier", () => move(-0.5)], ["later", () => move(0.5)]]) $(id).addEventListener("click", act);
  setInterval(() => { if (!document.hidden && !state.held && state.span !== "chosen") renew(); }, RENEW_MS);
}

// every channel that is recorded can be chosen
export function setChannels(list) {
  state.units = new Map(list.map((one) => [one.name, one.unit]));
  for (const [index, pane] of panes.entries()) {
    choices(pane.select, list.map((one) => [one.name, one.unit ? `${one.name} in ${one.unit}` : one.name]), pane.select.value || (index ? "force" : "stroke"));
    if (state.span !== "run") label(pane);
  }
}
function label(pane) { const unit = state.units.get(pane.select.value) || ""; pane.chart.label(`${pane.select.value} in ${unit}`, unit); }

export function isLive() { return !state.held && state.span === "live" && panes[0].select.value === "stroke" && panes[1].select.value === "force"; }
export function showRows(t, s, f, now) {
  if (!isLive()) return;
  const xs = t.map((at) => at - now);
  panes[0].chart.show(xs, s, s, [-SPANS.live, 0], "seconds before now");
  panes[1].chart.show(xs, f, f, [-SPANS.live, 0], "seconds before now");
}
// a run of a campaign that has ended: at once where its half minute was looked at, else when it is asked for
export function showRun(name, { t, s, f }, asked) {
  state.run = { name, t, s, f };
  if (asked || state.span === "live") $("span").value = state.span = "run";
  shown();
}
// behind the end nothing comes any more; what the server of this page has kept can still be looked at
export function hold(on) {
  if (state.held === on) return;
  state.held = on;
  for (const one of $("span").options) one.hidden = one.disabled = on ? one.value === "live" : one.value === "run";
  if (!on && state.span === "run") $("span").value = state.span = "live";
  $("trace-tools").hidden = on;
  if (on) ask("inf", "inf").then((h) => { state.last = h; $("trace-tools").hidden = state.held && h.first_s === null; }, () => {});
  shown();
}
function shown() {
  const run = state.span === "run";
  for (const id of ["zoom-in", "zoom-out", "earlier", "later", "stroke-channel", "force-channel"]) $(id).disabled = run;
  put("traces-title", run ? `Over time: ${state.run.name}` : "Over time");
  if (!run) { for (const pane of panes) { pane.chart.y.reset(); label(pane); } renew(); return; }
  const { t, s, f } = state.run;
  put("trace-said", "");
  for (const [pane, ys] of [[panes[0], s], [panes[1], f]]) { pane.chart.y.reset(); pane.chart.label(pane.index ? "force in kN" : "stroke in mm"); pane.chart.show(t, ys, ys, [t[0], t[t.length - 1]], "seconds"); }
}

function range() {
  if (state.span === "chosen") return [state.from, state.to];
  const last = state.last?.last_s;
  const length = SPANS[state.span];
  return last === null || last === undefined || length === Infinity ? ["-inf", "inf"] : [last - length, "inf"];
}

async function renew() {
  if (state.span === "run" || isLive()) return;
  if (state.busy) { state.again = true; return; }
  state.busy = true;
  try {
    if (!state.last) state.last = await ask("inf", "inf");
    const [from, to] = range();
    state.last = await ask(from, to);
    draw();
  } catch { /* the connection's loss is said at the top */ }
  state.busy = false;
  if (state.again) { state.again = false; renew(); }
}
async function ask(from, to) {
  const names = panes.map((pane) => pane.select.value).join(",");
  const response = await fetch(`/history?from=${from}&to=${to}&channels=${encodeURIComponent(names)}`, { credentials: "same-origin" });
  if (!response.ok) throw new Error(String(response.status));
  return response.json();
}

function draw() {
  const h = state.last;
  if (!h || h.first_s === null) { put("trace-said", "nothing recorded yet"); return; }
  const [from, to] = range(), low = typeof from === "number" ? Math.max(from, h.first_s) : h.first_s, high = typeof to === "number" ? to : h.last_s;
  for (const pane of panes) {
    const values = h.values[pane.select.value];
    if (values) pane.chart.show(h.t, values.low, values.high, [low, Math.max(high, low + 1)], "time since the start", lasting);
  }
  put("trace-said", `${lasting(low)} to ${lasting(high)} since the start, least and greatest value of every ${h.width_s >= 1 ? `${Math.round(h.width_s)} s` : `${h.width_s} s`}`);
}

function zoomed(from, to) {
  if (isLive()) {  // a span of the half minute that is shown
    const last = state.last?.last_s;
    if (last === undefined || last === null) { ask("inf", "inf").then((h) => { state.last = h; if (h.last_s !== null) choose(h.last_s + from, h.last_s + to); }, () => {}); return; }
    ask("inf", "inf").then((h) => choose(h.last_s + from, h.last_s + to), () => {});
    return;
  }
  choose(from, to);
}
function choose(from, to) {
  if (state.span === "run") return;  // of a run all is shown
  state.span = "chosen"; $("span").value = "chosen"; [state.from, state.to] = [from, Math.max(to, from + 1)]; renew(); }
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
  const run = state.span === "run";
  const parts = panes.map((pane) => {
    const found = pane.chart.at(x), name = run ? "" : pane.select.value;
    if (!found) return "";
    const [low, high] = found, unit = state.units.get(name) || (pane.index ? "kN" : "mm");
    return `${name || (pane.index ? "force" : "stroke")} ${low === high ? fixed(low, 2) : `${fixed(low, 2)} … ${fixed(high, 2)}`} ${unit}`;
  });
  put("cursor", `${isLive() || run ? `${fixed(x, 2)} s` : lasting(x)}: ${parts.filter(Boolean).join(", ")}`);
}
