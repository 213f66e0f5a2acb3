// Modes to choose from: the clock goes round within the chosen one.
import { element, shortNumber } from "./format.js";
import { Swing } from "./swing.js";

const cell = (textContent, className = "") => element("td", { textContent, className });

/** Frequency and what kind of motion it is, in words. */
function described({ name, kind, frequency, omega, damping_ratio: ratio }) {
  const size = `|eigenvalue| ${shortNumber(omega)} rad/s`;
  if (kind === "rigid") return [`Mode ${name}: rigid`, "moves without any resistance"];
  const grows = kind === "unstable" ? "unstable: it grows" : "it dies away";
  if (!frequency) return [`Mode ${name}: no oscillation`, `${grows}; ${size}. Shown going out and back.`];
  const what = kind === "unstable" ? "unstable: it grows" : ratio > 0 ? "damped" : "undamped";
  return [`Mode ${name}: ${shortNumber(frequency)} Hz`, `${what}; ${size}. Shown without damping.`];
}

export class Modes {
  /** The list in its box; choosing sets the clock, `onSwing` is called after the amplitude has changed. */
  constructor(box, recording, clock, keys, onSwing) {
    const { modes } = recording;
    Object.assign(this, { box, modes, clock, chosen: 0, swing: new Swing(recording) });
    box.hidden = false;
    document.body.classList.add("has-modes");
    this.rows = modes.map((mode, k) => this.#row(mode, k));
    box.querySelector("tbody").append(...this.rows);
    this.amplitude = box.querySelector("[name=amplitude]");
    this.amplitude.addEventListener("input", () => {
      this.#done();
      this.swing.set(Number(this.amplitude.value));
      onSwing();
    });
    this.#done();
    keys.add("ArrowUp", "", () => this.choose(Math.max(this.chosen - 1, 0)));
    keys.add("ArrowDown", "the mode before or after", () => this.choose(this.chosen + 1), "↑ ↓");
  }

  #done() {
    const { value, max } = this.amplitude;
    this.amplitude.style.setProperty("--done", `${(100 * value) / max}%`);
  }

  #row(mode, k) {
    const { name, frequency, damping_ratio: ratio, kind } = mode;
    const number = element("button", { type: "button", textContent: name, title: `Mode ${name}` });
    const shown = kind === "rigid" ? "" : frequency ? `${shortNumber(frequency)} Hz` : "–";
    const row = element(
      ...["tr", { className: kind }, element("td", {}, number)],
      ...[cell(shown, "value"), cell(kind === "rigid" ? "" : shortNumber(ratio), "value"), cell(kind, "kind")],
    );
    row.addEventListener("click", () => this.choose(k));
    return row;
  }

  /** The chosen mode's name. */
  get name() {
    return this.modes[this.chosen].name;
  }

  /** Show the mode of a name; the first one if there is none. */
  open(name) {
    this.choose(
      Math.max(
        this.modes.findIndex((mode) => mode.name === name),
        0,
      ),
    );
  }

  /** Show a mode; one that is not there changes nothing. */
  choose(k) {
    const mode = this.modes[k];
    if (!mode) return;
    this.chosen = k;
    this.rows.forEach((row, i) => {
      row.classList.toggle("chosen", i === k);
      row.querySelector("button").setAttribute("aria-pressed", String(i === k));
    });
    this.rows[k].scrollIntoView({ block: "nearest" });
    const [title, text] = described(mode);
    this.box.querySelector("h2").textContent = title;
    this.box.querySelector("p").textContent = text;
    const lines = mode.shape.map(([what, unit, size, phase]) =>
      element(
        ...["tr", {}, cell(what), cell(shortNumber(size), "value"), cell(unit, "unit")],
        cell(`${(Math.round(phase) + 360) % 360}°`, "value"),
      ),
    );
    this.box.querySelector(".shape tbody").replaceChildren(...lines);
    const { begin, end, frequency } = mode;
    this.clock.within(begin, end, frequency ? 1 / (frequency * (end - begin)) : 0);
  }
}

/** Speeds in words that fit periods: how they are written, and read. */
export function periodWords(period) {
  return {
    write: (speed) => `${Number((period / speed).toPrecision(2))} s/period`,
    read: (text) => period / Number(/^\s*([\d.e+-]+)\s*(s|s\/period)?\s*$/i.exec(text)?.[1] ?? NaN),
    hint: "seconds for a period",
  };
}
