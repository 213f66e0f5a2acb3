// A coil spring as a bent tube: straight ends on the axis, turns between whose pitch follows the length.
import * as THREE from "three";

const SIDES = 8;
const PER_TURN = 22;
const LEAD = 3; // samples on each straight end
const TURN = 2 * Math.PI;

const smooth = (s) => {
  const u = Math.min(Math.max(s, 0), 1);
  return u * u * (3 - 2 * u);
};

export class Coil {
  /** A coil of the given number of turns, radius of the turns and of the wire. */
  constructor(turns, radius, wire) {
    Object.assign(this, { turns, radius, wire });
    this.samples = Math.round(turns * PER_TURN) + 2 * LEAD;
    const count = (this.samples + 1) * (SIDES + 1);
    this.centre = new Float32Array(3 * (this.samples + 1));
    this.geometry = new THREE.BufferGeometry();
    for (const name of ["position", "normal"]) {
      const attribute = new THREE.BufferAttribute(new Float32Array(3 * count), 3).setUsage(THREE.DynamicDrawUsage);
      this.geometry.setAttribute(name, attribute);
    }
    this.geometry.setIndex(this.#faces());
  }

  #faces() {
    const faces = [];
    for (let k = 0; k < this.samples; k++) {
      for (let s = 0; s < SIDES; s++) {
        const a = k * (SIDES + 1) + s;
        const b = a + SIDES + 1;
        faces.push(a, a + 1, b, b, a + 1, b + 1);
      }
    }
    return faces;
  }

  /** The angle round the axis at a sample; it stands still on the straight ends. */
  #angle(k) {
    return (TURN * this.turns * Math.min(Math.max(k - LEAD, 0), this.samples - 2 * LEAD)) / (this.samples - 2 * LEAD);
  }

  #layCentreLine(length) {
    const { centre, samples, turns, radius } = this;
    const lead = Math.min(0.14 * length, 1.3 * radius);
    for (let k = 0; k <= samples; k++) {
      const angle = this.#angle(k);
      const done = angle / (TURN * turns);
      const reach = radius * smooth(2 * turns * done) * smooth(2 * turns * (1 - done));
      const before = (Math.min(k, LEAD) / LEAD) * lead;
      const after = (Math.max(k - (samples - LEAD), 0) / LEAD) * lead;
      centre[3 * k] = reach * Math.cos(angle);
      centre[3 * k + 1] = reach * Math.sin(angle);
      centre[3 * k + 2] = before + done * (length - 2 * lead) + after;
    }
  }

  /** Lay the tube for a length, along z from the origin. */
  update(length) {
    this.#layCentreLine(length);
    const { centre, samples, wire, geometry } = this;
    const position = geometry.attributes.position.array;
    const normal = geometry.attributes.normal.array;
    for (let k = 0; k <= samples; k++) {
      const [a, b] = [3 * Math.max(k - 1, 0), 3 * Math.min(k + 1, samples)];
      let [tx, ty, tz] = [centre[b] - centre[a], centre[b + 1] - centre[a + 1], centre[b + 2] - centre[a + 2]];
      const t = Math.hypot(tx, ty, tz) || 1;
      [tx, ty, tz] = [tx / t, ty / t, tz / t];
      const angle = this.#angle(k);
      // The normal points away from the axis, made square to the tangent; the third axis completes the frame.
      let [nx, ny, nz] = [Math.cos(angle), Math.sin(angle), 0];
      const along = nx * tx + ny * ty;
      [nx, ny, nz] = [nx - along * tx, ny - along * ty, -along * tz];
      const n = Math.hypot(nx, ny, nz) || 1;
      [nx, ny, nz] = [nx / n, ny / n, nz / n];
      const [bx, by, bz] = [ty * nz - tz * ny, tz * nx - tx * nz, tx * ny - ty * nx];
      for (let s = 0; s <= SIDES; s++) {
        const [c, d] = [Math.cos((TURN * s) / SIDES), Math.sin((TURN * s) / SIDES)];
        const v = 3 * (k * (SIDES + 1) + s);
        normal[v] = c * nx + d * bx;
        normal[v + 1] = c * ny + d * by;
        normal[v + 2] = c * nz + d * bz;
        for (let m = 0; m < 3; m++) position[v + m] = centre[3 * k + m] + wire * normal[v + m];
      }
    }
    geometry.attributes.position.needsUpdate = true;
    geometry.attributes.normal.needsUpdate = true;
  }
}

/** A coil that suits a spring whose length varies between two bounds: turns never touch when it is short. */
export function coilFor(shortest, longest, radius) {
  const wire = 0.17 * radius;
  const middle = 0.5 * (shortest + longest);
  const wanted = middle / (1.15 * radius);
  const room = (0.72 * shortest) / (2.3 * wire);
  const turns = Math.round(Math.min(Math.max(Math.min(wanted, room), 4), 16)) + 0.5;
  return { turns, radius, wire };
}
