// The live page: sliders, stepping and dragging; a session computes, and this shows what it sends.
import { readRecording } from "./data.js";
import { element, shortNumber } from "./format.js";
import { Grip } from "./grip.js";
import { Player } from "./main.js";
import { connect } from "./transport.js";
import { Variants } from "./variants.js";

const ANSWER_TIMEOUT = 250; // ms after which a new value is sent though the last was not answered
const DIGITS = 6;
const find = (selector) => document.querySelector(`.live ${selector}`);

/** One parameter: a slider, a field for any value, and its unit. */
class Parameter {
  constructor({ name, unit, value, low, high, chosen }, onChange) {
    const step = (high - low) / 400;
    this.range = element("input", { type: "range", min: low, max: high, step, aria: { label: name } });
    this.field = element("input", { type: "number", step: "any", aria: { label: `Value of ${name}` } });
    const title = chosen ? `${name}: from ${shortNumber(low)} to ${shortNumber(high)} ${unit}, a range chosen about the value` : name;
    this.row = element(
      "label",
      { className: "parameter", title },
      element("span", { className: "name", textContent: `${name}${chosen ? " *" : ""}` }),
      this.range,
      this.field,
      element("span", { className: "unit", textContent: unit }),
    );
    this.name = name;
    this.range.addEventListener("input", () => onChange(name, this.#show(Number(this.range.value))));
    this.field.addEventListener("change", () => {
      const typed = this.field.valueAsNumber;
      if (Number.isFinite(typed)) onChange(name, this.#show(typed));
      else this.#show(this.value);
    });
    this.#show(value);
  }

  #show(value) {
    this.value = value;
    const { range, field } = this;
    range.value = value;
    field.value = Number(value.toPrecision(DIGITS));
    range.style.setProperty("--done", `${(100 * (range.value - range.min)) / (range.max - range.min)}%`);
    return value;
  }
}

class Live {
  constructor() {
    Object.assign(this, { player: null, parameters: [], stepping: false, values: {}, sent: -Infinity, latest: null, timer: null, runs: 0, pictures: 0 });
    this.send = connect(
      (message) => this.#receive(message),
      (text) => this.#end(text),
    );
    find("[name=run-live]").addEventListener("click", () => this.step(!this.stepping));
    find("[name=step-live]").addEventListener("click", () => this.#single());
    find("[name=reset-live]").addEventListener("click", () => this.reset());
    find("[name=keep-live]").addEventListener("click", () => this.keep());
    document.addEventListener("speed", ({ detail }) => this.send({ do: "speed", value: detail }));
  }

  // ---- messages of the session

  #receive(message) {
    const recording = message.recording && readRecording(message.recording);
    const handlers = {
      model: () => this.#describe(message),
      busy: () => this.#busy(message),
      run: () => this.#run(message, recording),
      motion: () => this.#motion(message, recording),
      stepping: () => this.#say(this.stepping ? "stepping" : "stepped"),
      error: () => this.#fault(message.text),
    };
    handlers[message.kind]();
    requestAnimationFrame(() => {
      if (message.kind === "motion") this.send({ do: "shown" });
      this.sent = -Infinity;
      this.#sendLatest();
    });
  }

  #describe({ name, planar, sliders, movable, picture }) {
    if (this.player && this.player.recording.planar !== planar) return location.reload();
    document.querySelector(".player h1").textContent = document.title = name;
    this.movable = new Set(movable);
    if (!this.player) document.querySelector(".waiting").innerHTML = picture; // of the model, as flyball drew it
    this.parameters = sliders.map((slider) => new Parameter(slider, (what, value) => this.set(what, value)));
    find(".parameters").replaceChildren(...this.parameters.map(({ row }) => row));
    const chosen = sliders.some((slider) => slider.chosen);
    find(".hint").textContent = [
      chosen ? "* No range was given: half to twice the value, or −1 to 1 about zero." : "",
      "Drag a body: its joints follow; while it is stepped, a spring pulls it.",
    ].join(" ");
    this.#following(false);
  }

  #run({ values, seconds, slow }, recording) {
    Object.assign(this, { values, runs: this.runs + 1, pictures: 0 });
    this.#fault("");
    this.#slow(slow);
    const span = recording.t.at(-1) - recording.t[0];
    this.#say(`${shortNumber(span)} s computed in ${Number(seconds.toPrecision(2))} s`);
    if (this.player) this.player.replace(recording);
    else this.#begin(recording);
  }

