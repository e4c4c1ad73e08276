// The page. Everything that comes from a campaign is text and is only ever set as text, never as markup.
import { HeatChart, LoopChart, SENSOR_DASHES } from "./charts.js";
import { counted } from "./counted.js";
import * as cycles from "./cycles.js";
import * as results from "./results.js";
import * as rows from "./rows.js";
import { $, clock, dayAndClock, fixed, lasting, make, put, setZone, zoneName } from "./times.js";
import * as traces from "./traces.js";

const OLD_S = 1.5;          // a sample older than this is said to be old
const DRAW_MS = 60;

const state = {
  sections: {}, rights: "none", wire: null, connected: false, lostAt: null, over: false, tries: 0,
  age: null, ageAt: 0, dirty: false, drawn: 0,
};
const charts = {};

// --- small helpers ------------------------------------------------------------------------------------

// a figure stays with its sign and its unit when a line breaks
function together(text) { return text.replace(/ (?=mm|%|±|Hz)/g, "\u00a0").replace(/± /g, "±\u00a0").replace(/-(?=\d+\.)/g, "−"); }
const PHASES = {
  start: "starting", ramp: "moving to the start", motion: "testing", release: "unloading", touch: "looking for first contact",
  hold: "holding", "cool-down": "waiting for the specimen to cool", "safe stop": "stopping safely", done: "over",
};
function bar(share) { const outer = make("div", "bar"), inner = make("i"); inner.style.width = `${Math.min(100, Math.max(0, 100 * share))}%`; outer.append(inner); return outer; }
// a list that is scrolled by the reader stays where it is
function replaceRows(list, rows) { const top = list.scrollTop; list.replaceChildren(...rows); list.scrollTop = top; }

// --- drawing -----------------------------------------------------------------------------------------

function draw(at) {
  requestAnimationFrame(draw);
  if (!state.dirty || at - state.drawn < DRAW_MS || document.hidden || results.chosen() !== null) return;
  state.dirty = false; state.drawn = at;
  const { fine, coarse } = rows, n = fine.t.length;
  if (!n) return;
  const now = fine.t[n - 1];
  // the last whole loops, thin, for comparison; before there are any, the last half minute
  const loops = state.sections.loops || [], before = loops.length ? [[], []] : [coarse.s, coarse.f];
  for (const one of loops) { before[0].push(...one.s, null); before[1].push(...one.f, null); }
  charts.loop.windows = (state.sections.windows || []).filter((w) => w.steps.includes(state.sections.now?.step));
  const twin = state.sections.twin;
  charts.loop.band = twin?.band && twin.step === state.sections.now?.step ? twin.band : null;
  charts.loop.show(before, [fine.s, fine.f], [fine.s[n - 1], fine.f[n - 1]]);
  put("loop-legend", `Bold: the last ${rows.FINE_S} s. ${loops.length ? `Thin: the last ${counted(loops.length, "whole cycle")}.` : "Thin: the last half minute."}${charts.loop.windows.length ? ` Bars: what ${charts.loop.windows[0].standard} allows.` : ""}${charts.loop.band ? " Green: the fitted model's band." : ""}`);
  document.body.dataset.band = String(charts.loop.band?.s.length || 0);
  const moved = twin?.alarms.at(-1);
  put("twin", moved ? `Twin, step ${moved.step}: ${moved.sentence}.` : twin ? `Twin: ${counted(twin.judged, "cycle")} compared with “${twin.model}”, none of its alarms.` : "");
  $("twin").classList.toggle("bad", Boolean(moved));
  traces.showRows(coarse.t, coarse.s, coarse.f, now);
  document.body.dataset.redraws = String(Number(document.body.dataset.redraws || 0) + 1);
  document.body.dataset.points = String(charts.loop.points);
}

// --- sections -----------------------------------------------------------------------------------------

