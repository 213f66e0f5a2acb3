// Axes of the world, of bodies, and of joints and named frames: x red, y green, z blue.
import * as THREE from "three";
import { ORDER } from "./flats.js";
import { aim } from "./lines.js";
import { Look } from "./look.js";

const TONES = ["axisX", "axisY", "axisZ"];
const DIRECTIONS = [new THREE.Vector3(1, 0, 0), new THREE.Vector3(0, 1, 0), new THREE.Vector3(0, 0, 1)];
const LENGTHS = { world: 0.3, bodies: 0.2, frames: 0.15 }; // over typical length

/** One triad; in the plane without the axes that stand out of it. */
function triad(planar, length, order) {
  const look = new Look(planar, 0.4 * length, order);
  const group = new THREE.Group();
  TONES.slice(0, planar ? 2 : 3).forEach((tone, k) => {
    const arm = new THREE.Group();
    look.arrow(arm, 0.035 * length, tone)(length);
    aim(arm, DIRECTIONS[k], planar);
    group.add(arm);
  });
  return { group, look };
}

export class Triads {
  /** Triads are built when they are first shown; `bodies` are the drawn ones. */
  constructor(recording, unit, bodies) {
    Object.assign(this, { recording, unit, bodies, theme: null, sets: {} });
    this.root = new THREE.Group();
  }

  #places(name) {
    if (name === "world") return [{ name: "world", body: "ground", position: [0, 0, 0], quaternion: [1, 0, 0, 0] }];
    if (name === "frames") return this.recording.frames;
    return this.bodies.map((body) => ({
      name: body.name,
      body: body.name,
      position: [0, 0, 0],
      quaternion: [1, 0, 0, 0],
    }));
  }

  #build(name) {
    return this.#places(name).map((place, k) => {
      const drawn = triad(this.recording.planar, LENGTHS[name] * this.unit, ORDER.arrow + 1e4 + 10 * k);
      const body = this.bodies.find((candidate) => candidate.name === place.body);
      this.root.add(drawn.group);
      if (this.theme) drawn.look.retheme(this.theme);
      return { ...drawn, ...place, body };
    });
  }

  show(name, on) {
    this.sets[name] ??= on ? this.#build(name) : [];
    if (on && !this.sets[name].length) this.sets[name] = this.#build(name);
    for (const { group } of this.sets[name]) group.visible = on;
    this.seek();
  }

  seek() {
    for (const {
      group,
      body,
      position,
      quaternion: [w, x, y, z],
    } of Object.values(this.sets).flat()) {
      group.position.set(...position);
      group.quaternion.set(x, y, z, w);
      if (!body) continue;
      group.position.applyQuaternion(body.group.quaternion).add(body.group.position);
      group.quaternion.premultiply(body.group.quaternion);
    }
  }

  /** Names and places of the triads on show. */
  list() {
    return Object.values(this.sets)
      .flat()
      .filter(({ group }) => group.visible)
      .map(({ name, group }) => ({ name, at: group.position.toArray() }));
  }

  retheme(theme) {
    this.theme = theme;
    for (const { look } of Object.values(this.sets).flat()) look.retheme(theme);
  }
}
