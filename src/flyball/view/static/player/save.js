// Taking away what the page shows: the picture (PNG, SVG), the plots (SVG), the animation (GIF, MP4 or WebM).
import { Copy, drawGif, recordVideo, videoFormat } from "./film.js";
import { CURVES } from "./theme.js";
import { vectorPicture } from "./vector.js";

const NS = "http://www.w3.org/2000/svg";
const HEAD = 22; // px above a plot, for its names

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function download(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

/** Draw the picture as it is now. */
function drawNow(stage) {
  stage.dirty = true;
  stage.draw(performance.now());
}

function savePicture({ stage }, name) {
  const copy = new Copy(stage, css("--stage-b"));
  drawNow(stage);
  copy.take();
  copy.canvas.toBlob((blob) => download(blob, `${name}.png`), "image/png");
}

function saveScene({ stage }, name) {
  drawNow(stage);
  download(new Blob([vectorPicture(stage, css("--stage-b"))], { type: "image/svg+xml" }), `${name}.svg`);
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
  download(new Blob([new XMLSerializer().serializeToString(root)], { type: "image/svg+xml" }), `${name}-plots.svg`);
}

/** A button that makes a file of the animation: pressed again it ends it early. */
function filmButton(button, make) {
  const said = button.textContent;
  let stop = null;
  button.addEventListener("click", () => {
    if (stop) return stop();
    button.textContent = "Recording: end";
    stop = make(() => {
      button.textContent = said;
      stop = null;
    });
  });
}

/** The buttons that save something; `player` is the page's. */
export function saveButtons(box, player) {
  const name = () => player.recording.name.replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-|-$/g, "") || "motion";
  const button = (what) => box.querySelector(`[name=save-${what}]`);
  const [video, gif, format] = [button("video"), button("gif"), videoFormat()];
  button("png").addEventListener("click", () => savePicture(player.picture, name()));
  button("scene").addEventListener("click", () => saveScene(player.picture, name()));
  button("svg").addEventListener("click", () => player.plots.plots.length && savePlots(player.plots, name()));
  const drawn = Boolean(player.picture.stage.renderer);
  button("png").disabled = !drawn;
  for (const one of [video, gif]) one.disabled = !drawn || player.clock.still;
  video.disabled ||= !format;
  const ending = format?.ending ?? "webm";
  video.textContent = `Animation (${{ mp4: "MP4", webm: "WebM" }[ending]})`;
  const done = (kind, onEnd) => (blob) => {
    download(blob, `${name()}.${kind}`);
    onEnd();
  };
  filmButton(video, (onEnd) => recordVideo(player, css("--stage-b"), format, done(ending, onEnd)));
  filmButton(gif, (onEnd) => drawGif(player, css("--stage-b"), done("gif", onEnd)));
}
