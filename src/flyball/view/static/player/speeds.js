// How fast a motion is played: a list about the speed that suits it, and any other that is typed.
import { element } from "./format.js";

const FACTORS = [1, 2, 5];
const [SLOWEST, FASTEST] = [1e-9, 1e9];
const ALWAYS = [0.1, 0.2, 0.5, 1, 2, 5, 10];
const TYPE = "type";

/** A speed relative to real time: how it is written, and read. */
export const REAL_TIME = {
  write(speed) {
    if (speed === 1) return "real time";
    const number = (x) => String(Number(x.toPrecision(6)));
    return speed < 1 ? `1/${number(1 / speed)} of real time` : `${number(speed)} × real time`;
  },
  read(text) {
    const parts = /^\s*([\d.e+-]+)\s*(?:\/\s*([\d.e+-]+))?\s*(?:[x×]|times)?\s*(?:(?:of )?real time)?\s*$/i.exec(text);
    if (!parts) return /^\s*real time\s*$/i.test(text) ? 1 : NaN;
    return Number(parts[1]) / Number(parts[2] ?? 1);
  },
  hint: "1/100, 0.01, 2, real time",
};

/** 1, 2, 5 times powers of ten from a tenth of a speed to ten times it. */
function around(speed) {
  const power = Math.floor(Math.log10(speed));
  const all = [-1, 0, 1].flatMap((k) => FACTORS.map((factor) => Number(`${factor}e${power + k}`)));
  return all.filter((x) => x >= 0.099 * speed && x <= 10.1 * speed);
}

export class SpeedChoice {
  /** A list, and a field that takes its place to type any speed. */
  constructor(list, field, clock) {
    Object.assign(this, { list, field, clock, words: REAL_TIME, usual: clock.speed, typed: [] });
    list.addEventListener("change", () => (list.value === TYPE ? this.#ask() : this.set(Number(list.value))));
    field.addEventListener("change", () => this.#read());
    field.addEventListener("blur", () => this.#close());
    field.addEventListener("keydown", ({ key }) => key === "Escape" && this.#close());
    this.#fill();
  }

  /** Say speeds in other words. */
  describe(words) {
    this.words = words;
    this.#fill();
  }

  set(speed) {
    this.clock.speed = speed;
    if (!this.#speeds().includes(speed)) this.typed.push(speed);
    this.#fill();
    this.list.dispatchEvent(new CustomEvent("speed", { bubbles: true, detail: speed }));
  }

  /** The next slower or faster one of the list. */
  change(by) {
    const all = this.#speeds();
    this.set(all[Math.min(Math.max(all.indexOf(this.clock.speed) + by, 0), all.length - 1)]);
  }

  #speeds() {
    return [...new Set([...ALWAYS, ...around(this.usual), this.usual, ...this.typed])].sort((a, b) => a - b);
  }

  #fill() {
    const { list, words } = this;
    const options = this.#speeds().map((x) => element("option", { value: String(x), textContent: words.write(x) }));
    list.replaceChildren(...options, element("option", { value: TYPE, textContent: "type a speed…" }));
    list.value = String(this.clock.speed);
  }

  #ask() {
    const { list, field, words, clock } = this;
    Object.assign(field, { hidden: false, value: words.write(clock.speed), title: words.hint });
    list.hidden = true;
    field.setCustomValidity("");
    field.focus();
    field.select();
  }

  #read() {
    const { field, words } = this;
    const speed = words.read(field.value);
    const good = speed >= SLOWEST && speed <= FASTEST;
    field.setCustomValidity(good ? "" : `Write a speed such as ${words.hint}.`);
    if (!good) return field.reportValidity();
    this.set(speed);
    this.#close();
  }

  #close() {
    if (this.list.hidden && this.field.checkValidity()) {
      Object.assign(this.list, { hidden: false });
      this.field.hidden = true;
      this.#fill();
    }
  }
}
