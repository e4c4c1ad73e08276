// The page. Everything that comes from a campaign is text and is only ever set as text, never as markup.
import { HeatChart, LoopChart, SENSOR_DASHES, TraceChart } from "./charts.js";

const $ = (id) => document.getElementById(id);
const OLD_S = 1.5;          // a sample older than this is said to be old
const FINE_S = 3;           // rows of the last moments are drawn as they come …
const WINDOW_S = 30;        // … those of the last half minute thinned out
const THIN = 5;
const DRAW_MS = 60;

const state = {
  sections: {}, rights: "none", wire: null, connected: false, lostAt: null, over: false, tries: 0,
  age: null, ageAt: 0, fine: { t: [], s: [], f: [] }, coarse: { t: [], s: [], f: [] }, count: 0, dirty: false, drawn: 0, chosen: null,
};
const charts = {};

// --- small helpers ------------------------------------------------------------------------------------

function make(tag, className, text) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  if (text !== undefined && text !== null) element.textContent = String(text);
  return element;
}
function put(id, text) { const element = $(id); if (element.textContent !== text) element.textContent = text; }
function fixed(value, digits) { return value === null || value === undefined ? "–" : value.toFixed(digits).replace("-", "−"); }
// a figure stays with its sign and its unit when a line breaks
function together(text) { return text.replace(/ (?=mm|%|±|Hz)/g, "\u00a0").replace(/± /g, "±\u00a0").replace(/-(?=\d+\.)/g, "−"); }
function clock(utc) { const date = new Date(utc); return isNaN(date) ? "" : date.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", second: "2-digit", hour12: false }); }
function lasting(seconds) {
  const s = Math.max(0, Math.round(seconds)), m = Math.floor(s / 60), h = Math.floor(m / 60);
  const two = (n) => String(n).padStart(2, "0");
  return h ? `${h}:${two(m % 60)}:${two(s % 60)}` : `${m}:${two(s % 60)}`;
}
function bar(share) { const outer = make("div", "bar"), inner = make("i"); inner.style.width = `${Math.min(100, Math.max(0, 100 * share))}%`; outer.append(inner); return outer; }
// a list that is scrolled by the reader stays where it is
function replaceRows(list, rows) { const top = list.scrollTop; list.replaceChildren(...rows); list.scrollTop = top; }

// --- rows of samples ----------------------------------------------------------------------------------

function takeRows(packets) {
  const { fine, coarse } = state;
  for (const p of packets) {
    const t0 = p.t0_us / 1e6, last = fine.t.length ? fine.t[fine.t.length - 1] : null;
    if (last !== null && (t0 < last || t0 - last > 60)) clearRows();
    else if (last !== null && t0 - last > 1) for (const b of [fine, coarse]) { b.t.push(t0 - 1e-4); b.s.push(null); b.f.push(null); }
    for (let i = 0; i < p.t.length; i++) {
      const t = t0 + p.t[i] / 1e4, s = p.s[i] / 1000, f = p.f[i] / 1000;
      fine.t.push(t); fine.s.push(s); fine.f.push(f);
      if (state.count++ % THIN === 0) { coarse.t.push(t); coarse.s.push(s); coarse.f.push(f); }
    }
  }
  if (!fine.t.length) return;
  const now = fine.t[fine.t.length - 1];
  trim(fine, now - FINE_S); trim(coarse, now - WINDOW_S);
  state.dirty = true;
}
function trim(buffer, from) {
  let n = 0;
  while (n < buffer.t.length && buffer.t[n] < from) n++;
  if (n > 200 || n === buffer.t.length) for (const key of ["t", "s", "f"]) buffer[key].splice(0, n);
}
function clearRows() { for (const b of [state.fine, state.coarse]) for (const key of ["t", "s", "f"]) b[key] = []; }

function draw(at) {
  requestAnimationFrame(draw);
  if (!state.dirty || at - state.drawn < DRAW_MS || document.hidden || state.chosen !== null) return;
  state.dirty = false; state.drawn = at;
  const { fine, coarse } = state, n = fine.t.length;
  if (!n) return;
  const now = fine.t[n - 1];
  charts.loop.show([coarse.s, coarse.f], [fine.s, fine.f], [fine.s[n - 1], fine.f[n - 1]]);
  const xs = coarse.t.map((t) => t - now);
  charts.stroke.show(xs, coarse.s, [-WINDOW_S, 0]);
  charts.force.show(xs, coarse.f, [-WINDOW_S, 0]);
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
    if (s.kind !== "finished") {  // it goes on, or has not ended yet
      $("results-panel").hidden = true; $("guards-panel").hidden = false; $("temperature-panel").hidden = false;
      if (state.chosen !== null) { state.chosen = null; put("loop-title", "Force over stroke"); put("traces-title", "Stroke and force over time"); }
    }
    head();
  },
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
    put("phase", (n.phase || "") + part);
    put("step", n.steps ? `${n.step} / ${n.steps}` : "–");
    put("step-name", n.name || "");
    if (n.remaining_s === null || n.remaining_s === undefined) { put("left", "–"); put("ends", ""); }
    else {
      const left = n.remaining_s / (n.speed || 1);
      put("left", lasting(left));
      const ends = new Date(Date.now() + 1000 * left);
      put("ends", n.phase === "done" ? "over" : `ends about ${ends.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", hour12: false })}${n.speed > 1.2 ? `, ${n.speed} × real time` : ""}`);
    }
    const behind = n.durable === null || n.durable === undefined ? "" : `, ${n.durable.toLocaleString("en")} of them on the disk (durable)`;
    const lost = n.lost ? `, ${n.lost} lost on the wire` : "";
    const dropped = n.dropped ? ` This page's server skipped ${n.dropped} samples; none is missing in the record.` : "";
    put("recorded", n.recording ? `Recording: ${(n.written || 0).toLocaleString("en")} samples written${behind}${lost}.${dropped}` : `Nothing is recorded at present${lost}.${dropped}`);
    warmest();
    head();
  },
  temperature(t) {
    const all = t.sensors.flatMap((s) => s.points.map((p) => p[0]));
    if (!all.length) return;
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
      const more = s.status === "complete" && s.cycles ? `${s.cycles_done} cycles` : s.status === "pending" ? `about ${lasting(s.expected_s)}` : s.status;
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
  runs(content) {
    $("results-panel").hidden = false; $("guards-panel").hidden = true; $("temperature-panel").hidden = true;
    put("evaluating", content.evaluating ? `Evaluating: ${content.runs.length} done …` : `${content.runs.length} runs${content.broken ? ", then the evaluation ended with a fault" : ""}. Values with expanded uncertainty (k = 2). Choose one to see its loop.`);
    if (content.runs.length) headMeans(content.runs[0].columns);
    $("runs").replaceChildren(...content.runs.map(runRow));
    if (state.chosen === null && content.runs.length) choose(content.runs.length - 1);
  },
};

