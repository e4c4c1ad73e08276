// The drawings: a loop (x is no time there, so uPlot runs in mode 2 with a path of our own) and traces.
/* global uPlot */

export const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const FONT = "13px system-ui, 'DejaVu Sans', sans-serif";

// uPlot draws in device pixels; a line drawn as it comes, from each point to the next, a gap where one is null
export function drawnAsItComes(u, index) {
  let path;
  uPlot.orient(u, index, (series, xs, ys, scaleX, scaleY, posX, posY, left, top, width, height) => {
    path = new Path2D();
    let pen = false;
    for (let i = 0; i < xs.length; i++) {
      if (xs[i] === null || ys[i] === null) { pen = false; continue; }
      const x = posX(xs[i], scaleX, width, left), y = posY(ys[i], scaleY, height, top);
      if (pen) path.lineTo(x, y); else path.moveTo(x, y);
      pen = true;
    }
  });
  return path ? { stroke: path, fill: null, clip: null, band: null, gaps: null, flags: 2 } : null;
}

export function axis(label, more = {}) {
  return {
    label, labelFont: FONT, font: FONT, labelSize: 22, size: 46, labelGap: 0, gap: 4,
    stroke: () => css("--soft"), grid: { stroke: () => css("--grid"), width: 1 },
    ticks: { stroke: () => css("--line"), width: 1, size: 5 }, ...more,
  };
}

// A range that holds the data with some air, and changes only when it must: a scale that breathes cannot be read.
export class Span {
  constructor(least) { this.least = least; this.low = 0; this.high = least; }
  reset() { this.low = 0; this.high = this.least; }
  fit(low, high) {
    if (!isFinite(low) || !isFinite(high)) return;
    const size = Math.max(high - low, this.least), air = 0.06 * size;
    const grows = low < this.low || high > this.high;
    const shrinks = size < 0.45 * (this.high - this.low);
    if (!grows && !shrinks) return;
    const step = nice(size / 8);
    this.low = Math.floor((Math.min(low, high - this.least) - air) / step) * step;
    if (low >= -0.02 * size && low < 0.4 * size) this.low = -step / 2;
    this.high = Math.ceil((high + air) / step) * step;
  }
}

function nice(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  for (const factor of [1, 2, 5, 10]) if (factor * power >= value) return factor * power;
  return 10 * power;
}

function fitted(element, make) {
  let chart = null;
  const size = () => ({ width: Math.max(120, element.clientWidth), height: Math.max(120, element.clientHeight) });
  const build = () => { if (chart) chart.destroy(); chart = make(size(), element); };
  build();
  new ResizeObserver(() => chart.setSize(size())).observe(element);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => chart.redraw(false, false));
  return () => chart;
}

