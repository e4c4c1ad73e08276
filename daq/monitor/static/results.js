// The runs of a campaign that has ended, as evaluation judges them.
import { counted } from "./counted.js";
import { $, cell, fixed, make, put } from "./times.js";

const state = { content: null, chosen: null, byHand: false, drawn: () => {} };

export function begin(drawn) { state.drawn = drawn; }
export function chosen() { return state.chosen; }
export function hide() { state.chosen = null; state.byHand = false; $("results-panel").hidden = true; }

export function show(content) {
  state.content = content;
  const n = content.runs.length;
  $("results-panel").hidden = false;
  put("evaluating", content.evaluating ? `Evaluating: ${n} done …` : `${counted(n, "run")}${content.broken ? ", then the evaluation ended with a fault" : ""}. Values with expanded uncertainty (k = 2). Choose one to see its loop.`);
  if (n) headMeans(content.runs[0].columns);
  $("runs").replaceChildren(...content.runs.map(runRow));
  // the newest one, unless another was chosen: at first the one that is evaluated first
  if (n && (state.chosen === null || (!content.evaluating && !state.byHand && state.chosen !== n - 1))) choose(n - 1, false);
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
    heading.setAttribute("role", "columnheader");
    if (one.unit) heading.append(make("i", "", one.unit));
    return heading;
  }));
}
function runRow(run, index) {
  const row = make("tr", index === state.chosen ? "chosen" : ""), x = run.extremes;
  row.tabIndex = 0;
  row.setAttribute("role", "row");
  const first = cell(run.step || run.id);
  first.append(make("br"), make("small", "", run.problem ? run.problem : `${run.file.split("/").pop()} · ${run.status}`));
  row.append(first, cell(run.verdict || "–", "verdict"), ...run.columns.map((one) => cell(value(run.summary[one.name], one.decimals), one.heading, one.unit)), cell(value(x.force_max_kN, 1), "peak force", "kN"), cell(value(x.stroke_max_mm, 1), "peak stroke", "mm"), cell(value(x.temperature_max_C, 1), "warmest", "°C"));
  row.addEventListener("click", () => byHand(index));
  row.addEventListener("keydown", (event) => { if (event.key === "Enter") byHand(index); });
  return row;
}
function byHand(index) { state.byHand = true; choose(index, true); }
function choose(index, asked) {
  const run = state.content.runs[index];
  state.chosen = index;
  [...$("runs").children].forEach((row, i) => { row.classList.toggle("chosen", i === index); row.setAttribute("aria-current", String(i === index)); });
  const passed = run.requirements.filter((r) => r.verdict === "pass").length;
  const lines = [run.reason && `Ended: ${run.reason}`, run.requirements.length && `${passed} of ${counted(run.requirements.length, "requirement or condition", "requirements and conditions")} passed.`, ...run.requirements.filter((r) => r.verdict !== "pass").map((r) => `${r.id}${r.cycle ? `, cycle ${r.cycle}` : ""}: ${r.verdict}${r.why ? ` (${r.why})` : ""}`), ...run.warnings.map((w) => `Warning: ${typeof w === "string" ? w : JSON.stringify(w)}`)];
  $("run-detail").replaceChildren(...lines.filter(Boolean).map((text) => make("small", "", text)));
  state.drawn(run, asked);
}