const show = {
  campaign(c) {
    put("title", c.title);
    $("simulated").hidden = c.simulated !== true;
    const specimen = [c.specimen.kind, c.specimen.category && `category ${c.specimen.category}`].filter(Boolean).join(", ");
    put("subtitle", [`specimen ${c.specimen.id}`, specimen, c.operator && `operator ${c.operator}`, c.folder].filter(Boolean).join(" · "));
    document.title = `${c.simulated === true ? "SIMULATED " : ""}${c.status}: ${c.title}`;
    head();
  },
  source(s) {
    if (s.kind !== "finished") { results.hide(); live(true); }  // it goes on, or has not ended yet
    head();
  },
  zone(z) { setZone(z); put("zone", `Times of ${zoneName()}.`); for (const name of ["events", "notes", "now"]) if (state.sections[name]) show[name](state.sections[name]); },
  channels(list) { traces.setChannels(list); },
  history() { traces.renewed(); },
  cycles(content) { cycles.show(content); cycles.setAsked(asked(content.step)); },
  loops() { state.dirty = true; },
  windows() { state.dirty = true; },
  end() { head(); },
  problem() { head(); },
  now(n) {
    put("force", fixed(n.force_kN, 1)); put("stroke", fixed(n.stroke_mm, 2));
    const c = state.sections.campaign || {};
    put("force-more", c.force_max_kN ? `limit ${c.force_max_kN} kN` : "");
    put("stroke-more", n.tilt_mm === null || n.tilt_mm === undefined ? "" : `tilt ${fixed(n.tilt_mm, 2)} mm`);
    put("further", (n.further || []).map((one) => `${one.name} ${fixed(one.value, 2)} ${one.unit}`).join(", "));
    put("cycle", n.cycles ? `${n.cycle} / ${n.cycles}` : String(n.cycle ?? "–"));
    const part = { "lead-in": ", leading in", "run-out": ", running out" }[n.part] || "";
    put("phase", (PHASES[n.phase] || n.phase || "") + part);
    put("step", n.steps ? `${n.step} / ${n.steps}` : "–");
    put("step-name", n.name || "");
    const ending = n.trip || n.stop_asked || outcome();  // nothing is foretold of a campaign that ends before its plan
    if (ending || n.remaining_s === null || n.remaining_s === undefined) { put("left", "–"); put("ends", n.phase === "done" ? "over" : ending ? "it is being ended" : ""); }
    else {
      const left = n.remaining_s / (n.speed || 1);
      put("left", lasting(left));
      put("ends", n.phase === "done" ? "over" : `${n.speed > 1.2 ? "" : "ends "}about ${clock(Date.now() + 1000 * left, false)}${n.speed > 1.2 ? `, ${n.speed} × time` : ""}`);
    }
    const behind = n.durable === null || n.durable === undefined ? "" : `, ${n.durable.toLocaleString("en")} of them on the disk (durable)`;
    const lost = n.lost ? `, ${n.lost} lost on the wire` : "";
    const dropped = n.dropped ? ` This page's server skipped ${counted(n.dropped, "sample")}; none is missing in the record.` : "";
    put("recorded", n.recording ? `Recording: ${counted(n.written || 0, "sample")} written${behind}${lost}.${dropped}` : `Nothing is recorded at present${lost}.${dropped}`);
    warmest();
    head();
  },
  temperature(t) {
    const all = t.sensors.flatMap((s) => s.points.map((p) => p[0]));
    if (!all.length) return;
    $("heat-none").hidden = true; $("heat-chart").hidden = false;
    const now = Math.max(...all), minutes = (points) => points.map(([at, v]) => [Math.round((at - now) / 0.6) / 100, v]);
    const order = [...t.sensors].sort((a, b) => Number(b.specimen) - Number(a.specimen)).filter((s) => s.points.length);
    const stop = state.sections.campaign?.temperature_stop_C ?? null;
    charts.heat.show(order.map((s) => minutes(s.points)), order.map((s) => s.specimen), t.forecast ? minutes(t.forecast.points) : [], stop);
    const styles = ["solid", "dashed", "dotted", "dash-dot"];
    $("sensors").replaceChildren(...order.flatMap((s, i) => [make("b", "", s.name), document.createTextNode(`${s.place ? ` (${s.place})` : ""}: ${styles[i % SENSOR_DASHES.length]}. `)]), document.createTextNode(t.forecast ? "Forecast: dots." : ""));
    const f = t.forecast, speed = state.sections.now?.speed || 1;
    if (!f) put("forecast", "");
    else if (f.reach_s !== null) put("forecast", `By the model the stop at ${stop} °C is reached in about ${lasting(f.reach_s / speed)}, in step ${f.step}.`);
    else put("forecast", `By the model the plan ends at ${f.end_C} °C${stop === null ? "" : `, below the stop at ${stop} °C`}.`);
    warmest();
  },
  guards(list) {
    const nearest = list.filter((g) => g.share !== null).sort((a, b) => b.share - a.share)[0];
    put("nearest", nearest ? `Nearest to its trip: ${nearest.name}, ${Math.round(100 * nearest.share)} % of the way.` : "");
    put("watched", `Also watched: ${list.filter((g) => g.share === null).map((g) => g.name).join(", ")}.`);
    replaceRows($("guards"), list.filter((g) => g.share !== null).map((g) => {
      const row = make("li", g.share >= 0.9 ? "close" : g.share >= 0.75 ? "near" : "");
      row.append(make("b", "", `${g.share >= 0.9 ? "▲ " : ""}${g.name}`), bar(g.share), make("small", "", g.text));
      row.title = `${g.label}: leads to ${g.action.replaceAll("_", " ")}`;
      return row;
    }));
  },
  steps(list) {
    const marks = { complete: "✓", running: "▶", pending: "·", stopped: "■", failed: "✕", skipped: "↷" };
    const done = list.filter((s) => s.status === "complete" || s.status === "skipped").length;
    put("progress", `${done} of ${list.length} done`);
    let current = null;
    const rows = list.map((s) => {
      const row = make("li", s.status);
      const more = s.status === "complete" && s.cycles ? counted(s.cycles_done, "cycle") : s.status === "pending" ? `about ${lasting(s.expected_s)}` : s.status;
      row.append(make("span", "mark", marks[s.status] || "?"), make("span", "", s.index), make("span", "", s.name), make("small", "", more));
      row.firstChild.title = s.status;
      if (s.reason) row.append(make("small", "", s.reason));
      if (s.status === "running") { current = row; row.append(bar(0), make("small", "reached", "")); }
      return row;
    });
    replaceRows($("steps"), rows);
    if (current && current !== state.followed && state.followedIndex !== current.children[1].textContent) {
      state.followedIndex = current.children[1].textContent;
      $("steps").scrollTop = current.offsetTop - $("steps").offsetTop - 80;
    }
    if (state.sections.cycles) cycles.setAsked(asked(state.sections.cycles.step));
  },
  events(list) {
    replaceRows($("events"), list.length ? [...list].reverse().map((e) => {
      const row = make("li", /^(STOP|trip|campaign (stopped|failed))/.test(e.text) ? "alert" : "");
      row.append(make("time", "", e.at ?? clock(e.utc)), make("span", "", e.text));
      return row;
    }) : [make("li", "empty", "none yet")]);
  },
  notes(list) {
    replaceRows($("notes"), list.length ? [...list].reverse().map((n) => {
      const row = make("li");
      row.append(make("time", "", clock(n.utc)), make("span", "", n.step ? `${n.text} (step ${n.step})` : n.text));
      return row;
    }) : [make("li", "empty", "none yet")]);
  },
  runs(content) { live(false); results.show(content); },
};

