// The page of results. Everything that comes from a file is text and is only ever set as text.
import { counted } from "./counted.js";
import { TONES, drawLoops, drawTrend } from "./drawings.js";

const $ = (id) => document.getElementById(id);
const query = $("about").dataset.query;
const chosen = { folder: [], run: [] };
for (const [key, value] of new URLSearchParams(query)) chosen[key]?.push(value);
const state = { result: null, ticked: new Set(), sort: "", down: false };

function make(tag, text, className) { const e = document.createElement(tag); if (text !== undefined && text !== null) e.textContent = String(text); if (className) e.className = className; return e; }
function fixed(value, digits) { return value === null || value === undefined ? "–" : Number(value).toFixed(digits).replace("-", "−"); }
function short(value) { return value === null || value === undefined ? "–" : typeof value === "number" ? Number(value.toPrecision(5)).toString().replace("-", "−") : String(value); }
// two significant digits of U, and the value to the same place
function certain(value, u) {
  if (value === null || value === undefined || !u) return short(value);
  const places = 1 - Math.floor(Math.log10(u)), step = 10 ** -places;
  const at = (one) => (places >= 0 ? one.toFixed(Math.min(places, 20)) : String(Math.round(one / step) * step)).replace("-", "−");
  return `${at(value)} ± ${at(u)}`;
}
// a value that is held against another: two digits beyond those of its U, more say nothing
function beside(value, u) {
  if (typeof value !== "number" || !u) return short(value);
  return value.toFixed(Math.min(Math.max(3 - Math.floor(Math.log10(u)), 0), 20)).replace("-", "−");
}
// an uncertainty that the decimals of the figure would make nothing keeps its own
// with so many digits, or more where U has none of them otherwise: both to the same place
function pair([value, u], digits) {
  if (value === null || u === null || u === undefined) return fixed(value, digits);
  const places = u && !Number(u.toFixed(digits)) ? Math.min(Math.ceil(-Math.log10(u)), 12) : digits;
  return `${fixed(value, places)} ± ${fixed(u, places)}`;
}
function fill(table, rows) { table.tBodies[0].replaceChildren(...rows); }
// on a phone a row is laid out as a card (results.css): for a screen reader it stays a row of a table
function cards(line) { line.setAttribute("role", "row"); for (const td of line.cells) td.setAttribute("role", "cell"); return line; }
function row(cells) { const r = make("tr"); r.append(...cells); return r; }

const EXTREMES = [["force_max_kN", "greatest force", "kN", 1], ["stroke_max_mm", "greatest stroke", "mm", 1], ["temperature_max_C", "warmest", "°C", 1]];

function columns() {
  return [
    { name: "name", heading: "run", of: (r) => r.step || r.id },
    { name: "verdict", heading: "verdict", of: (r) => r.verdict || "" },
    ...state.result.columns.map((one) => ({ ...one, of: (r) => r.values[one.name][0], told: (r) => pair(r.values[one.name], one.decimals) })),
    ...EXTREMES.map(([name, heading, unit, decimals]) => ({ name, heading, unit, of: (r) => r.extremes[name][0], told: (r) => pair(r.extremes[name], decimals) })),
  ];
}
function head() {
  const line = make("tr");
  line.setAttribute("role", "row");
  for (const one of columns()) {
    const th = make("th"), button = make("button", one.heading);
    th.scope = "col"; th.setAttribute("role", "columnheader"); button.type = "button";
    if (one.unit) button.append(" ", make("i", one.unit));
    if (state.sort === one.name) th.setAttribute("aria-sort", state.down ? "descending" : "ascending");
    button.addEventListener("click", () => { state.down = state.sort === one.name ? !state.down : false; state.sort = one.name; showRuns(); document.querySelectorAll("#runs th button")[columns().findIndex((c) => c.name === one.name)].focus(); });
    th.append(button); line.append(th);
  }
  $("runs").tHead.replaceChildren(line);
}
function showRuns() {
  head();
  const wanted = $("filter").value.toLowerCase().split(/\s+/).filter(Boolean), by = columns().find((one) => one.name === state.sort);
  let list = state.result.runs.filter((r) => { const text = [r.step, r.id, r.kind, r.verdict, r.specimen, r.status, r.campaign].join(" ").toLowerCase(); return wanted.every((w) => text.includes(w)); });
  if (by) list = [...list].sort((a, b) => { const x = by.of(a), y = by.of(b); const none = (v) => v === null || v === undefined || v === ""; if (none(x) || none(y)) return none(x) - none(y); return (x < y ? -1 : x > y ? 1 : 0) * (state.down ? -1 : 1); });
  $("shown").textContent = `${list.length} of ${state.result.runs.length}`;
  fill($("runs"), list.map((r) => {
    const label = make("label"), box = make("input"), name = make("span", r.step || r.id), first = make("td");
    box.type = "checkbox"; box.checked = state.ticked.has(r.path); box.disabled = !r.loop;
    box.addEventListener("change", () => { if (box.checked) state.ticked.add(r.path); else state.ticked.delete(r.path); loops(); });
    label.append(box, name); first.append(label, make("small", [r.id, r.specimen, r.status, r.simulated ? "simulated" : ""].filter(Boolean).join(" · ")));
    const told = columns().slice(2).map((one) => Object.assign(make("td", one.told(r), one.told(r) === "–" ? "none" : ""), { one }));
    for (const td of told) { td.dataset.label = td.one.heading; td.dataset.unit = td.one.unit || ""; }
    return cards(row([first, make("td", r.verdict || "–", r.verdict || "none"), ...told]));
  }));
}

