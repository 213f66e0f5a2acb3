// Plots of channels over time, with one time cursor through all of them; pointing at a time goes there.
import uPlot from "uplot";
import { frameAt, mixed } from "./data.js";
import { element, pretty, shortNumber } from "./format.js";
import { Marks } from "./marks.js";
import { CURVES } from "./theme.js";

const FONT = "11px system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif";
const LOWEST = 72; // px
const LANES = 2; // of names of events above the first plot, at most
const HIGHEST = 320;
const MOST = CURVES.length; // curves in one plot
const DASHES = [undefined, [7, 7], [2, 5], [10, 4, 2, 4]]; // of a curve that lies on none, one, two, ... others
const SPREAD = 15; // a plot's height over the least that a curve in it varies by, at most
const LEVEL = 2e-3;
const DOT = 2.2; // px, radius of a measured value
const CLOSE = 0.006; // curves nearer than this part of the plot's height hide one another

/** The least and the largest of a channel's values. */
function rangeOf({ values }) {
  let [low, high] = [Infinity, -Infinity];
  for (const v of values) {
    if (v < low) low = v;
    if (v > high) high = v;
  }
  return [low, high];
}

/** A channel that hardly changes, measured by its own size, is a straight line anyway. */
const level = ([low, high]) => high - low <= LEVEL * Math.max(Math.abs(low), Math.abs(high));

/** Whether all of these channels can be seen in one plot: none of them would be all but a straight line there. */
function comparable(channels) {
  const ranges = channels.map(rangeOf);
  const [low, high] = [Math.min(...ranges.map(([a]) => a)), Math.max(...ranges.map(([, b]) => b))];
  const noise = 1e-9 * Math.max(Math.abs(low), Math.abs(high));
  const spans = ranges
    .filter((range) => !level(range))
    .map(([a, b]) => b - a)
    .filter((span) => span > noise);
  return !spans.length || high - low <= SPREAD * Math.min(...spans);
}

/** Channels that share a plot: those of one unit that can be seen beside one another, or each for itself. */
export function grouped(channels, together) {
  const groups = [];
  const fits = (group, channel) =>
    group[0].unit === channel.unit && group.length < MOST && comparable([...group, channel]);
  for (const channel of channels) {
    const home = together && groups.find((group) => fits(group, channel));
    if (home) home.push(channel);
    else groups.push([channel]);
  }
  return groups;
}

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const gapped = (values) =>
  values.every(Number.isFinite) ? values : Array.from(values, (v) => (Number.isFinite(v) ? v : null));

/** Measured values as dots over a plot's curves, where they lie within its times. */
function drawDots(chart, dots, colour) {
  const { ctx, bbox } = chart;
  ctx.save();
  ctx.fillStyle = colour;
  ctx.beginPath();
  for (const { t, values } of dots)
    values.forEach((value, k) => {
      if (!Number.isFinite(value)) return;
      const [x, y] = [chart.valToPos(t[k], "x", true), chart.valToPos(value, "y", true)];
      if (x < bbox.left - 1 || x > bbox.left + bbox.width + 1) return;
      ctx.moveTo(x + DOT * devicePixelRatio, y);
      ctx.arc(x, y, DOT * devicePixelRatio, 0, 2 * Math.PI);
    });
  ctx.fill();
  ctx.restore();
}

/** A constant curve still gets some room above and below, and one in the noise is not blown up. */
function valueRange(_, low, high) {
  if (low === null) return [0, 1];
  const span = high - low;
  const floor = 1e-9 * Math.max(Math.abs(low), Math.abs(high));
  if (span > floor) return [low - 0.08 * span, high + 0.08 * span];
  const room = Math.abs(low) > 0 ? 0.1 * Math.abs(low) : 1;
  return [low - room, high + room];
}

/** The power of ten to take out of an axis: none where plain numbers do. */
function powerOf(values) {
  const power = Math.floor(Math.log10(Math.max(...values.filter(Number.isFinite).map(Math.abs), 0)));
  return Number.isFinite(power) && (power < -3 || power > 4) ? power : 0;
}

const raised = (power) => [...String(power)].map((c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]).join("");

/** Labels of ticks, with as many digits as tell them apart. */
function ticks(splits, power) {
  const given = splits.filter((value) => value !== null).map((value) => value / 10 ** power);
  const step = given.length > 1 ? Math.abs(given[1] - given[0]) : Math.abs(given[0]) || 1;
  const digits = Math.min(Math.max(0, Math.ceil(-Math.log10(step) - 1e-9)), 12);
  const exact =
    [digits, digits + 1, digits + 2].find((d) => Math.abs(Number(step.toFixed(d)) - step) < 1e-6 * step) ?? digits;
  return splits.map((value) =>
    value === null
      ? ""
      : (value / 10 ** power)
          .toFixed(exact)
          .replace("-", "−")
          .replace(/^−(0(\.0*)?)$/, "$1"),
  );
}