  /** Say how far a run is; of what is slow, the remark stays until another one is known. */
  #busy({ text, slow }) {
    this.#say(text);
    if (slow) this.#slow(slow);
  }

  #begin(recording) {
    document.querySelector(".waiting").replaceChildren();
    this.player = new Player(recording);
    this.variants = new Variants(this.player, find(".variants"));
    this.player.onUpdate = (time) => this.variants.seek(time);
    this.grip = new Grip(
      this.player.picture,
      (pull) => this.#pull(pull),
      () => this.#release(),
      (body) => this.movable.has(body),
    );
    this.send({ do: "speed", value: this.player.clock.speed });
    this.player.clock.onPlay = () => this.stepping && this.step(false);
    window.flyball.live = this;
  }

  #motion({ restart, slow, closure }, chunk) {
    this.player.extend(chunk, restart);
    this.pictures += 1; // since the last run
    this.closure = closure ?? null;
    this.#slow(slow);
    if (closure === undefined) this.#say(`${this.stepping ? "stepping" : "stepped"}, ${shortNumber(chunk.t.at(-1))} s`);
    else this.#say("dragged: joints closed, drivers switched off");
    if (closure !== undefined) this.#fault("");
    this.grip.draw();
    if (this.stepping) this.grip.pull();
  }

  #say(text) {
    find(".live-status").textContent = text;
  }

  #slow(text) {
    find(".slow").textContent = text;
    find(".slow").hidden = !text;
  }

  #fault(text) {
    find(".fault").textContent = text;
    find(".fault").hidden = !text;
    if (!text) return;
    this.#following(false);
    this.#say("");
    if (!this.player) document.body.dataset.ready ??= "";
  }

  #end(text) {
    this.#fault(text);
    document.body.classList.add("ended");
  }

  // ---- what the user asks for

  set(name, value) {
    this.#queue(`set ${name}`, { do: "set", name, value });
  }

  step(on) {
    if (on) this.#fault("");
    this.#following(on);
    this.send({ do: on ? "start" : "pause" });
  }

  #single() {
    this.#fault("");
    this.#following(false);
    this.send({ do: "step" });
  }

  reset() {
    this.#fault("");
    this.#following(false);
    this.send({ do: "reset" });
  }

  /** Keep the motion on the page in a colour, labelled by its parameters: the present ones once it was stepped. */
  keep() {
    if (!this.player) return;
    const label = this.parameters.map(({ name, value, row }) => {
      const unit = row.querySelector(".unit").textContent;
      const own = this.pictures ? value : (this.values[name] ?? value);
      return `${name} ${Number(own.toPrecision(4))}${unit && ` ${unit}`}`;
    });
    this.variants.keep(label.join(", ") || `motion ${this.runs}`);
  }

  #following(on) {
    this.stepping = on;
    const button = find("[name=run-live]");
    button.textContent = on ? "Pause" : "Start";
    button.classList.toggle("on", on);
  }

  #pull({ body, at, to }) {
    const by = this.stepping ? "force" : "assembly";
    this.#queue("drag", { do: "drag", body, at, to, by, t: this.player.clock.time });
  }

  #release() {
    this.latest?.delete("drag");
    this.send({ do: "release" });
  }

  /** Send the newest of each kind after the answer to the last, or after a while without one. */
  #queue(kind, message) {
    (this.latest ??= new Map()).set(kind, message);
    const rest = this.sent + ANSWER_TIMEOUT - performance.now();
    if (!(rest > 0)) this.#sendLatest();
    else this.timer ??= setTimeout(() => this.#sendLatest(), rest);
  }

  #sendLatest() {
    clearTimeout(this.timer);
    this.timer = null;
    if (!this.latest?.size) return;
    for (const message of this.latest.values()) this.send(message);
    this.latest.clear();
    this.sent = performance.now();
  }
}

/** Start the page; it has no recording of its own. */
export function start() {
  return new Live();
}
