// What a report has besides the player: figures, a copy button, and a picture that lets one scroll past it.
import { element } from "./format.js";
import { Marks } from "./marks.js";
import { Plot } from "./plots.js";

const HEIGHT = 190; // px
const LANES = 5; // of names of events above the first plot of a figure, at most

/** One figure of the report: its panels, each a plot, sized with the page. */
class Chart {
  constructor(box, figure, times, onSeek, marks) {
    this.plots = figure.panels.map(({ label, note, curves }, k) => {
      const plot = new Plot(box, curves, times, onSeek, label, new Marks(marks, k === 0 ? LANES : 0));
      if (note) plot.root.append(element("figcaption", { textContent: note }));
      return plot;
    });
    this.last = null;
    new ResizeObserver(() => this.resize()).observe(box);
    this.resize();
  }

  resize() {
    for (const plot of this.plots) plot.resize(Math.max(plot.box.clientWidth, 120), HEIGHT + plot.marks.room);
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

/** Draw the figures of a report into their places; a page without a report has none. */
export function drawFigures(recording, onSeek) {
  return [...document.querySelectorAll("[data-figure]")].flatMap((box) => {
    const figure = recording.figures.find(({ name }) => name === box.dataset.figure);
    return figure ? [new Chart(box, figure, recording.t, onSeek, recording.marks)] : [];
  });
}

/** Copy a text, also where the browser gives no clipboard to a file. */
async function copy(source) {
  try {
    await navigator.clipboard.writeText(source.textContent);
  } catch {
    getSelection().selectAllChildren(source);
    document.execCommand("copy");
    getSelection().removeAllRanges();
  }
}

/** Wire the copy buttons, and let the wheel scroll the page until the picture has been clicked. */
export function reportButtons(stage) {
  for (const button of document.querySelectorAll("[data-copy]")) {
    const said = button.textContent;
    button.addEventListener("click", async () => {
      await copy(document.getElementById(button.dataset.copy));
      button.textContent = "Copied";
      setTimeout(() => (button.textContent = said), 1500);
    });
  }
  if (!document.querySelector(".report")) return;
  const { controls, element: box } = stage;
  controls.enableZoom = false;
  box.addEventListener("pointerdown", () => (controls.enableZoom = true));
  box.addEventListener("pointerleave", () => (controls.enableZoom = false));
}
