// What is switched on in the picture: the menu, the legend of forces, and one place that knows the state.
import { GROUPS } from "./arrows.js";
import { element, lengthText, shortNumber } from "./format.js";

const ARROWS = { reactions: "reaction", elements: "element", loads: "load", contacts: "contact", moments: "moments" };
export const LABELS = {
  reactions: "Joint reactions",
  elements: "Springs, motors, drivers",
  loads: "Given loads",
  contacts: "Contact forces",
  moments: "with moments",
  world: "World axes",
  bodies: "Body axes",
  frames: "Joint axes and frames",
  names: "Names",
  grid: "Grid",
};

export class Shown {
  /** Switches in a menu; `targets` are the mechanism, the stage and the names, `onChange` is called after a switch. */
  constructor(menu, legend, targets, onChange) {
    Object.assign(this, { menu, legend, targets, onChange, state: {}, factor: 1 });
    this.size = menu.querySelector("[name=arrow-size]");
    this.size.addEventListener("input", () => this.scale(10 ** Number(this.size.value)));
    this.build();
  }

  /** The switches for what the mechanism has; all are off. */
  build() {
    const { menu, targets } = this;
    for (const box of menu.querySelectorAll("label:has([type=checkbox])")) box.remove();
    this.state = {};
    const present = new Set(targets.mechanism.recording.arrows.map(({ group }) => `${group}s`));
    if (targets.mechanism.arrows.touches) present.add("contacts");
    const moments = targets.mechanism.recording.arrows.some(({ what }) => what === "moment");
    const useful = (name) => (ARROWS[name] ? (name === "moments" ? moments : present.has(name)) : true);
    this.names = Object.keys(LABELS).filter(useful);
    this.boxes = {};
    for (const name of this.names) {
      const box = element("input", { type: "checkbox", name });
      box.addEventListener("change", () => this.set(name, box.checked));
      this.boxes[name] = box;
      const home = ARROWS[name] ? ".forces-part" : ".axes-part";
      menu.querySelector(home).append(element("label", {}, box, ` ${LABELS[name]}`));
    }
    menu.querySelector(".forces-part").hidden = !this.names.some((name) => ARROWS[name]);
  }

  set(name, on) {
    const { mechanism, stage, names } = this.targets;
    if (!this.names.includes(name)) return;
    this.state[name] = on;
    this.boxes[name].checked = on;
    if (name === "contacts") for (const crowd of mechanism.crowds) crowd.fade(on);
    if (ARROWS[name]) mechanism.arrows.show(ARROWS[name], on);
    else if (name === "grid") stage.grid.visible = on;
    else if (name === "names") names.show(on);
    else mechanism.triads.show(name, on);
    this.#explain();
    this.onChange();
  }

  toggle(name) {
    this.set(name, !this.state[name]);
  }

  /** Make arrows longer or shorter. */
  scale(factor) {
    this.factor = factor;
    this.targets.mechanism.arrows.rescale(factor);
    this.size.value = Math.log10(factor);
    this.#explain();
    this.onChange();
  }

  /** The legend of forces: colours, the largest values of the run, and to what scale the arrows are. */
  #explain() {
    const { arrows } = this.targets.mechanism;
    const { groups, perMetre } = arrows.legend();
    const amount = (value, unit) => (value > 0 ? `${shortNumber(value)} ${unit}` : "");
    const rows = groups.map(({ group, force, moment }) => {
      const largest = [amount(force, "N"), amount(moment, "N m")].filter(Boolean).join(", ");
      const swatch = element("i", { className: `arrow ${group}` });
      return element(
        "li",
        {},
        swatch,
        element("span", { textContent: GROUPS[group] }),
        element("em", { textContent: `up to ${largest}` }),
      );
    });
    const metre = arrows.extent > 0 ? 10 ** Math.floor(Math.log10(arrows.extent / 2)) : 1;
    const scales = [
      perMetre.force > 0 && `${shortNumber(perMetre.force * metre)} N`,
      perMetre.moment > 0 && !arrows.planar && `${shortNumber(perMetre.moment * metre)} N m`,
    ].filter(Boolean);
    if (scales.length)
      rows.push(element("li", { className: "to-scale", textContent: `${lengthText(metre)} ≙ ${scales.join(", ")}` }));
    this.legend.querySelector("ul").replaceChildren(...rows);
    this.legend.hidden = !groups.length;
  }
}
