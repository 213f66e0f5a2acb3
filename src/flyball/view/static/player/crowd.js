// Many bodies of one shape: one instanced mesh for each of its shapes, poses unpacked picture by picture.
import * as THREE from "three";
import { crowdShapes, fade } from "./crowdshapes.js";
import { turnsAt, unpacked } from "./packed.js";

const SPREAD = { hue: 0.018, light: 0.055 }; // by which members of one colour differ
const GLOW = 0.45; // towards white

/** A number from 0 to 1 that looks like chance and is always the same. */
function scattered(k) {
  const s = Math.sin(12.9898 * (k + 1)) * 43758.5453;
  return s - Math.floor(s);
}

export class Crowd {
  /** The members of a recorded set; `order` is its place in the painter's order of the plane. */
  constructor(data, colour, { planar, unit, order }) {
    const { name, count } = data;
    Object.assign(this, { name, count, data, planar, colour: data.colors[0] ?? colour, shown: true, category: "set" });
    unpacked(data);
    this.pictures = new Map(); // picture -> orientations, of the two in use
    this.root = new THREE.Group();
    this.members = new Map();
    const { meshes, retheme } = crowdShapes(data, count, { planar, unit, order });
    this.meshes = meshes;
    this.retheme = retheme;
    this.matrices = meshes[0].instanceMatrix;
    this.matrices.setUsage(THREE.DynamicDrawUsage);
    for (const mesh of meshes) {
      mesh.instanceMatrix = this.matrices; // one for all
      mesh.userData.crowd = this;
      this.root.add(mesh);
    }
    this.#paint();
  }

  #paint() {
    const { colors } = this.data;
    this.colours = Array.from({ length: this.count }, (_, k) => {
      if (colors.length > 1) return new THREE.Color(colors[k % colors.length]);
      const [h, l] = [scattered(k) - 0.5, scattered(k + 0.37) - 0.5];
      return new THREE.Color(this.colour).offsetHSL(2 * SPREAD.hue * h, 0, 2 * SPREAD.light * l);
    });
    for (const mesh of this.meshes.filter(({ userData }) => userData.coloured))
      this.colours.forEach((colour, k) => mesh.setColorAt(k, colour));
  }

  /** Orientations at a picture: x, y, z, w of each member. */
  #turns(picture) {
    const known = this.pictures.get(picture);
    if (known) return known;
    const { count, data } = this;
    const spare = this.pictures.size > 1 ? this.pictures.keys().next().value : null;
    const out = spare === null ? new Float32Array(4 * count) : this.pictures.get(spare);
    if (spare !== null) this.pictures.delete(spare);
    this.pictures.set(picture, out);
    return turnsAt(data, picture, out);
  }

  /** Put every member where it is; between pictures straight on, turned the shorter way. */
  seek({ i, j, f }) {
    const { count, data } = this;
    const { grid } = data;
    const [a, b] = [this.#turns(i), this.#turns(j)];
    const out = this.matrices.array;
    const { step, low, scale } = data;
    const far = 3 * count * (j - i);
    for (let k = 0, at = 3 * count * i; k < count; k++, at++) {
      const o = 16 * k;
      const here = grid[at] && grid[at + far] ? (scale ? scale[k] : 1) : 0; // 0 in x: nowhere
      const along = (c) => grid[at + c] + f * (grid[at + c + far] - grid[at + c]);
      const q = 4 * k;
      const dot = a[q] * b[q] + a[q + 1] * b[q + 1] + a[q + 2] * b[q + 2] + a[q + 3] * b[q + 3];
      const g = dot < 0 ? -f : f;
      let x = (1 - f) * a[q] + g * b[q];
      let y = (1 - f) * a[q + 1] + g * b[q + 1];
      let z = (1 - f) * a[q + 2] + g * b[q + 2];
      let w = (1 - f) * a[q + 3] + g * b[q + 3];
      const size = Math.sqrt(x * x + y * y + z * z + w * w);
      x /= size;
      y /= size;
      z /= size;
      w /= size;
      out[o] = here * (1 - 2 * (y * y + z * z));
      out[o + 1] = here * 2 * (x * y + w * z);
      out[o + 2] = here * 2 * (x * z - w * y);
      out[o + 4] = here * 2 * (x * y - w * z);
      out[o + 5] = here * (1 - 2 * (x * x + z * z));
      out[o + 6] = here * 2 * (y * z + w * x);
      out[o + 8] = here * 2 * (x * z + w * y);
      out[o + 9] = here * 2 * (y * z - w * x);
      out[o + 10] = here * (1 - 2 * (x * x + y * y));
      out[o + 12] = low[0] + step * along(0);
      out[o + 13] = low[1] + step * along(count);
      out[o + 14] = low[2] + step * along(2 * count);
      out[o + 15] = 1;
    }
    this.matrices.needsUpdate = true;
    for (const mesh of this.meshes) mesh.boundingSphere = null; // found afresh when something is pointed at
    for (const [k, { group }] of this.members) this.#pose(k, group);
  }

  #pose(k, group) {
    const matrix = new THREE.Matrix4().fromArray(this.matrices.array, 16 * k);
    matrix.decompose(group.position, group.quaternion, new THREE.Vector3());
  }

  /** Pictures have been added or replaced. */
  extended() {
    this.pictures.clear();
  }

  /** One member as a part that can be selected and followed. */
  member(k) {
    if (!this.members.has(k)) {
      const group = new THREE.Group();
      this.#pose(k, group);
      const glow = (on) => this.#glow(k, on);
      const name = this.data.names[k] ?? `${this.name}[${k}]`;
      this.members.set(k, { name, category: "body", group, glow, colour: this.colour });
    }
    return this.members.get(k);
  }

  /** The member of a name such as "balls[17]", or null. */
  named(name) {
    if (this.data.names.length) {
      this.numbers ??= new Map(this.data.names.map((own, k) => [own, k]));
      return this.numbers.has(name) ? this.member(this.numbers.get(name)) : null;
    }
    if (!name.startsWith(`${this.name}[`) || !name.endsWith("]")) return null;
    const k = Number(name.slice(this.name.length + 1, -1));
    return Number.isInteger(k) && k >= 0 && k < this.count ? this.member(k) : null;
  }

  #glow(k, on) {
    const colour = this.colours[k].clone();
    if (on) colour.lerp(new THREE.Color("#ffffff"), GLOW);
    for (const mesh of this.meshes.filter(({ userData }) => userData.coloured)) {
      mesh.setColorAt(k, colour);
      mesh.instanceColor.needsUpdate = true;
    }
  }

  /** Let contact forces inside show through. */
  fade(on) {
    if (!this.planar) fade(this.meshes, on);
  }

  show(on) {
    this.root.visible = on;
  }

  /** Position and scalar-first orientation of every member, as set. */
  poses() {
    return Array.from({ length: this.count }, (_, k) => {
      const { position: p, quaternion: q } = this.member(k).group;
      return [p.x, p.y, p.z, q.w, q.x, q.y, q.z];
    });
  }
}