/** For each curve, how many of those before it it lies on: dashed, it lets them show. */
export function hidden(channels) {
  const ranges = channels.map(rangeOf);
  const [low, high] = [Math.min(...ranges.map(([a]) => a)), Math.max(...ranges.map(([, b]) => b))];
  const near = Math.max(CLOSE * (high - low), 1e-12 * Math.max(Math.abs(low), Math.abs(high)));
  const same = (a, b) => a.values.every((v, k) => !(Math.abs(v - b.values[k]) > near));
  return channels.map((channel, k) => channels.slice(0, k).filter((other) => same(channel, other)).length);
}

/** A channel of another motion at these times; nothing beyond that motion. */
function valuesAt(motion, { name, unit }, times) {
  const values = motion.values.get(`${name} ${unit}`);
  const [first, last] = [motion.times[0], motion.times.at(-1)];
  return Array.from(times, (t) => {
    const value = values && t >= first && t <= last ? mixed(values, frameAt(motion.times, t)) : null;
    return Number.isFinite(value) ? value : null;
  });
}

export class Plot {
  /** One plot with its own head line, cursor and markers; `title` says what its axis shows, `marks` are drawn over it. */
  constructor(parent, channels, times, onSeek, title, marks, motions = [], measured = []) {
    const dots = measured.filter(({ name, unit }) => channels.some((c) => c.name === name && c.unit === unit));
    Object.assign(this, { channels, times, marks, motions, dots, dashes: hidden(channels).map((n) => DASHES[n % DASHES.length]) });
    this.values = channels.map(() => element("output", { className: "value" }));
    const names = channels.map((channel, k) => {
      const swatch = element("span", { className: "swatch" });
      const colour = CURVES[k % CURVES.length];
      swatch.style.background = this.dashes[k]
        ? `repeating-linear-gradient(to right, ${colour} 0 4px, transparent 4px 6px)`
        : colour;
      const name = element("span", { className: "name", textContent: channel.name, title: channel.name });
      return element("span", { className: "curve" }, swatch, name, this.values[k]);
    });
    this.beside = channels.length === 1 ? motions.map(() => element("output", { className: "value beside" })) : [];
    this.beside.forEach((value, k) => (value.style.color = motions[k].colour));
    if (this.beside.length) names[0].append(...this.beside);
    this.power = powerOf(channels.map(rangeOf).flat());
    const shown = [this.power ? `10${raised(this.power)}` : "", pretty(channels[0].unit)].filter(Boolean).join(" ");
    const unit = element("span", { className: "unit", textContent: `${title} ${shown ? `[${shown}]` : ""}`.trim() });
    const head = element("div", { className: "plot-head" }, element("div", { className: "curves" }, ...names), unit);
    this.box = element("div", { className: "plot-box" });
    const label = `Plot of ${channels.map((channel) => channel.name).join(", ")} over time`;
    this.root = element("figure", { className: "plot", aria: { role: "group", label } }, head, this.box);
    parent.append(this.root);
    this.chart = new uPlot(this.#options(), this.#data(), this.box);
    this.#addCursor(onSeek);
    marks.listen(this.chart, this.box);
  }

  #data() {
    const { channels, times } = this;
    const own = channels.map(({ values }) => gapped(values));
    const others = this.motions.flatMap((motion) => channels.map((channel) => valuesAt(motion, channel, times)));
    return [times, ...others, ...own]; // this motion's curves lie over the others
  }

  #options() {
    const axis = {
      stroke: () => css("--muted"),
      font: FONT,
      grid: { stroke: () => css("--line"), width: 1 },
      ticks: { show: false },
    };
    const labels = (_, splits) => ticks(splits, 0);
    const values = (_, splits) => ticks(splits, this.power);
    return {
      width: 300,
      height: 150,
      padding: [8 + this.marks.room, 12, 0, 0],
      cursor: { show: false },
      legend: { show: false },
      hooks: {
        drawAxes: [(chart) => this.marks.draw(chart, css("--event"))],
        draw: [(chart) => this.dots.length && drawDots(chart, this.dots, css("--ink"))],
      },
      scales: {
        x: { time: false, range: (_, low, high) => (high > low ? [low, high] : [low - 0.5, low + 0.5]) },
        y: { range: (chart, low, high) => valueRange(chart, ...this.#withDots(low, high)) },
      },
      axes: [
        { ...axis, size: 22, gap: 4, space: 56, values: labels },
        { ...axis, size: 54, gap: 6, space: (_, __, ___, ____, height) => Math.max(16, height / 8), values },
      ],
      series: [
        {},
        ...this.motions.flatMap(({ colour }) => this.channels.map(() => ({ stroke: colour, width: 1.2, pxAlign: 0, points: { show: false } }))),
        ...this.channels.map((_, k) => ({
          stroke: CURVES[k % CURVES.length],
          dash: this.dashes[k],
          width: 1.6,
          pxAlign: 0,
          points: { show: this.times.length === 1 },
        })),
      ],
    };
  }

  /** A range of values that holds the measured ones too. */
  #withDots(low, high) {
    const ranges = this.dots.map(({ values }) => rangeOf({ values: values.filter(Number.isFinite) }));
    return low === null ? [low, high] : [Math.min(low, ...ranges.map(([a]) => a)), Math.max(high, ...ranges.map(([, b]) => b))];
  }

