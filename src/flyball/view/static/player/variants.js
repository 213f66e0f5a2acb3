// Motions that were kept: each in a colour of its own, as a shadow in the picture and as curves in the plots.
import { Mechanism } from "./mechanism.js";
import { element } from "./format.js";

const COLOURS = ["#d14d62", "#2aa187", "#8a6fd0", "#c9a11f", "#4fb0d8", "#b0673f"];
const BELOW = 1e6; // in the painter's order of the plane
const OPACITY = 0.28;
const BACK = { polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 8 }; // behind what lies in the same place

/** A copy of a recording's motion that later changes of the recording do not reach, in one colour. */
function copied(recording, colour) {
  return {
    ...recording,
    bodies: recording.bodies
      .filter(({ name }) => name !== "ground")
      .map((body) => ({ ...body, color: colour, opacity: OPACITY, p: body.p.slice(), q: body.q.slice() })),
    lines: recording.lines.map((line) => ({ ...line, points: line.points.map((p) => p.slice()) })),
    channels: recording.channels.map((channel) => ({ ...channel })),
    ...{ joints: [], arrows: [], contacts: null, frames: [], sets: [], paths: [], curves: [] },
  };
}

/** Let everything of a mechanism show as a shadow behind the present one. */
function fade(mechanism, colour) {
  mechanism.root.traverse((object) => {
    object.renderOrder -= BELOW;
    object.castShadow = object.receiveShadow = false;
    if (object.material) {
      Object.assign(object.material, { transparent: true, opacity: OPACITY, depthWrite: false, ...BACK });
      object.material.color?.set(colour);
    }
  });
  for (const { shade } of mechanism.bodies) shade?.traverse(({ material }) => material && (material.visible = false));
}

export class Variants {
  /** Other motions beside the player's, listed in a box: kept ones that can be dropped, or given ones to show or hide. */
  constructor(player, box) {
    Object.assign(this, { player, box, kept: [] });
  }

  /** Keep the motion on the page under a label. */
  keep(label) {
    if (this.kept.length === COLOURS.length) this.drop(this.kept[0]);
    const variant = this.#add(label, this.player.recording);
    const close = element("button", { type: "button", textContent: "×", title: `Drop ${label}`, aria: { label: `Drop ${label}` } });
    close.addEventListener("click", () => this.drop(variant));
    variant.row.append(close);
    this.changed();
  }

  /** Show another recording under a label; a click on it hides it. Returns its colour. */
  give(label, recording) {
    const variant = this.#add(label, recording);
    const { row } = variant;
    Object.assign(row, { role: "button", tabIndex: 0, title: `Show or hide ${label}` });
    row.setAttribute("aria-pressed", "true");
    const toggle = () => {
      variant.hidden = !variant.hidden;
      row.setAttribute("aria-pressed", String(!variant.hidden));
      variant.mechanism.root.visible = !variant.hidden;
      this.changed();
    };
    row.addEventListener("click", toggle);
    row.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      event.stopPropagation();
      toggle();
    });
    return variant.colour;
  }

  #add(label, from) {
    const { player, kept } = this;
    const colour = COLOURS.find((one) => kept.every((other) => other.colour !== one));
    const recording = copied(from, colour);
    const { unit, extent } = player.measures;
    const mechanism = new Mechanism(recording, unit, extent);
    mechanism.retheme(player.theme);
    fade(mechanism, colour);
    player.picture.stage.scene.add(mechanism.root);
    const swatch = element("span", { className: "swatch" });
    swatch.style.background = colour;
    const name = element("span", { className: "name", textContent: label, title: label });
    const variant = { label, colour, recording, mechanism, hidden: false, row: element("li", {}, swatch, name) };
    this.box.append(variant.row);
    kept.push(variant);
    return variant;
  }

  drop(variant) {
    this.kept = this.kept.filter((other) => other !== variant);
    variant.row.remove();
    variant.mechanism.root.removeFromParent();
    variant.mechanism.dispose();
    this.changed();
  }

  /** Draw the curves of the motions that are shown. */
  changed() {
    const { plots, clock } = this.player;
    plots.overlay(
      this.kept
        .filter(({ hidden }) => !hidden)
        .map(({ label, colour, recording }) => ({
          label,
          colour,
          times: recording.t,
          values: new Map(recording.channels.map(({ name, unit, values }) => [`${name} ${unit}`, values])),
        })),
    );
    this.seek(clock.time);
  }

  /** Put the shadows where they are at a time. */
  seek(time) {
    for (const { mechanism } of this.kept) mechanism.seek(time);
    this.player.picture.stage.dirty = true;
  }
}
