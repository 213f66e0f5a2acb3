// The selected part: its card with what it is and its numbers now.
import { mixed } from "./data.js";
import { element, pretty, shortNumber } from "./format.js";

const MOST = 40; // numbers on a card

/** What a body's card says where no curves of it were recorded: its position. */
function poseRows(part) {
  const { position } = part.group;
  return ["x", "y", "z"].map((axis) => ({ label: axis, unit: "m", read: () => position[axis] }));
}

/** Rows of a part's card: a label, a unit, and what reads the value at a place among the samples. */
function rowsOf(part, recording) {
  const own = recording.channels.filter(({ name }) => name.startsWith(`${part.name}.`)).slice(0, MOST);
  const rows = own.map((channel) => ({
    label: channel.name.slice(part.name.length + 1),
    unit: channel.unit,
    read: (frame) => mixed(channel.values, frame),
    channel,
  }));
  return rows.length || part.category !== "body" ? rows : poseRows(part);
}

/** The card in its box; `plots.toggle(channel)` adds a curve to the plots or takes it away. */
export class Card {
  constructor(box, recording, { onClose, onPlot, isPlotted }) {
    Object.assign(this, { box, recording, onPlot, isPlotted, part: null, rows: [] });
    box.querySelector("button").addEventListener("click", onClose);
  }

  show(part, frame) {
    this.part = part;
    this.box.hidden = !part;
    if (!part) return;
    const facts = Object.hasOwn(this.recording.facts, part.name) ? this.recording.facts[part.name] : [];
    this.box.querySelector("h2").textContent = part.name;
    this.box.querySelector("p").textContent = facts.join(", ");
    this.rows = rowsOf(part, this.recording);
    this.values = this.rows.map(() => element("td", { className: "value" }));
    const lines = this.rows.map((row, k) => {
      const name = element("th", { scope: "row", textContent: row.label });
      return element(
        "tr",
        {},
        name,
        this.values[k],
        element("td", { className: "unit", textContent: pretty(row.unit) }),
        this.#plot(row),
      );
    });
    this.box.querySelector("tbody").replaceChildren(...lines);
    this.seek(frame);
  }

  #plot({ channel, label }) {
    if (!channel) return element("td");
    const button = element("button", {
      ...{ type: "button", className: "plot-it", textContent: "plot", title: `Plot ${label}` },
      aria: { pressed: String(this.isPlotted(channel)) },
    });
    button.addEventListener("click", () => {
      this.onPlot(channel);
      button.setAttribute("aria-pressed", String(this.isPlotted(channel)));
    });
    return element("td", {}, button);
  }

  seek(frame) {
    if (!this.part) return;
    this.rows.forEach((row, k) => (this.values[k].textContent = shortNumber(row.read(frame))));
  }
}
