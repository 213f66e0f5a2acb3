// Taking away what the page shows: the picture (PNG), the plots (SVG), the animation (WebM).
import { CURVES } from "./theme.js";

const NS = "http://www.w3.org/2000/svg";
const FRAMES = 30; // a second of video
const HEAD = 22; // px above a plot, for its names
const TYPES = ["video/webm;codecs=vp9", "video/webm"];

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function download(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

/** A canvas on which the picture of a stage is copied, with its ground. */
class Copy {
  constructor(stage) {
    this.from = stage.element.querySelector("canvas");
    this.canvas = document.createElement("canvas");
    Object.assign(this.canvas, { width: 2 * Math.floor(this.from.width / 2), height: 2 * Math.floor(this.from.height / 2) });
    this.pen = this.canvas.getContext("2d");
  }

  /** Copy the picture; to be called in the frame in which it was drawn. */
  take() {
    this.pen.fillStyle = css("--stage-b");
    this.pen.fillRect(0, 0, this.canvas.width, this.canvas.height);
    this.pen.drawImage(this.from, 0, 0);
  }
}

function savePicture({ stage }, name) {
  const copy = new Copy(stage);
  stage.dirty = true;
  stage.draw(performance.now());
  copy.take();
  copy.canvas.toBlob((blob) => download(blob, `${name}.png`), "image/png");
}

function svg(parent, tag, attributes, text = "") {
  const made = document.createElementNS(NS, tag);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  parent.append(made);
  return made;
}

/** A curve in pixels; it is broken where it has no value. */
function pathOf(chart, times, values) {
  let pen = "M";
  return times.reduce((path, t, k) => {
    if (!Number.isFinite(values[k])) {
      pen = "M";
      return path;
    }
    const step = `${pen}${chart.valToPos(t, "x").toFixed(2)} ${chart.valToPos(values[k], "y").toFixed(2)}`;
    pen = "L";
    return path + step;
  }, "");
}

/** One plot, with its names, its axes and its curves. */
function drawPlot(root, plot, top) {
  const { chart, channels, times } = plot;
  const box = Object.fromEntries(Object.entries(chart.bbox).map(([key, value]) => [key, value / devicePixelRatio]));
  const head = svg(root, "g", { transform: `translate(${box.left} ${top + 15})` });
  const names = svg(head, "text", {});
  channels.forEach(({ name }, k) => svg(names, "tspan", { fill: CURVES[k % CURVES.length], dx: k ? 14 : 0 }, name));
  svg(head, "text", { x: box.width, "text-anchor": "end" }, plot.root.querySelector(".unit").textContent);
  const area = svg(root, "g", { transform: `translate(${box.left} ${top + HEAD + box.top})` });
  const [across, up] = chart.axes;
  const labels = (axis) => axis.values(chart, axis._splits);
  labels(across).forEach((label, k) => {
    const x = chart.valToPos(across._splits[k], "x");
    svg(area, "line", { x1: x, x2: x, y2: box.height, stroke: css("--line") });
    svg(area, "text", { x, y: box.height + 15, "text-anchor": "middle" }, label);
  });
  labels(up).forEach((label, k) => {
    const y = chart.valToPos(up._splits[k], "y");
    svg(area, "line", { y1: y, y2: y, x2: box.width, stroke: css("--line") });
    svg(area, "text", { x: -6, y: y + 4, "text-anchor": "end" }, label);
  });
  channels.forEach(({ values }, k) => {
    const look = { fill: "none", stroke: CURVES[k % CURVES.length], "stroke-width": 1.6, "stroke-dasharray": (plot.dashes[k] ?? []).join(" ") };
    svg(area, "path", { d: pathOf(chart, Array.from(times), values), ...look });
  });
  return top + HEAD + chart.height + 8;
}

function savePlots({ plots }, name) {
  const root = document.createElementNS(NS, "svg");
  const width = Math.max(...plots.map(({ chart }) => chart.width));
  const ground = svg(root, "rect", { width: "100%", height: "100%", fill: css("--panel") });
  const height = plots.reduce((top, plot) => drawPlot(root, plot, top), 0);
  const look = { "font-family": "sans-serif", "font-size": 12, fill: css("--ink") };
  for (const [key, value] of Object.entries({ width, height, viewBox: `0 0 ${width} ${height}`, ...look })) root.setAttribute(key, value);
  root.prepend(ground);
  download(new Blob([new XMLSerializer().serializeToString(root)], { type: "image/svg+xml" }), `${name}.svg`);
}

/** Record the animation once from its begin to its end, at its speed; returns what ends it early. */
function record({ picture, clock }, name, onEnd) {
  const copy = new Copy(picture.stage);
  const type = TYPES.find((one) => MediaRecorder.isTypeSupported(one));
  const recorder = new MediaRecorder(copy.canvas.captureStream(FRAMES), { mimeType: type, videoBitsPerSecond: 8e6 });
  const parts = [];
  const { looping } = clock;
  recorder.ondataavailable = ({ data }) => parts.push(data);
  recorder.onstop = () => {
    Object.assign(clock, { looping });
    picture.onFrame = null;
    download(new Blob(parts, { type: "video/webm" }), `${name}.webm`);
    onEnd();
  };
  const stop = () => recorder.state !== "inactive" && recorder.stop();
  clock.looping = false;
  clock.seek(clock.begin);
  picture.onFrame = (drawn) => {
    if (drawn) copy.take();
    if (!clock.playing) setTimeout(stop, 1000 / FRAMES); // the last frame is part of it
  };
  recorder.start();
  clock.play();
  return stop;
}

/** The buttons that save something; `player` is the page's. */
export function saveButtons(box, player) {
  const name = () => player.recording.name.replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-|-$/g, "") || "motion";
  const button = (what) => box.querySelector(`[name=save-${what}]`);
  const film = button("webm");
  button("png").addEventListener("click", () => savePicture(player.picture, name()));
  button("svg").addEventListener("click", () => player.plots.plots.length && savePlots(player.plots, name()));
  button("png").disabled = film.disabled = !player.picture.stage.renderer;
  film.disabled ||= typeof MediaRecorder === "undefined" || player.clock.still;
  const said = film.textContent;
  let stop = null;
  film.addEventListener("click", () => {
    if (stop) return stop();
    film.textContent = "Recording: end";
    stop = record(player, name(), () => {
      film.textContent = said;
      stop = null;
    });
  });
}
