// The drawings: a loop (x is no time there, so uPlot runs in mode 2 with a path of our own) and traces.
/* global uPlot */

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const FONT = "13px system-ui, 'DejaVu Sans', sans-serif";

// uPlot draws in device pixels; a line drawn as it comes, from each point to the next, a gap where one is null
function drawnAsItComes(u, index) {
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

function axis(label, more = {}) {
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
  constructor(element) {
    this.x = new Span(10); this.y = new Span(20);
    const facets = [{ scale: "x", auto: true }, { scale: "y", auto: true }];
    this.chart = fitted(element, (size, parent) => new uPlot({
      mode: 2, ...size, legend: { show: false }, cursor: { show: false }, padding: [10, 14, 0, 0],
      scales: { x: { time: false, range: () => [this.x.low, this.x.high] }, y: { range: () => [this.y.low, this.y.high] } },
      axes: [axis("stroke in mm", { size: 34 }), axis("force in kN", { size: 52 })],
      series: [
        {},
        { facets, stroke: () => css("--pale"), width: 1, paths: drawnAsItComes, points: { show: false } },
        { facets, stroke: () => css("--force"), width: 2, paths: drawnAsItComes, points: { show: false } },
      ],
      hooks: { draw: [(u) => this.dot(u)] },
    }, [null, [[], []], [[], []]], parent));
    this.point = null;
  }
  dot(u) {
    if (!this.point) return;
    const x = u.valToPos(this.point[0], "x", true), y = u.valToPos(this.point[1], "y", true);
    u.ctx.save(); u.ctx.fillStyle = css("--ink"); u.ctx.beginPath();
    u.ctx.arc(x, y, 5 * devicePixelRatio, 0, 7); u.ctx.fill(); u.ctx.restore();
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

export class TraceChart {
  constructor(element, label, colour, { least, size = 52 }) {
    this.y = new Span(least); this.window = [-30, 0];
    this.chart = fitted(element, (dims, parent) => new uPlot({
      ...dims, legend: { show: false }, cursor: { show: false }, padding: [8, 14, 0, 0],
      scales: { x: { time: false, range: () => this.window }, y: { range: () => [this.y.low, this.y.high] } },
      axes: [axis("seconds before now", { size: 34, incrs: [1, 5, 10, 30, 60, 300, 600, 1800, 3600] }), axis(label, { size })],
      series: [{}, { stroke: () => css(colour), width: 1.75, points: { show: false } }],
    }, [[], []], parent));
  }
  show(xs, ys, window, unit = "seconds before now") {
    this.window = window;
    this.chart().axes[0].label = unit;
    let low = Infinity, high = -Infinity;
    for (const v of ys) if (v !== null && v !== undefined) { if (v < low) low = v; if (v > high) high = v; }
    this.y.fit(low, high);
    this.chart().setData([xs, ys]);
  }
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