  #addCursor(onSeek) {
    const { over } = this.chart;
    this.cursor = element("div", { className: "cursor" });
    this.markers = this.channels.map((_, k) => {
      const marker = element("div", { className: "marker" });
      marker.style.background = CURVES[k % CURVES.length];
      return marker;
    });
    over.append(this.cursor, ...this.markers);
    const seek = (event) => {
      const { left, width } = over.getBoundingClientRect();
      onSeek(this.chart.posToVal(Math.min(Math.max(event.clientX - left, 0), width), "x"));
    };
    over.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      over.setPointerCapture(event.pointerId);
      seek(event);
    });
    over.addEventListener("pointermove", (event) => over.hasPointerCapture(event.pointerId) && seek(event));
  }

  /** Other values of the same channels, at these times. */
  redraw(channels, times) {
    Object.assign(this, { channels, times });
    this.chart.setData(this.#data());
  }

  resize(width, height) {
    this.chart.setSize({ width, height });
  }

  /** Move the cursor to a time, which lies at a given place among the samples. */
  seek(time, frame) {
    const { chart, cursor, markers, values, channels } = this;
    const x = Math.round(chart.valToPos(time, "x"));
    cursor.style.transform = `translateX(${x}px)`;
    channels.forEach((channel, k) => {
      const value = mixed(channel.values, frame);
      values[k].textContent = shortNumber(value);
      markers[k].hidden = !Number.isFinite(value);
      if (!markers[k].hidden) markers[k].style.transform = `translate(${x}px, ${chart.valToPos(value, "y")}px)`;
    });
    this.beside.forEach((output, k) => (output.textContent = shortNumber(valuesAt(this.motions[k], channels[0], [time])[0])));
  }

  destroy() {
    this.chart.destroy();
    this.root.remove();
  }
}

export class Plots {
  /** All plots in an element; `onSeek(time)` is called when the user points at a time. */
  constructor(box, times, onSeek, marks = [], measured = []) {
    Object.assign(this, { box, times, onSeek, marks, measured, plots: [], last: null, motions: [] });
    this.empty = element("p", { className: "empty", textContent: "No channel is shown. Choose some above." });
    new ResizeObserver(() => this.resize()).observe(box);
  }

  /** Draw the curves of other motions too, each motion in one colour: its times, and values by name and unit. */
  overlay(motions) {
    this.motions = motions;
    this.show(...this.asked);
  }

  /** Show these channels and no others. */
  show(channels, together) {
    this.asked = [channels, together];
    const groups = grouped(channels, together);
    for (const plot of this.plots) plot.destroy();
    const marks = (k) => new Marks(this.marks, k === 0 ? LANES : 0);
    this.plots = groups.map(
      (group, k) => new Plot(this.box, group, this.times, this.onSeek, "", marks(k), this.motions, this.measured),
    );
    if (groups.length) this.empty.remove();
    else this.box.append(this.empty);
    this.resize();
  }

  /** Show the channels of another recording, as `show` does. */
  replace(times, marks, [channels, together]) {
    Object.assign(this, { times, marks, asked: [channels, together] });
    const named = new Map(channels.map((channel) => [channel.name, channel]));
    const there = this.plots.flatMap(({ channels: own }) => own.map(({ name }) => name));
    if (there.length !== channels.length || there.some((name) => !named.has(name))) return this.show(channels, together);
    for (const plot of this.plots) {
      plot.marks.marks = marks;
      plot.redraw(plot.channels.map(({ name }) => named.get(name)), times);
    }
  }

  /** The channels have got other values, at these times; marks were those of the earlier ones. */
  extend(times) {
    Object.assign(this, { times, marks: [] });
    for (const plot of this.plots) {
      plot.marks.marks = [];
      plot.redraw(plot.channels, times);
    }
  }

  resize() {
    const { clientWidth, clientHeight } = this.box;
    if (!clientWidth || !this.plots.length) return;
    const heads = this.plots.reduce((sum, plot) => sum + plot.root.firstChild.offsetHeight + 10, 0);
    const each = Math.floor((clientHeight - heads) / this.plots.length);
    for (const plot of this.plots) plot.resize(plot.box.clientWidth, Math.min(Math.max(each, LOWEST), HIGHEST));
    if (this.last) this.seek(...this.last);
  }

  seek(time, frame) {
    this.last = [time, frame];
    for (const plot of this.plots) plot.seek(time, frame);
  }

  retheme() {
    for (const plot of this.plots) plot.chart.redraw(false, true);
  }
}