// --- loops and a model --------------------------------------------------------------------------------

let asking = 0;
async function loops() {
  const runs = state.result.runs.filter((r) => state.ticked.has(r.path) && r.loop), number = ++asking;
  if (!runs.length) { drawLoops($("loops"), []); $("legend").replaceChildren(make("li", "Tick a run above.")); $("model-table").hidden = true; return; }
  if (!$("legend").children.length) $("legend").replaceChildren(make("li", "The loops are being read …"));
  try {
    const asked = { runs: runs.map((r) => ({ path: r.path, from_s: r.loop[0], to_s: r.loop[1] })), model: $("model").value };
    const answer = await fetch(`/results/curves?ask=${encodeURIComponent(JSON.stringify(asked))}`), found = await answer.json();
    if (!answer.ok) throw new Error(found.problem);
    if (number !== asking) return;
    const curves = [], legend = [], several = new Set(runs.map((r) => r.specimen)).size > 1;
    found.curves.forEach((one, i) => {
      const tone = TONES[i % TONES.length], run = runs[i];
      const item = (text, dashed) => { const li = make("li"), mark = make("i", "", dashed ? "dashed" : ""); mark.style.color = tone; li.append(mark, text); return li; };
      if (one.s) { curves.push({ s: one.s, f: one.f, tone }); legend.push(item(`${several ? `${run.specimen || "–"}: ` : ""}${run.step || run.id}, cycle ${run.loop[2]}`)); }
      if (one.model) { curves.push({ s: one.model.s, f: one.model.f, tone, dashed: true }); legend.push(item("the model's", true)); }
      if (one.problem) legend.push(make("li", `${run.id}: ${one.problem}`));
    });
    drawLoops($("loops"), curves);
    $("loops").dataset.curves = String(curves.length);
    $("legend").replaceChildren(...legend);
    const answered = found.curves.map((one, i) => [runs[i], one.model]).filter(([, m]) => m);
    $("model-table").hidden = !answered.length;
    fill($("model-table"), answered.map(([r, m]) => row([make("td", r.step || r.id), make("td", fixed(m.damping, 4)), make("td", fixed(m.predicted_damping, 4)), make("td", fixed(m.rms_kN, 2)), make("td", m.worst_share === null ? "–" : fixed(100 * m.worst_share, 2))])));
    $("model-command").hidden = !found.command; $("model-command").textContent = found.command ? `The same as a command: ${found.command}` : "";
  } catch (error) { if (number === asking) Desk.say(error.message, true); }
}

// --- requirements, trends, specimens ------------------------------------------------------------------