function warmest() {
  const t = state.sections.temperature, n = state.sections.now || {}, stop = state.sections.campaign?.temperature_stop_C;
  const specimen = t ? t.sensors.filter((s) => s.specimen).map((s) => s.name) : Object.keys(n.temperatures_C || {});
  const values = Object.entries(n.temperatures_C || {}).filter(([name]) => !specimen.length || specimen.includes(name)).map(([, v]) => v);
  if (!values.length) { put("heat", "–"); return; }
  const value = Math.max(...values);
  put("heat", fixed(value, 1));
  put("heat-more", stop === null || stop === undefined ? "" : value >= stop ? `at the stop: ${stop} °C` : `${fixed(stop - value, 1)} K to the stop`);
}

function value(entry, digits, factor = 1) {
  if (!entry || entry.value === null || entry.value === undefined) return "–";
  const u = entry.expanded_uncertainty;
  return u ? `${fixed(entry.value * factor, digits)} ± ${fixed(u * factor, digits)}` : fixed(entry.value * factor, digits);
}
function headMeans(columns) {
  document.querySelectorAll("th.mean").forEach((heading) => heading.remove());
  $("means-from").after(...columns.map((one) => {
    const heading = make("th", "mean", one.unit ? `${one.heading} ` : one.heading);
    if (one.unit) heading.append(make("i", "", one.unit));
    return heading;
  }));
}
function runRow(run, index) {
  const row = make("tr", index === state.chosen ? "chosen" : ""), x = run.extremes;
  row.tabIndex = 0;
  const first = make("td", "", run.step || run.id);
  first.append(make("br"), make("small", "", run.problem ? run.problem : `${run.file.split("/").pop()} · ${run.status}`));
  row.append(first, ...[run.verdict || "–", ...run.columns.map((one) => value(run.summary[one.name], one.decimals)), value(x.force_max_kN, 1), value(x.stroke_max_mm, 1), value(x.temperature_max_C, 1)].map((text) => make("td", "", text)));
  row.addEventListener("click", () => choose(index));
  row.addEventListener("keydown", (event) => { if (event.key === "Enter") choose(index); });
  return row;
}
function choose(index) {
  const run = state.sections.runs.runs[index];
  state.chosen = index;
  [...$("runs").children].forEach((row, i) => row.classList.toggle("chosen", i === index));
  put("loop-title", `Force over stroke: ${run.step || run.id}`); put("traces-title", `Stroke and force over time: ${run.step || run.id}`);
  const loop = run.loop;
  if (loop.t && loop.t.length) {
    for (const chart of [charts.loop.x, charts.loop.y, charts.stroke.y, charts.force.y]) chart.reset();
    charts.loop.show([[], []], [loop.s, loop.f], null);
    const end = loop.t[loop.t.length - 1];
    charts.stroke.show(loop.t, loop.s, [loop.t[0], end], "seconds"); charts.force.show(loop.t, loop.f, [loop.t[0], end], "seconds");
    document.body.dataset.points = String(charts.loop.points);
  }
  const passed = run.requirements.filter((r) => r.verdict === "pass").length;
  const lines = [run.reason && `Ended: ${run.reason}`, run.requirements.length && `${passed} of ${run.requirements.length} requirements and conditions passed.`, ...run.requirements.filter((r) => r.verdict !== "pass").map((r) => `${r.id}${r.cycle ? `, cycle ${r.cycle}` : ""}: ${r.verdict}${r.why ? ` (${r.why})` : ""}`), ...run.warnings.map((w) => `Warning: ${typeof w === "string" ? w : JSON.stringify(w)}`)];
  $("run-detail").replaceChildren(...lines.filter(Boolean).map((text) => make("small", "", text)));
  show.events(run.events.map((e) => ({ at: e.at_s === null ? "" : `${e.at_s.toFixed(1)} s`, text: e.text })));
}

