// The cycles of the step under way: their figures as they come, and how they change.
import { TrendChart } from "./charts.js";
import { $, cell, choices, fixed, make, put } from "./times.js";

let chart = null, shown = null, asked = {};

export function begin() {
  chart = new TrendChart($("trend-chart"));
  $("trend-of").addEventListener("change", draw);
}

export function setAsked(step) { asked = step?.asked || {}; if (shown) table(); }

export function show(content) {
  shown = content;
  const columns = [...content.columns, { name: "temperature_C", heading: "temperature", unit: "°C", decimals: 1 }];
  if ($("trend-of").length !== columns.length) choices($("trend-of"), columns.map((one) => [one.name, one.unit ? `${one.heading} in ${one.unit}` : one.heading]), "damping");
  table();
  draw();
}

function table() {
  const columns = [
    { name: "amplitude_mm", heading: "amplitude", unit: "mm", decimals: 2 },
    ...shown.columns.filter((one) => one.name !== "amplitude_mm"),
    { name: "temperature_C", heading: "temp.", unit: "°C", decimals: 1 },
  ];
  const wanted = asked.amplitude_mm;
  put("asked", wanted ? `Asked: ${fixed(asked.prestress_mm, 2)} ± ${fixed(wanted, 2)} mm${asked.frequency_Hz ? ` at ${fixed(asked.frequency_Hz, 3)} Hz` : ""}.` : "");
  const head = make("tr");
  head.setAttribute("role", "row");
  head.append(...[{ heading: "cycle" }, ...columns].map((one) => { const th = make("th", "", one.heading); th.scope = "col"; th.setAttribute("role", "columnheader"); if (one.unit) th.append(" ", make("i", "", one.unit)); return th; }));
  $("cycle-head").replaceChildren(head);
  $("cycle-rows").replaceChildren(...[...shown.rows].reverse().map((row) => {
    const line = make("tr");
    line.title = row.missing || "";
    line.setAttribute("role", "row");
    line.append(cell(row.n, "cycle", row.missing ? ` – ${row.missing}` : ""), ...columns.map((one) => cell(fixed(row[one.name], one.decimals), one.heading, one.unit)));
    return line;
  }));
  $("cycles-none").hidden = shown.rows.length > 0;
  $("trend").hidden = !shown.rows.length;
}

function draw() {
  const name = $("trend-of").value, points = shown?.trend[name] || [];
  const [n, last] = points[points.length - 1] || [0, null];
  $("trend-chart").classList.toggle("blank", !points.length);  // axes without a point say nothing
  chart.show(points.map((p) => p[0]), points.map((p) => p[1]));
  const first = points[0]?.[1], change = points.length > 1 && first ? 100 * (last / first - 1) : null;
  put("trend-said", points.length > 1 ? `Cycle ${points[0][0]} to ${n}: ${change >= 0 ? "+" : "−"}${Math.abs(change).toFixed(1)} %` : "");
}