export class LoopChart {
  constructor(element, { pointed }) {
    this.x = new Span(10); this.y = new Span(20); this.windows = []; this.band = null; this.zoom = null;
    const facets = [{ scale: "x", auto: true }, { scale: "y", auto: true }];
    this.chart = fitted(element, (size, parent) => new uPlot({
      mode: 2, ...size, legend: { show: false }, cursor: { show: false }, padding: [10, 14, 0, 0],
      scales: {
        x: { time: false, range: () => this.zoom?.x || [this.x.low, this.x.high] },
        y: { range: () => this.zoom?.y || [this.y.low, this.y.high] },
      },
      axes: [axis("stroke in mm", { size: 34 }), axis("force in kN", { size: 52 })],
      series: [
        {},
        { facets, stroke: () => css("--pale"), width: 1, paths: drawnAsItComes, points: { show: false } },
        { facets, stroke: () => css("--force"), width: 2, paths: drawnAsItComes, points: { show: false } },
      ],
      hooks: { draw: [(u) => this.dot(u)], ready: [(u) => this.listen(u, pointed)] },
    }, [null, [[], []], [[], []]], parent));
    this.point = null;
  }
  listen(u, pointed) {  // a cross that tells where it is; a rectangle that is drawn is looked at closely
    let from = null;
    const place = (event) => { const box = u.over.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
    u.over.addEventListener("pointerdown", (event) => { if (event.pointerType === "mouse") from = place(event); });
    u.over.addEventListener("pointermove", (event) => {
      const [x, y] = place(event);
      pointed(u.posToVal(x, "x"), u.posToVal(y, "y"));
      if (from) u.setSelect({ left: Math.min(x, from[0]), top: Math.min(y, from[1]), width: Math.abs(x - from[0]), height: Math.abs(y - from[1]) }, false);
    });
    u.over.addEventListener("pointerleave", () => pointed(null));
    u.over.addEventListener("pointerup", (event) => {
      if (!from) return;
      const [x, y] = place(event), [a, b] = from;
      from = null;
      u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
      if (Math.abs(x - a) < 8 || Math.abs(y - b) < 8) return;
      this.zoom = { x: [Math.min(x, a), Math.max(x, a)].map((v) => u.posToVal(v, "x")), y: [Math.max(y, b), Math.min(y, b)].map((v) => u.posToVal(v, "y")) };
      u.redraw(false, true); u.setData(u.data);
    });
    u.over.addEventListener("dblclick", () => this.whole());
  }
  whole() { this.zoom = null; const u = this.chart(); u.setData(u.data); }
  closer(factor) {
    const u = this.chart(), about = ({ min, max }) => { const middle = (min + max) / 2, half = factor * (max - min) / 2; return [middle - half, middle + half]; };
    this.zoom = { x: about(u.scales.x), y: about(u.scales.y) };
    u.setData(u.data);
  }
  dot(u) {
    const c = u.ctx, r = devicePixelRatio;
    c.save();
    if (this.band) {  // the twin's band round its newest cycle: one edge there, the other back
      const { s, low, high } = this.band, at = (k, edge) => [u.valToPos(s[k], "x", true), u.valToPos(edge[k], "y", true)];
      c.beginPath(); c.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height); c.clip();
      c.fillStyle = css("--good"); c.globalAlpha = 0.25;
      for (let k = 1; k < s.length; k++) {
        c.beginPath(); c.moveTo(...at(k - 1, low)); c.lineTo(...at(k, low)); c.lineTo(...at(k, high)); c.lineTo(...at(k - 1, high)); c.closePath(); c.fill();
      }
      c.globalAlpha = 1; c.restore(); c.save();
    }
    for (const w of this.windows) {  // what the requirement allows at a stroke: a bar with ends, an arrow where one is open
      const { min, max } = u.scales.y, x = u.valToPos(w.stroke_mm, "x", true);
      const low = u.valToPos(Math.max(w.lower_kN ?? min, min), "y", true), high = u.valToPos(Math.min(w.upper_kN ?? max, max), "y", true);
      if (w.stroke_mm < u.scales.x.min || w.stroke_mm > u.scales.x.max || low <= high) continue;
      c.strokeStyle = css("--good"); c.lineWidth = 2 * r; c.setLineDash([]); c.beginPath(); c.moveTo(x, low); c.lineTo(x, high);
      for (const y of [low, high]) { c.moveTo(x - 6 * r, y); c.lineTo(x + 6 * r, y); }
      c.stroke();
    }
    if (this.point) {
      const x = u.valToPos(this.point[0], "x", true), y = u.valToPos(this.point[1], "y", true);
      c.fillStyle = css("--ink"); c.beginPath(); c.arc(x, y, 5 * r, 0, 7); c.fill();
    }
    c.restore();
  }
  show(before, now, point) {
    this.point = point;
    for (const [span, index] of [[this.x, 0], [this.y, 1]]) {
      let low = Infinity, high = -Infinity;
      for (const part of [before[index], now[index]]) for (const v of part) if (v !== null) { if (v < low) low = v; if (v > high) high = v; }
      span.fit(low, high);
    }
    this.chart().setData([null, before, now]);
    this.points = before[0].length + now[0].length;
  }
}