function requirements() {
  const all = state.result.runs.flatMap((r) => r.requirements.map((one) => [r, one])), only = $("verdict").value;
  $("requirements-none").hidden = all.length > 0;
  $("requirements").hidden = !all.length;
  $("passed").textContent = all.length ? `${all.filter(([, one]) => ["pass", "conditional-pass"].includes(one.verdict)).length} of ${all.length} passed` : "";
  fill($("requirements"), all.filter(([, one]) => !only || !["pass", "conditional-pass"].includes(one.verdict)).map(([r, one]) => requirement(r, one)));
}
// on a phone each requirement is a card: its cells under each other, with their headings, the verdict first
function requirement(r, one) {
  const cells = [
    ["run", make("td", r.step || r.id, "wrap")], ["", make("td", one.requirement.startsWith(`${one.id}: `) ? one.requirement : `${one.id}: ${one.requirement}`, "wrap")], ["cycle", make("td", one.cycle ?? "")],
    ["measured", make("td", certain(one.measured, one.expanded_uncertainty))],
    ["from", make("td", one.lower_limit ?? "")], ["to", make("td", one.upper_limit ?? "")], ["in", make("td", one.unit === "1" ? "" : one.unit ?? "")],
    ["probability", make("td", one.conformance_probability === null ? "" : one.conformance_probability.toFixed(3))],
    ["", make("td", one.verdict, `left verdict ${one.verdict}`)], ["", make("td", one.why, "wrap")],
  ];
  const line = row(cells.map(([label, cell]) => { cell.setAttribute("role", "cell"); if (label) cell.dataset.label = label; return cell; }));
  line.setAttribute("role", "row");
  return line;
}
function words(name) { const one = state.result.columns.find((c) => c.name === name); return one ? `${one.heading}${one.unit ? ` in ${one.unit}` : ""}` : name; }
function trends() {
  const list = state.result.trends;
  $("trend").replaceChildren(...list.map((one, i) => { const o = make("option", `${words(one.quantity)}, ${fixed(one.prestress_mm, 1)} ± ${fixed(one.amplitude_mm, 1)} mm`); o.value = i; return o; }));
  $("trend").hidden = !list.length;
  showTrend();
}
function showTrend() {
  const one = state.result.trends[$("trend").value || 0];
  $("trend-chart").hidden = !one;
  drawTrend($("trend-chart"), one, one ? words(one.quantity) : "");
  $("trend-said").textContent = !one ? "A trend needs runs of the same prestress and amplitude at several frequencies." :
    `${counted(one.runs.length, "run")}${one.slope_per_Hz === null ? "" : `; slope ${certain(one.slope_per_Hz, one.slope_expanded_uncertainty_per_Hz)} per Hz`}. Bars: U of each run.${one.warnings.length ? ` ${one.warnings.join(" ")}` : ""}`;
}
function specimens() {
  const names = [...new Set(state.result.runs.map((r) => r.specimen).filter(Boolean))];
  $("specimens-panel").hidden = names.length < 2;
  if (names.length < 2) return;
  const groups = new Map(), near = (v, step) => (v === null ? "–" : (Math.round(v / step) * step).toFixed(2));
  for (const r of state.result.runs) {
    const key = r.kind === "harmonic" ? `${near(r.values.prestress_mm[0], 1)} ± ${near(r.values.amplitude_mm[0], 1)} mm, ${near(r.values.frequency_Hz[0], 0.02)} Hz` : r.kind;
    if (!groups.has(key)) groups.set(key, new Map());
    const of = groups.get(key);
    if (!of.has(r.specimen)) of.set(r.specimen, r);
  }
  const shown = state.result.columns.filter((one) => ["damping", "absorbed_energy_J", "tangent_stiffness_kN_per_mm"].includes(one.name)), line = make("tr");
  line.append(make("th", "condition"), make("th", "figure", "left"), ...names.map((n) => make("th", n)));
  $("specimens").tHead.replaceChildren(line);
  fill($("specimens"), [...groups].flatMap(([key, of]) => shown.map((one) => row([make("td", key), make("td", words(one.name), "left"), ...names.map((n) => make("td", of.has(n) ? pair(of.get(n).values[one.name], one.decimals) : "–"))]))));
}

// --- other settings ---------------------------------------------------------------------------

function sent(form) { return { ...Object.fromEntries(new FormData(form)), ...chosen }; }
$("again")?.addEventListener("submit", (event) => {
  event.preventDefault();
  Desk.during(event.target.querySelector("button"), async () => {
    Desk.say("Evaluating with these settings …");
    const found = await Desk.ask("/results/again", sent(event.target));
    Desk.say("");
    $("beside").hidden = false;
    const moves = found.moves, beyond = moves.filter((m) => m.beyond_uncertainty).length;
    $("moved").textContent = moves.length || found.verdicts.length ? `${counted(moves.length, "figure")} moved, ${beyond} of them beyond their uncertainty; ${counted(found.verdicts.length, "verdict is another", "verdicts are others")}.` : "Nothing moved.";
    fill($("moves"), moves.map((m) => row([make("td", m.run), make("td", m.words, "left"), make("td", beside(m.old, m.expanded_uncertainty)), make("td", beside(m.new, m.expanded_uncertainty)), make("td", beside(m.difference, m.expanded_uncertainty)), make("td", m.expanded_uncertainty ? Number(m.expanded_uncertainty.toPrecision(2)).toString() : "–"), make("td", m.beyond_uncertainty ? "yes" : "no", "left")])));
    $("verdicts").hidden = !found.verdicts.length;
    fill($("verdicts"), found.verdicts.map((v) => row([make("td", v.run), make("td", v.id, "left"), make("td", v.cycle ?? ""), make("td", v.old ?? "–", `left ${v.old}`), make("td", v.new, `left ${v.new}`), make("td", v.why, "wrap")])));
    $("again-command").textContent = `${found.command} --json new.json; ${found.compared_by}`;
  });
});

$("filter").addEventListener("input", showRuns);
$("verdict").addEventListener("change", requirements);
$("trend").addEventListener("change", showTrend);
$("model").addEventListener("change", loops);

const answer = await fetch(`/results/evaluation?${query}`);
const found = await answer.json().catch(() => ({ problem: `The desk refused (${answer.status}).` }));
if (!answer.ok) { $("waiting").textContent = ""; Desk.say(found.problem, true); } else {
  state.result = found;
  $("waiting").textContent = ""; $("results").hidden = false;
  $("command").textContent = found.command;
  const told = [...found.failures.map((f) => `${f.path}: ${f.problem}`), ...found.warnings, ...found.runs.flatMap((r) => r.warnings.map((w) => `${r.id}: ${w}`))];
  $("warned").textContent = counted(told.length, "warning");
  $("warnings").replaceChildren(...told.slice(0, 40).map((text) => make("li", text)), ...(told.length > 40 ? [make("li", `and ${counted(told.length - 40, "more warning")}`)] : []));
  for (const r of found.runs.filter((one) => one.loop).slice(0, 6)) state.ticked.add(r.path);
  showRuns(); requirements(); trends(); specimens(); loops();
}
