// Marks of what happened at instants, on a plot: lines or ticks over its grid, names above, and what a pointer is told.
import { element, shortNumber } from "./format.js";

const LANE = 13; // px, of names above a plot
const NEAR = 5; // px between a mark and what points at it
const ROOM = 3; // px between names
const LONG = 34; // letters of a name
const SIZE = 10.5; // px, of the letters
const FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif";

const short = (text) => (text.length <= LONG ? text : `${text.slice(0, LONG - 1)}…`);

const under = (j, k) => j.low - ROOM < k.x && k.x < j.high + ROOM && j.x !== k.x;

/** Whether name j has to be above name k: the mark of k is below it, or else they overlap and j comes first. */
const over = (j, k) =>
  under(j, k) ||
  (j.lane === k.lane && Math.max(j.low, k.low) < Math.min(j.high, k.high) && !under(k, j) && j.x < k.x);

/** Give names the lowest lanes; whether there are enough of them. */
function inLanes(names, lanes) {
  for (const one of names) one.lane = 0;
  for (let n = 0; n < lanes * names.length; n++) {
    const low = names.find((j) => names.some((k) => k !== j && j.lane <= k.lane && over(j, k)));
    if (!low) return true;
    if (++low.lane >= lanes) return false;
  }
  return false;
}

/**
 * Names in lanes, as many as fit, by their rank: [{ mark, x, low, high, right, lane }]. A name is above all whose marks
 * are below it: lines go up to higher lanes beside names. `at` gives the place of a mark, `measure` the width of a text.
 */
export function placedNames(marks, at, width, measure, lanes) {
  let kept = [];
  for (const mark of marks.filter(({ label }) => label).sort((a, b) => a.rank - b.rank)) {
    const [x, long] = [at(mark), measure(short(mark.label)) + 2 * ROOM];
    const right = x + long <= width;
    const more = [...kept, { mark, x, right, low: right ? x : x - long, high: right ? x + long : x }];
    if (more.at(-1).low >= 0 && inLanes(more, lanes)) kept = more;
  }
  inLanes(kept, lanes);
  return kept;
}

export class Marks {
  /** The marks of one plot, and in how many lanes at most their names are written above it. */
  constructor(marks, lanes) {
    Object.assign(this, { marks, lanes: Math.min(lanes, marks.filter(({ label }) => label).length), shown: [] });
  }

  /** Room that the names take above the plot at most [px]. */
  get room() {
    return LANE * this.lanes;
  }

  #inside({ scales }) {
    return this.marks.filter(({ t }) => t >= scales.x.min && t <= scales.x.max);
  }

  /** Draw them over the grid, below the curves. */
  draw(chart, colour) {
    const { ctx, bbox } = chart;
    const inside = this.#inside(chart);
    if (!inside.length) return;
    const scale = devicePixelRatio;
    const at = ({ t }) => Math.round(chart.valToPos(t, "x", true)) + 0.5;
    ctx.save();
    Object.assign(ctx, { strokeStyle: colour, fillStyle: colour, lineWidth: 1.25 * scale, textBaseline: "alphabetic" });
    ctx.setLineDash([4 * scale, 3 * scale]);
    ctx.beginPath();
    for (const mark of inside) {
      ctx.moveTo(at(mark), bbox.top);
      ctx.lineTo(at(mark), bbox.top + (mark.line ? 1 : 0.05) * bbox.height);
    }
    ctx.stroke();
    if (this.lanes) this.#name(chart, inside, at, scale);
    ctx.restore();
  }

  #name({ ctx, bbox }, inside, at, scale) {
    ctx.font = `${SIZE * scale}px ${FONT}`;
    const measure = (text) => ctx.measureText(text).width / scale;
    const found = placedNames(inside, (mark) => (at(mark) - bbox.left) / scale, bbox.width / scale, measure, this.lanes);
    this.shown = found.map(({ mark }) => short(mark.label));
    ctx.setLineDash([]);
    ctx.lineWidth = scale;
    ctx.beginPath();
    for (const { mark, lane, right } of found) {
      const foot = bbox.top - (3 + lane * LANE) * scale;
      ctx.moveTo(at(mark), bbox.top);
      ctx.lineTo(at(mark), foot - 8 * scale);
      ctx.textAlign = right ? "left" : "right";
      ctx.fillText(short(mark.label), at(mark) + (right ? ROOM : -ROOM) * scale, foot);
    }
    ctx.stroke();
  }

  /** Tell the name and time of a mark that is pointed at. */
  listen(chart, box) {
    const { over } = chart;
    const tip = element("div", { className: "tip mark-tip", hidden: true });
    box.append(tip);
    over.addEventListener("pointermove", (event) => {
      const { left, width } = over.getBoundingClientRect();
      const x = event.clientX - left;
      const away = (mark) => Math.abs(chart.valToPos(mark.t, "x") - x);
      const [nearest] = this.#inside(chart).sort((a, b) => away(a) - away(b));
      tip.hidden = !nearest || away(nearest) > NEAR;
      if (tip.hidden) return;
      tip.textContent = `${nearest.text}, ${shortNumber(nearest.t)} s`;
      const right = x < width / 2;
      Object.assign(tip.style, {
        top: `${over.offsetTop + 4}px`,
        left: right ? `${over.offsetLeft + x + 10}px` : "auto",
        right: right ? "auto" : `${box.clientWidth - over.offsetLeft - x + 10}px`,
      });
    });
    over.addEventListener("pointerleave", () => (tip.hidden = true));
  }
}