function asked(step) { return (state.sections.steps || []).find((one) => one.index === step); }
// what only a campaign that runs has makes room for its results
function live(on) {
  for (const id of ["guards-panel", "temperature-panel", "cycles-panel"]) $(id).hidden = !on;
  traces.hold(!on);
  if (on) put("loop-title", "Force over stroke");
}
function drawRun(run, asked) {
  put("loop-title", `Force over stroke: ${run.step || run.id}`);
  const loop = run.loop;
  if (loop.t && loop.t.length) {
    charts.loop.x.reset(); charts.loop.y.reset(); charts.loop.zoom = null; charts.loop.windows = [];
    charts.loop.show([[], []], [loop.s, loop.f], null);
    put("loop-legend", "");
    document.body.dataset.points = String(charts.loop.points);
  }
  traces.showRun(run.step || run.id, run.file, asked);
  show.events(run.events.map((e) => ({ at: e.at_s === null ? "" : `${e.at_s.toFixed(1)} s`, text: e.text })));
}

function warmest() {
  const t = state.sections.temperature, n = state.sections.now || {}, stop = state.sections.campaign?.temperature_stop_C;
  const specimen = t ? t.sensors.filter((s) => s.specimen).map((s) => s.name) : Object.keys(n.temperatures_C || {});
  const values = Object.entries(n.temperatures_C || {}).filter(([name]) => !specimen.length || specimen.includes(name)).map(([, v]) => v);
  if (!values.length) { put("heat", "–"); return; }
  const value = Math.max(...values);
  put("heat", fixed(value, 1));
  put("heat-more", stop === null || stop === undefined ? "" : value >= stop ? `at the stop: ${stop} °C` : `${fixed(stop - value, 1)} K to the stop`);
}

