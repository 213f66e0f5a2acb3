// Forces and moments as arrows, to a common scale; moments have two heads, in the plane they are arcs.
import * as THREE from "three";
import { pointAt, sampleNumbers } from "./data.js";
import { ORDER } from "./flats.js";
import { aim } from "./lines.js";
import { Look } from "./look.js";
import { Touches } from "./touches.js";

const SLIM = 0.008; // radius of an arrow over typical length
const LONGEST = 0.2; // length of the largest arrow, as part of the motion's extent
const SWEEP = 1.4 * Math.PI; // of the largest moment in the plane
const ARC = 0.12; // radius of such an arc over typical length
const LEAST = 0.03; // the lever, over typical length, on which the largest force makes a moment worth a long arrow
const SHORTEST = 0.012; // arrows shorter than this, over typical length, are left out
const USUALLY = 0.99; // part of the times at which the largest arrow is not longer than that

export const GROUPS = {
  reaction: "Joint reactions",
  element: "Springs, motors, drivers",
  load: "Given loads",
  stick: "Contacts that stick",
  slip: "Contacts that slip",
};

/** The least of 1, 1.5, 2, 3, 5, 7 times a power of ten that is not below a number. */
export function niceAbove(number) {
  const power = 10 ** Math.floor(Math.log10(number));
  return [1, 1.5, 2, 3, 5, 7, 10].find((digit) => digit * power >= number * (1 - 1e-9)) * power;
}

/** Sizes of a vector over the motion: what it usually stays below, and its largest. */
function sizes(vector) {
  const v = new THREE.Vector3();
  const all = sampleNumbers(vector.length / 3, 4000)
    .map((i) => pointAt(vector, { i, j: i, f: 0 }, v).length())
    .filter(Number.isFinite)
    .sort((a, b) => a - b);
  return { usual: all[Math.floor(USUALLY * (all.length - 1))] ?? 0, peak: all.at(-1) ?? 0 };
}

export class Arrows {
  /** All arrows of a recording; `extent` is that of the motion, `place` says where something on a body is. */
  constructor(recording, unit, extent, place) {
    Object.assign(this, { unit, extent, place, planar: recording.planar, factor: 1, frame: { i: 0, j: 0, f: 0 } });
    this.root = new THREE.Group();
    this.shown = { reaction: false, element: false, load: false, contact: false, moments: false };
    this.items = recording.arrows.map((data, k) => this.#build(data, k));
    this.touches = recording.contacts ? new Touches(recording.contacts, 0.75 * SLIM * unit, recording.planar) : null;
    if (this.touches) this.root.add(this.touches.root);
    this.rescale();
  }

  #build(data, index) {
    const look = new Look(this.planar, this.unit, ORDER.arrow + 6 * index);
    const group = new THREE.Group();
    const bent = this.planar && data.what === "moment";
    const radius = SLIM * this.unit;
    const set = bent
      ? look.arc(group, ARC * this.unit, radius, data.group)
      : look.arrow(group, radius, data.group, data.what === "moment" ? 2 : 1);
    this.root.add(group);
    return { data, look, group, set, bent, ...sizes(data.vector), length: 0 };
  }

  isOn({ data: { group, what } }) {
    return this.shown[group] && (what === "force" || this.shown.moments);
  }

  /** Switch a group of arrows, or moments, on or off. */
  show(name, on) {
    this.shown[name] = on;
    if (this.touches && name === "contact") this.touches.on = on;
    this.rescale();
  }

  /** Choose lengths so that the largest arrow on show has a good one, and a round number of newtons makes a metre. */
  rescale(factor = this.factor) {
    this.factor = factor;
    const largest = (what) =>
      this.items.filter((item) => this.isOn(item) && item.data.what === what).reduce((m, a) => Math.max(m, a.usual), 0);
    const touching = this.touches?.on ? this.touches.usual : 0;
    const [force, moment] = [Math.max(largest("force"), touching), largest("moment")];
    const worthwhile = Math.max(moment, LEAST * force * this.unit); // a small moment beside forces stays small
    const perMetre = (reference) => (reference > 0 ? niceAbove(reference / (LONGEST * this.extent * this.factor)) : 0);
    this.perMetre = { force: perMetre(force), moment: perMetre(moment && worthwhile) };
    this.perRadian = (moment && worthwhile) / (SWEEP * Math.min(this.factor, 1));
    this.seek(this.frame);
  }

  seek(frame) {
    this.frame = frame;
    const v = new THREE.Vector3();
    this.touches?.seek(frame, this.perMetre.force, SHORTEST * this.unit);
    for (const item of this.items) {
      const { data, group, bent } = item;
      const size = pointAt(data.vector, frame, v).length();
      const scale = bent ? this.perRadian / (ARC * this.unit) : this.perMetre[data.what];
      item.length = scale > 0 ? size / scale : 0;
      group.visible = this.isOn(item) && item.length > SHORTEST * this.unit;
      if (!group.visible) continue;
      this.place(data, group.position);
      if (bent) item.set(v.z / this.perRadian);
      else {
        aim(group, v.divideScalar(size), this.planar);
        item.set(item.length);
      }
    }
  }

  /** What a legend says: of each group on show its largest force and moment, and the scales. */
  legend() {
    const on = this.items.filter((item) => this.isOn(item));
    const peak = (group, what) =>
      on.filter(({ data }) => data.group === group && data.what === what).reduce((m, a) => Math.max(m, a.peak), 0);
    const groups = Object.keys(GROUPS)
      .filter((group) => on.some(({ data }) => data.group === group))
      .map((group) => ({ group, force: peak(group, "force"), moment: peak(group, "moment") }));
    for (const [group, force] of this.touches?.on ? this.touches.peaks() : []) groups.push({ group, force, moment: 0 });
    return { groups, perMetre: this.perMetre };
  }

  /** The arrows on show as numbers: what and where they are, and the vectors they stand for. */
  list() {
    const v = new THREE.Vector3();
    return this.items
      .filter(({ group }) => group.visible)
      .map(({ data, length }) => ({
        ...{ name: data.name, group: data.group, what: data.what, length },
        at: this.place(data, v).toArray(),
        vector: pointAt(data.vector, this.frame, v).toArray(),
      }));
  }

  retheme(theme) {
    for (const { look } of this.items) look.retheme(theme);
    this.touches?.retheme(theme);
    this.seek(this.frame);
  }
}