// --- what is going on with the data -------------------------------------------------------------------

function age() { return state.age === null ? null : state.age + (performance.now() - state.ageAt) / 1000; }

function outcome() {  // how the campaign ended, as far as this page was told
  const { campaign: c, end } = state.sections;
  return end?.status || (c?.status !== "running" && c?.status) || "";
}

function head() {
  const { campaign: c, source, end, now, problem } = state.sections, kind = source?.kind, old = age();
  const finished = kind === "finished" || end || state.over;
  let text = "waiting", look = "", alarm = "";
  if (!state.connected && state.over) { look = outcome(); text = look || "closed"; }
  else if (!state.connected) { text = "connection lost"; look = "lost"; }
  else if (end) { text = end.status; look = end.status; }
  else if (kind === "finished") { text = c?.status || "over"; look = text; }
  else if (kind === "silent") { text = "no sign of life"; look = "lost"; }
  else if (kind === "live" || kind === "journal") { text = now?.trip ? "stopping" : "running"; look = now?.trip ? "stopped" : "running"; }
  const live = kind === "live" || kind === "journal";
  const stale = live && old !== null && old > OLD_S && !finished;
  if (!state.connected && !state.over) alarm = `Connection to the monitor lost${state.lostAt ? ` at ${state.lostAt}` : ""}. What you see is old. The campaign may well be running: look at the stand.`;
  else if (kind === "silent") alarm = "The campaign says it is running, but nothing has been heard of it for a while. The program may have ended: look at the stand.";
  else if (stale && kind === "live") alarm = `No new sample for ${old.toFixed(1)} s. What you see is old.`;
  else if (now?.trip && !finished) alarm = `Stop: ${now.trip.reason}`;
  else if (end && end.status !== "complete") alarm = `Campaign ${end.status}: ${end.reason}`;
  else if (kind === "finished" && c && c.status !== "complete" && c.reason) alarm = `Campaign ${c.status}: ${c.reason}`;
  else if (problem) alarm = problem;
  put("status", text);
  $("status").className = `pill ${look}`;
  document.body.classList.toggle("stale", !state.connected || stale || kind === "silent");
  $("alarm").hidden = !alarm; put("alarm", alarm);
  $("alarm").classList.toggle("quiet", finished && c?.status !== "failed");
  document.querySelector(".readouts").hidden = !now;
  let said = "no sample yet";
  if (finished && !live) said = c?.updated_utc ? `ended ${new Date(c.updated_utc).toLocaleString()}` : "";
  else if (old !== null) said = old > 3600 ? "sample over an hour old" : `newest sample ${old.toFixed(1)} s old${kind === "journal" ? ", from the journal" : ""}`;
  if (state.over) said = "The monitor has ended with the campaign; “bufferstand monitor” shows it again.";
  put("age", said);
  $("age").classList.toggle("old", !state.connected && !state.over || stale || kind === "silent");
  const running = live && !finished && state.connected;
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
  if (message.rows) takeRows(message.rows);
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
  const wire = new WebSocket(`ws://${location.host}/live`);
  state.wire = wire;
  wire.addEventListener("open", () => { state.connected = true; state.tries = 0; clearRows(); head(); });
  wire.addEventListener("message", (event) => take(JSON.parse(event.data)));
  wire.addEventListener("close", () => {
    if (state.connected) state.lostAt = new Date().toLocaleTimeString([], { hour12: false });
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
    charts.loop = new LoopChart($("loop-chart"));
    charts.stroke = new TraceChart($("stroke-chart"), "stroke in mm", "--stroke", { least: 5 });
    charts.force = new TraceChart($("force-chart"), "force in kN", "--force", { least: 20 });
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
    put("answer", `${new Date().toLocaleTimeString([], { hour12: false })}  ${answer.text}`);
    return true;
  } catch (error) {
    put("answer", `NOT DONE: ${error.message}. Use the stand's own controls if it is urgent.`);
    return false;
  }
}
for (const button of document.querySelectorAll("[data-after]")) button.addEventListener("click", () => act("/stop", { after: button.dataset.after }, "asking to stop"));
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

const token = location.hash.slice(1);
if (token) history.replaceState(null, "", location.pathname);  // it stays in no history and no screenshot
try {
  const session = token ? await post("/session", { token }) : await (await fetch("/session", { credentials: "same-origin" })).json();
  if (session.rights === "none") door(); else begin(session);
} catch (error) {
  const session = await (await fetch("/session", { credentials: "same-origin" })).json();
  if (session.rights === "none") { door(); put("door-answer", error.message); } else { begin(session); put("looking", `${error.message}: you are looking on.`); }
}
