// The archive: what is asked for stands in the address, so that it can be come back to and passed on.
const $ = (id) => document.getElementById(id);
const COLUMNS = [["path", "run"], ["started_utc", "started (UTC)"], ["kind", "kind"], ["status", "status"], ["specimen", "specimen"], ["step", "step"], ["prestress_mm", "prestress mm"], ["amplitude_mm", "amplitude mm"], ["frequency_Hz", "frequency Hz"]];
const asked = new URLSearchParams(location.search), ticked = new Set();
const AGAIN_MS = 700;
let number = 0, last = null, shown = "";
function make(tag, text, className) { const e = document.createElement(tag); if (text !== undefined && text !== null) e.textContent = String(text); if (className) e.className = className; return e; }

function head() {
  const line = make("tr"), sort = asked.get("sort") || "started_utc", down = asked.get("down") !== "0";
  line.setAttribute("role", "row");
  for (const [name, heading] of COLUMNS) {
    const th = make("th"), button = make("button", heading);
    if (!name.endsWith("_mm") && name !== "frequency_Hz") th.className = "left";
    th.scope = "col"; th.setAttribute("role", "columnheader"); button.type = "button"; button.id = `by-${name}`;
    if (sort === name) th.setAttribute("aria-sort", down ? "descending" : "ascending");
    button.addEventListener("click", () => { asked.set("down", sort === name && down ? "0" : sort === name ? "1" : "0"); asked.set("sort", name); asked.delete("first"); find(); });
    th.append(button); line.append(th);
  }
  const focus = document.activeElement?.id;
  $("archive").tHead.replaceChildren(line);
  if (focus?.startsWith("by-")) $(focus)?.focus();
}
function cell(row, name) {
  const value = row[name];
  if (name === "path") {
    const td = make("td"), label = make("label"), box = make("input"), a = make("a", value);
    box.type = "checkbox"; box.checked = ticked.has(value); box.setAttribute("aria-label", `tick ${value}`);
    box.addEventListener("change", () => { if (box.checked) ticked.add(value); else ticked.delete(value); });
    a.href = `/archive/run?path=${encodeURIComponent(value)}`;
    label.append(box); td.append(label, a);
    if (row.problem) td.append(make("small", row.problem, "problem"));
    td.className = "name";
    return td;
  }
  if (name === "started_utc") return make("td", value ? value.slice(0, 16).replace("T", " ") : "–", "left");
  if (typeof value === "number") return make("td", name === "frequency_Hz" ? value.toFixed(3) : value.toFixed(1));
  if (name.endsWith("_mm") || name === "frequency_Hz") return make("td", "–");
  if (name === "step") return make("td", value ?? "–", "wrap");
  return make("td", name === "kind" && row.simulated === "yes" ? `${value} (simulated)` : value ?? "–", "left");
}
function line(row) {
  const r = make("tr");
  r.setAttribute("role", "row");
  for (const [name, heading] of COLUMNS) {
    const td = cell(row, name), [label, unit = ""] = heading.split(/ (?=mm|Hz)/);
    td.setAttribute("role", "cell");
    if (td.textContent === "–") td.classList.add("none");
    else if (name !== "path") Object.assign(td.dataset, { label, unit });
    r.append(td);
  }
  return r;
}
async function find() {
  const mine = ++number;
  history.replaceState(null, "", `/archive?${asked}`);
  const began = performance.now(), answer = await fetch(`/archive/runs?${asked}`), found = await answer.json().catch(() => ({ problem: `The desk refused (${answer.status}).` }));
  if (mine !== number) return;
  $("where-problem").textContent = answer.ok ? "" : found.problem;
  if (!answer.ok) return;
  // An old list is shown at once; once it is renewed what has changed is shown, and nothing is moved else.
  if (found.renewing) setTimeout(() => { if (mine === number) find(); }, AGAIN_MS);
  const now = JSON.stringify([found.rows, found.first, found.found, found.all, asked.toString()]);
  if (now === shown) return;
  shown = now;
  last = found;
  head();
  $("archive").tBodies[0].replaceChildren(...found.rows.map(line));
  const end = found.first + found.rows.length;
  $("count").textContent = found.found ? `${found.first + 1} to ${end} of ${found.found} found, ${found.all} in all` : `none found of ${found.all}`;
  $("back").disabled = found.first === 0; $("on").disabled = end >= found.found;
  $("command").textContent = found.command;
  $("export").href = `/archive/table?${asked}`;
  document.body.dataset.found = String(found.found); document.body.dataset.took = (performance.now() - began).toFixed(0);
}
function turn(by) { asked.set("first", String(Math.max(0, last.first + by))); find(); }

for (const name of ["words", "where"]) $(name).value = asked.get(name) || "";
$("search").addEventListener("submit", (event) => { event.preventDefault(); search(); });
let waiting = 0;
$("words").addEventListener("input", () => { clearTimeout(waiting); waiting = setTimeout(search, 150); });
function search() { for (const name of ["words", "where"]) if ($(name).value.trim()) asked.set(name, $(name).value); else asked.delete(name); asked.delete("first"); find(); }
$("back").addEventListener("click", () => turn(-100));
$("on").addEventListener("click", () => turn(100));
$("open-ticked").addEventListener("click", () => {
  if (!ticked.size) { Desk.say("Tick a run first.", true); return; }
  location.href = `/results?${new URLSearchParams([...ticked].map((path) => ["run", path]))}`;
});
// What there is to be searched for: the newest specimens, kinds, campaigns …
fetch("/archive/hints").then(async (answer) => {
  if (!answer.ok) return;
  const hints = await answer.json();
  $("hints").replaceChildren(...Object.entries(hints).flatMap(([name, values]) => values.map((value) => Object.assign(make("option", name), { value }))));
  const shown = Object.entries(hints).filter(([name, values]) => values.length && name !== "step").map(([name, values]) => `${name}: ${values.slice(0, 4).join(", ")}${values.length > 4 ? " …" : ""}`);
  if (shown.length) $("known").textContent = ` There are, of ${shown.join("; of ")}.`;
}, () => {});
find();