// --- what is going on with the data -------------------------------------------------------------------

function age() { return state.age === null ? null : state.age + (performance.now() - state.ageAt) / 1000; }

function outcome() {  // how the campaign ended, as far as this page was told
  const { campaign: c, end } = state.sections;
  return end?.status || (c?.status !== "running" && c?.status) || "";
}

function upper(text) { return text ? text[0].toUpperCase() + text.slice(1) : ""; }
function ended(status, reason) { return `${upper(reason.startsWith(status) ? reason : `campaign ${status}: ${reason}`)}.`.replace(/[.:\s]*\.$/, "."); }

function head() {
  const { campaign: c, source, end, now, problem } = state.sections, kind = source?.kind, old = age();
  const finished = kind === "finished" || end || state.over;
  let text = "waiting", look = "", alarm = "";
  if (!state.connected && state.over) { look = outcome(); text = look || "closed"; }
  else if (!state.connected) { text = "connection lost"; look = "lost"; }
  else if (end) { text = end.status; look = end.status; }
  else if (kind === "finished") { text = c?.status || "over"; look = text; }
  else if (kind === "silent") { text = "no sign of life"; look = "lost"; }
  else if (kind === "live" || kind === "journal") { text = now?.trip ? "stopping" : now?.stop_asked ? "stop asked" : "running"; look = text === "running" ? "running" : "stopped"; }
  const live = kind === "live" || kind === "journal";
  const stale = live && old !== null && old > OLD_S && !finished;
  if (!state.connected && !state.over) alarm = `Connection to the monitor lost${state.lostAt ? ` at ${state.lostAt}` : ""}. What you see is old. The campaign may well be running: look at the stand.`;
  else if (kind === "silent") alarm = "The campaign says it is running, but nothing has been heard of it for a while. The program may have ended: look at the stand.";
  else if (stale && kind === "live") alarm = `No new sample for ${old.toFixed(1)} s. What you see is old.`;
  else if (now?.trip && !finished) alarm = `Stopping: ${now.trip.reason}. The stand has not been seen to be safe yet.`;
  else if (now?.stop_asked && !finished) alarm = `${upper(now.stop_asked)}. The stand still moves.`;
  else if (end && (end.status !== "complete" || end.stand?.safe === false)) alarm = `${ended(end.status, end.reason)} ${!end.stand ? "The stand was not touched." : end.stand.safe ? "The stand was seen to be safe:" : "THE STAND WAS NOT SEEN TO BE SAFE: look at it."} ${(end.stand?.line || "").replace(/^safe stop: /, "")}`.trim();
  else if (kind === "finished" && c && c.status !== "complete" && c.reason) alarm = ended(c.status, c.reason);
  else if (problem) alarm = problem;
  put("status", text);
  $("status").className = `pill ${look}`;
  document.body.classList.toggle("stale", !state.connected || stale || kind === "silent");
  $("alarm").hidden = !alarm; put("alarm", alarm);
  const calm = finished ? c?.status !== "failed" && end?.stand?.safe !== false : !now?.trip && Boolean(now?.stop_asked) && state.connected && !stale;
  $("alarm").classList.toggle("quiet", Boolean(calm));
  document.querySelector(".readouts").hidden = !now;
  let said = "no sample yet";
  if (finished && !live) said = c?.updated_utc ? `ended ${dayAndClock(c.updated_utc)}` : "";
  else if (old !== null) said = old > 3600 ? "sample over an hour old" : `newest sample ${old.toFixed(1)} s old${kind === "journal" ? ", from the journal" : ""}`;
  if (state.over) said = "This page has been closed. Everything is kept in the campaign's folder.";
  put("age", said);
  $("age").classList.toggle("old", !state.connected && !state.over || stale || kind === "silent");
  const running = live && !finished && state.connected;
  $("close").hidden = !(kind === "finished" && state.connected && state.rights === "control");
  for (const one of document.querySelectorAll(".while-running")) one.hidden = kind === "finished";
  for (const button of document.querySelectorAll("[data-after]")) button.disabled = !running;
  const step = document.querySelector("#steps .running .bar i");
  if (step && now?.cycles) step.style.width = `${Math.min(100, (100 * now.cycle) / now.cycles)}%`;
  const reached = document.querySelector("#steps .running .reached");
  if (reached) {  // asked, commanded, reached in its last cycle
    const text = reached.parentElement.children[1].textContent === String(now?.step) ? together(now?.stroke || "") : "";
    if (reached.textContent !== text) reached.textContent = text;
  }
}

