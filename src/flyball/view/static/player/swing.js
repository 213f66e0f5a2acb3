// How far a recorded motion swings about the place of rest, which is its first sample.
import * as THREE from "three";

const [rest, turn] = [new THREE.Quaternion(), new THREE.Quaternion()];
const read = (columns, i, out) => {
  const n = columns.length / 4;
  return out.set(columns[n + i], columns[2 * n + i], columns[3 * n + i], columns[i]);
};

/** Points: as many times as far from the first one. */
function scalePoints(from, to, factor) {
  const n = from.length / 3;
  for (let k = 0; k < from.length; k++) {
    const first = from[k - (k % n)];
    to[k] = first + factor * (from[k] - first);
  }
}

/** Orientations: turned as many times as far from the first one. */
function scaleTurns(from, to, factor) {
  const n = from.length / 4;
  read(from, 0, rest);
  for (let i = 0; i < n; i++) {
    read(from, i, turn).premultiply(rest.conjugate());
    rest.conjugate();
    if (turn.w < 0) turn.set(-turn.x, -turn.y, -turn.z, -turn.w);
    const sine = Math.hypot(turn.x, turn.y, turn.z);
    const half = factor * Math.atan2(sine, turn.w);
    const k = sine > 0 ? Math.sin(half) / sine : 0;
    turn.set(k * turn.x, k * turn.y, k * turn.z, Math.cos(half)).premultiply(rest);
    [to[i], to[n + i], to[2 * n + i], to[3 * n + i]] = [turn.w, turn.x, turn.y, turn.z];
  }
}

export class Swing {
  constructor({ bodies, lines }) {
    const points = new Set([...bodies.map(({ p }) => p), ...lines.flatMap((line) => line.points)]); // some are shared
    const turns = new Set(bodies.map(({ q }) => q));
    const kept = (array, scale) => ({ array, scale, from: array.slice() });
    this.parts = [...points].map((array) => kept(array, scalePoints));
    this.parts.push(...[...turns].map((array) => kept(array, scaleTurns)));
  }

  /** Change the recording's poses to this many times the recorded swing. */
  set(factor) {
    for (const { array, scale, from } of this.parts) scale(from, array, factor);
  }
}
