// Motions that were kept: each in a colour of its own, as a shadow in the picture and as curves in the plots.
import { Mechanism } from "./mechanism.js";
import { element } from "./format.js";

const COLOURS = ["#d14d62", "#2aa187", "#8a6fd0", "#c9a11f", "#4fb0d8", "#b0673f"];
const BELOW = 1e6; // in the painter's order of the plane
const OPACITY = 0.28;

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
      Object.assign(object.material, { transparent: true, opacity: OPACITY, depthWrite: false });
      object.material.color?.set(colour);
    }
  });
}

export class Variants {
  /** The kept motions of a player, listed in a box. */
  constructor(player, box) {
    Object.assign(this, { player, box, kept: [] });
  }

  /** Keep the motion on the page under a label. */
  keep(label) {
    const { player, kept } = this;
    if (kept.length === COLOURS.length) this.drop(kept[0]);
    const colour = COLOURS.find((one) => kept.every((other) => other.colour !== one));
    const recording = copied(player.recording, colour);
    const { unit, extent } = player.measures;
    const mechanism = new Mechanism(recording, unit, extent);
    mechanism.retheme(player.theme);
    fade(mechanism, colour);
    player.picture.stage.scene.add(mechanism.root);
    const swatch = element("span", { className: "swatch" });
    swatch.style.background = colour;
    const name = element("span", { className: "name", textContent: label, title: label });
    const close = element("button", { type: "button", textContent: "×", title: `Drop ${label}`, aria: { label: `Drop ${label}` } });
    const variant = { label, colour, recording, mechanism, row: element("li", {}, swatch, name, close) };
    close.addEventListener("click", () => this.drop(variant));
    this.box.append(variant.row);
    kept.push(variant);
    this.#changed();
  }

  drop(variant) {
    this.kept = this.kept.filter((other) => other !== variant);
    variant.row.remove();
    variant.mechanism.root.removeFromParent();
    variant.mechanism.dispose();
    this.#changed();
  }

  #changed() {
    const { plots, clock } = this.player;
    plots.overlay(
      this.kept.map(({ colour, recording }) => ({
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