function take(message) {
  if (message.age_s !== undefined) { state.age = message.age_s; state.ageAt = performance.now(); }
  if (message.rows?.length) { rows.take(message.rows); state.dirty = true; }
  for (const [name, content] of Object.entries(message.sections || {})) state.sections[name] = content;
  for (const [name, content] of Object.entries(message.sections || {})) if (Object.hasOwn(show, name)) show[name](content);
  head();
}

// --- the wire -----------------------------------------------------------------------------------------

async function post(path, content) {
  const response = await fetch(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(content), credentials: "same-origin" });
  const answer = await response.json().catch(() => ({}));
  if (!response.ok) throw new Error(answer.problem || `refused (${response.status})`);
  return answer;
}

function connect() {
  const wire = new WebSocket(`${location.protocol === "https:" ? "wss:" : "ws:"}//${location.host}/live`);
  state.wire = wire;
  wire.addEventListener("open", () => { state.connected = true; state.tries = 0; rows.clear(); head(); });
  wire.addEventListener("message", (event) => take(JSON.parse(event.data)));
  wire.addEventListener("close", () => {
    if (state.connected) state.lostAt = clock(Date.now());
    state.connected = false;
    if (outcome()) { state.over = true; head(); return; }
    head();
    state.tries += 1;
    setTimeout(reconnect, Math.min(5000, 500 * state.tries));
  });
}
async function reconnect() {
  try {
    const session = await (await fetch("/session", { credentials: "same-origin" })).json();
    if (session.rights === "none") { door(); return; }  // another monitor answers here now
    permit(session);
    connect();
  } catch { state.tries += 1; setTimeout(reconnect, Math.min(5000, 500 * state.tries)); }
}