const MARKS = [1, 5, 10, 30, 60, 300, 600, 1800, 3600, 14400, 43200];  // seconds
export class TraceChart {
  constructor(element, colour, { least, size = 52, zoomed, pointed }) {
    this.y = new Span(least); this.window = [-30, 0]; this.text = ""; this.unit = "seconds before now"; this.written = null;
    const line = { stroke: () => css(colour), width: 1.5, points: { show: false } };
    this.chart = fitted(element, (dims, parent) => new uPlot({
      ...dims, legend: { show: false }, padding: [8, 30, 0, 0],
      cursor: { y: false, points: { show: false }, drag: { x: true, y: false, setScale: false } },
      scales: { x: { time: false, range: () => this.window }, y: { range: () => [this.y.low, this.y.high] } },
      axes: [
        axis(this.unit, { size: 34, incrs: () => (this.written ? MARKS : [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, ...MARKS]), values: (u, marks) => marks.map((v) => (this.written ? this.written(v) : String(Number(v.toFixed(3))))) }),
        axis(this.text, { size }),
      ],
      series: [{}, line, line],
      bands: [{ series: [2, 1], fill: () => css(colour) + "44" }],
      hooks: {
        setSelect: [(u) => { if (u.select.width > 6) { zoomed(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x")); u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false); } }],
        setCursor: [(u) => { if (u.over.matches(":hover")) pointed(element.id.startsWith("stroke") ? 0 : 1, u.cursor.left < 0 ? null : u.posToVal(u.cursor.left, "x")); }],
        ready: [(u) => u.over.addEventListener("pointerleave", () => pointed(element.id.startsWith("stroke") ? 0 : 1, null))],
      },
    }, [[], [], []], parent));
  }
  // a name that the low chart would cut off stands in the choice above it: beside the scale is the unit then
  label(text, unit = "") {
    const u = this.chart();
    u.ctx.save();
    u.ctx.font = `${13 * devicePixelRatio}px system-ui, 'DejaVu Sans', sans-serif`;
    this.text = u.ctx.measureText(text).width / devicePixelRatio > u.height - 48 ? unit : text;
    u.ctx.restore();
    u.axes[1].label = this.text;
    u.root.parentElement.setAttribute("aria-label", `${text} over time`);
    u.redraw(false, true);
  }
  point(x) { const u = this.chart(); u.setCursor(x === null ? { left: -10, top: -10 } : { left: u.valToPos(x, "x"), top: 1 }, false); }
  at(x) {
    const u = this.chart(), xs = u.data[0];
    if (!xs.length) return null;
    const at = u.valToIdx(x), low = u.data[1][at], high = u.data[2][at];
    return low === null || low === undefined ? null : [low, high];
  }
  show(xs, low, high, window, unit, written = null) {
    this.window = window; this.unit = unit; this.written = written;
    this.chart().axes[0].label = unit;
    let least = Infinity, most = -Infinity;
    for (const ys of [low, high]) for (const v of ys) if (v !== null && v !== undefined) { if (v < least) least = v; if (v > most) most = v; }
    this.y.fit(least, most);
    this.chart().setData([xs, low, high]);
  }
}

export class TrendChart {
  constructor(element) {
    this.chart = fitted(element, (dims, parent) => new uPlot({
      ...dims, legend: { show: false }, cursor: { show: false }, padding: [8, 14, 0, 0],
      scales: { x: { time: false }, y: { range: (u, low, high) => { const air = Math.max(0.15 * (high - low), 0.005 * Math.abs(high || 1)); return low === null ? [0, 1] : [low - air, high + air]; } } },
      axes: [axis("cycle of the step", { size: 34, incrs: [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 5000] }), axis("", { size: 56, labelSize: 0 })],
      series: [{}, { stroke: () => css("--force"), width: 1.5, points: { show: true, size: 5, fill: () => css("--force") } }],
    }, [[], []], parent));
  }
  show(xs, ys) { this.chart().setData([xs, ys]); }
}

export const SENSOR_DASHES = [[], [7, 4], [2, 3], [10, 3, 2, 3]];

export class HeatChart {
  constructor(element) {
    this.element = element; this.count = null; this.stop = null; this.window = [-10, 10]; this.range = [15, 45];
  }
  build(kinds) {
    const count = kinds.join();
    if (this.count === count) return;
    this.count = count;
    this.element.replaceChildren();
    const sensors = kinds.map((specimen, i) => ({
      stroke: () => css(specimen ? "--heat" : "--soft"), width: i ? 1.5 : 2.5, dash: SENSOR_DASHES[i % 4], points: { show: false }, spanGaps: true,
    }));
    this.chart = fitted(this.element, (size, parent) => new uPlot({
      ...size, legend: { show: false }, cursor: { show: false }, padding: [10, 14, 0, 0],
      scales: { x: { time: false, range: () => this.window }, y: { range: () => this.range } },
      axes: [axis("minutes from now", { size: 34 }), axis("temperature in °C")],
      series: [{}, ...sensors, { stroke: () => css("--heat"), width: 2, dash: [3, 6], points: { show: false }, spanGaps: true }],
      hooks: { draw: [(u) => this.line(u)] },
    }, [[], ...sensors.map(() => []), []], parent));
  }
  line(u) {
    const c = u.ctx, { left, top, width, height } = u.bbox;
    c.save();
    c.setLineDash([]);
    c.font = `${13 * devicePixelRatio}px system-ui, 'DejaVu Sans', sans-serif`;
    if (this.window[0] < 0 && this.window[1] > 0) {
      const x = Math.round(u.valToPos(0, "x", true));
      c.strokeStyle = css("--pale"); c.lineWidth = devicePixelRatio; c.beginPath(); c.moveTo(x, top); c.lineTo(x, top + height); c.stroke();
    }
    if (this.stop !== null) {
      const y = Math.round(u.valToPos(this.stop, "y", true));
      c.strokeStyle = c.fillStyle = css("--bad"); c.lineWidth = 2 * devicePixelRatio;
      c.beginPath(); c.moveTo(left, y); c.lineTo(left + width, y); c.stroke();
      c.textAlign = "left"; c.textBaseline = "bottom"; c.fillText(`stop ${this.stop} °C`, left + 8 * devicePixelRatio, y - 3 * devicePixelRatio);
    }
    c.restore();
  }
  show(series, kinds, forecast, stop) {
    this.build(kinds);
    this.stop = stop;
    const all = [...series, forecast], times = [...new Set(all.flatMap((s) => s.map((p) => p[0])))].sort((a, b) => a - b);
    const place = new Map(times.map((t, i) => [t, i]));
    const columns = all.map((points) => { const column = new Array(times.length).fill(undefined); for (const [t, v] of points) column[place.get(t)] = v; return column; });
    const values = all.flatMap((s) => s.map((p) => p[1]));
    if (!values.length) return;
    this.window = [Math.min(times[0], -1), Math.max(times[times.length - 1], 1)];
    const low = Math.min(...values), high = Math.max(...values, stop ?? -Infinity);
    this.range = [Math.floor((low - 2) / 5) * 5, Math.ceil((high + 2) / 5) * 5];
    this.chart().setData([times, ...columns]);
  }
}
