// Loops of several runs over each other, and points with their uncertainty over a frequency.
/* global uPlot */
import { axis, css, drawnAsItComes } from "./charts.js";

export const TONES = ["#0072b2", "#b34a00", "#00694d", "#8a3b76", "#7a5c00", "#58636b", "#b3261e", "#2a7f9e"];

function sized(element) { return { width: Math.max(160, element.clientWidth), height: Math.max(160, element.clientHeight) }; }
function framed(values, air = 0.05) {
  let low = Infinity, high = -Infinity;
  for (const v of values) if (v !== null && v !== undefined) { if (v < low) low = v; if (v > high) high = v; }
  if (low > high) return [0, 1];
  const room = Math.max((high - low) * air, Math.abs(high) * 1e-3, 1e-6);
  return [low - room, high + room];
}

let loops = null;
export function drawLoops(element, curves) {
  if (loops) { loops.destroy(); loops = null; }
  if (!curves.length) return;
  const facets = [{ scale: "x", auto: true }, { scale: "y", auto: true }];
  const x = framed(curves.flatMap((one) => one.s)), y = framed(curves.flatMap((one) => one.f));
  loops = new uPlot({
    mode: 2, ...sized(element), legend: { show: false }, cursor: { show: false }, padding: [10, 14, 0, 0],
    scales: { x: { time: false, range: () => x }, y: { range: () => y } },
    axes: [axis("stroke in mm", { size: 34 }), axis("force in kN", { size: 52 })],
    series: [{}, ...curves.map((one) => ({ facets, stroke: one.tone, width: 1.75, dash: one.dashed ? [8, 5] : [], paths: drawnAsItComes, points: { show: false } }))],
  }, [null, ...curves.map((one) => [one.s, one.f])], element);
}

let trend = null;
export function drawTrend(element, one, label) {
  if (trend) { trend.destroy(); trend = null; }
  if (!one) return;
  const fx = one.frequency_Hz, u = one.expanded_uncertainty, order = fx.map((_, i) => i).sort((a, b) => fx[a] - fx[b]);
  const xs = order.map((i) => fx[i]), ys = order.map((i) => one.values[i]), us = order.map((i) => u?.[i] ?? 0);
  const line = one.slope_per_Hz === null || one.slope_per_Hz === undefined ? xs.map(() => null) : xs.map((f) => one.intercept + one.slope_per_Hz * f);
  const y = framed([...ys.map((v, i) => v - us[i]), ...ys.map((v, i) => v + us[i])], 0.1), x = framed(xs, 0.08);
  trend = new uPlot({
    ...sized(element), legend: { show: false }, cursor: { show: false }, padding: [10, 14, 0, 0],
    scales: { x: { time: false, range: () => x }, y: { range: () => y } },
    axes: [axis("frequency in Hz", { size: 34 }), axis(label, { size: 62 })],
    series: [{}, { stroke: css("--force"), width: 0, points: { show: true, size: 8, fill: css("--force") } }, { stroke: css("--soft"), width: 1.5, dash: [6, 4], points: { show: false } }],
    hooks: { draw: [(p) => {
      const c = p.ctx, r = devicePixelRatio;
      c.save(); c.setLineDash([]); c.strokeStyle = css("--force"); c.lineWidth = 1.5 * r; c.beginPath();
      xs.forEach((f, i) => {
        const at = p.valToPos(f, "x", true), low = p.valToPos(ys[i] - us[i], "y", true), high = p.valToPos(ys[i] + us[i], "y", true);
        c.moveTo(at, low); c.lineTo(at, high);
        for (const end of [low, high]) { c.moveTo(at - 5 * r, end); c.lineTo(at + 5 * r, end); }
      });
      c.stroke(); c.restore();
    }] },
  }, [xs, ys, line], element);
}
