// Outlines of gear wheels, racks and rings, seen along their axis, as shapes to fill or to extrude.
import * as THREE from "three";

const CIRCLE = 64;
const TIP = 1; // addendum and dedendum in modules
const ROOT = 1.25;

const at = (radius, angle) => new THREE.Vector2(radius * Math.cos(angle), radius * Math.sin(angle));

/** Points of a circle, anticlockwise. */
export function circle(radius, count = CIRCLE) {
  return Array.from({ length: count }, (_, k) => at(radius, (2 * Math.PI * k) / count));
}

/** A toothed outline: a tooth at the angle `phase`; heights in modules outside and inside of the pitch circle. */
function toothed(radius, teeth, phase, outside, inside) {
  const module = (2 * radius) / teeth;
  const pitch = (2 * Math.PI) / teeth;
  return Array.from({ length: teeth }, (_, k) => {
    const middle = phase + k * pitch;
    const flank = (part, height) => [
      at(radius + height * module, middle - part * pitch),
      at(radius + height * module, middle + part * pitch),
    ];
    const [root, tip] = [flank(0.34, -inside), flank(0.13, outside)];
    return [root[0], tip[0], tip[1], root[1]];
  }).flat();
}

/** A gear wheel: `size` is the pitch radius, the teeth (0: none), the angle of one, and 1 for a ring. */
export function gearShape([radius, teeth, phase, ring]) {
  const module = teeth ? (2 * radius) / teeth : 0.1 * radius;
  if (ring) {
    const shape = new THREE.Shape(circle(radius + 3.2 * module));
    const hole = teeth ? toothed(radius, teeth, phase + Math.PI / teeth, ROOT, TIP) : circle(radius);
    shape.holes.push(new THREE.Path(hole));
    return shape;
  }
  const shape = new THREE.Shape(teeth ? toothed(radius, teeth, phase, TIP, ROOT) : circle(radius));
  shape.holes.push(new THREE.Path(circle(0.16 * radius, 32)));
  return shape;
}

/** A toothed bar along x from `from` to `to`, a gap at x = 0, its teeth towards +y, its pitch line at y = 0. */
export function rackShape([, pitch], from, to) {
  const module = pitch / Math.PI;
  const [first, last] = [Math.floor(from / pitch) - 1, Math.ceil(to / pitch) + 1];
  const points = [];
  for (let k = first; k < last; k++) {
    const middle = (k + 0.5) * pitch;
    for (const [part, height] of [
      [-0.34, -ROOT],
      [-0.13, TIP],
      [0.13, TIP],
      [0.34, -ROOT],
    ])
      points.push(new THREE.Vector2(middle + part * pitch, height * module));
  }
  const depth = -4.2 * module;
  return new THREE.Shape([...points, new THREE.Vector2(points.at(-1).x, depth), new THREE.Vector2(points[0].x, depth)]);
}