function permit(session) {
  state.rights = session.rights;
  $("door").hidden = true; $("main").hidden = false;
  $("controls").hidden = session.rights !== "control";
  $("looking").hidden = session.rights === "control";
  if (!session.controllable) put("looking", "This page can only be looked at. The emergency stop is at the stand.");
}
function door() { $("main").hidden = true; $("door").hidden = false; put("status", "closed"); put("subtitle", "live monitor of a test stand"); }

async function enter(token) {
  const session = await post("/session", { token });
  begin(session);
}
function begin(session) {
  permit(session);
  if (!charts.loop) {
    charts.loop = new LoopChart($("loop-chart"), { pointed: (x, y) => put("loop-cursor", x === null ? "" : `${fixed(x, 2)} mm, ${fixed(y, 1)} kN`) });
    for (const [id, act] of [["loop-closer", () => charts.loop.closer(0.5)], ["loop-whole", () => charts.loop.whole()]]) $(id).addEventListener("click", act);
    traces.begin(); cycles.begin(); results.begin(drawRun);
    charts.heat = new HeatChart($("heat-chart"));
    for (const name of ["events", "notes"]) show[name]([]);
    requestAnimationFrame(draw);
    setInterval(head, 250);
    connect();
  }
}

// --- controls -----------------------------------------------------------------------------------------

function name() { return $("who").value.trim(); }
async function act(path, content, said) {
  put("answer", `${said} …`);
  try {
    const answer = await post(path, { ...content, name: name() });
    put("answer", `${clock(Date.now())} ${answer.text}`);
    return true;
  } catch (error) {
    put("answer", `NOT DONE: ${error.message}. Use the stand's own controls if it is urgent.`);
    return false;
  }
}
for (const button of document.querySelectorAll("[data-after]")) button.addEventListener("click", () => act("/stop", { after: button.dataset.after }, "asking to stop"));
$("close").addEventListener("click", () => act("/close", {}, "closing the page"));
$("write").addEventListener("click", () => { $("note-form").hidden = !$("note-form").hidden; if (!$("note-form").hidden) $("note-text").focus(); });
$("note-form").addEventListener("submit", async (event) => {
  event.preventDefault();
  if (await act("/note", { text: $("note-text").value }, "saving")) { $("note-text").value = ""; $("note-form").hidden = true; }
});
try { $("who").value = localStorage.getItem("who") || ""; } catch { /* private windows keep nothing */ }
$("who").addEventListener("change", () => { try { localStorage.setItem("who", name()); } catch { /* as above */ } });
$("door-form").addEventListener("submit", async (event) => {
  event.preventDefault();
  try { await enter($("door-token").value.trim().replace(/^.*#/, "")); } catch (error) { put("door-answer", error.message); }
});

// Whoever came from the desk finds back: to an address of this computer's own pages, and to no other.
try {
  const desk = new URL(new URLSearchParams(location.search).get("desk"));
  if (["http:", "https:"].includes(desk.protocol) && desk.hostname === location.hostname) { $("desk-link").href = desk.href; $("desk").hidden = false; }
} catch { /* it was opened by its own link */ }

// A link that is opened where the page is shown already changes what is behind the # alone: nothing is loaded.
addEventListener("hashchange", () => location.reload());
const token = location.hash.slice(1);
if (token) history.replaceState(null, "", location.pathname + location.search);  // it stays in no history and no screenshot
try {
  const session = token ? await post("/session", { token }) : await (await fetch("/session", { credentials: "same-origin" })).json();
  if (session.rights === "none") door(); else begin(session);
} catch (error) {
  const session = await (await fetch("/session", { credentials: "same-origin" })).json();
  if (session.rights === "none") { door(); put("door-answer", error.message); } else { begin(session); put("looking", `${error.message}: you are looking on.`); }
}
