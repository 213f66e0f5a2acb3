// Symbols of joints in the plane, as in a textbook: open pins, hatched ground, slotted guides.
import * as THREE from "three";
import { ORDER, flatMaterial, stroke } from "./flats.js";
import { sliderTravel } from "./travel.js";

const at = (x, y) => new THREE.Vector2(x, y);

/** Collects the parts of one symbol, each with the theme's colour that it takes. */
class Symbol2d {
  group = new THREE.Group();
  parts = [];

  add(object, tone) {
    this.parts.push([object.material, tone]);
    this.group.add(object);
    return object;
  }

  disc(radius, tone, order) {
    const mesh = new THREE.Mesh(new THREE.CircleGeometry(radius, 48), flatMaterial({}));
    return this.add(Object.assign(mesh, { renderOrder: order }), tone);
  }

  area(points, tone, order) {
    const mesh = new THREE.Mesh(new THREE.ShapeGeometry(new THREE.Shape(points)), flatMaterial({}));
    return this.add(Object.assign(mesh, { renderOrder: order }), tone);
  }

  line(points, tone, width, order, closed = false) {
    return this.add(stroke(points, { color: "#000000", width, order, closed }), tone);
  }

  /** Separate segments, drawn in one go. */
  segments(pairs, tone, width, order) {
    const geometry = new THREE.LineSegmentsGeometry().setPositions(pairs.flatMap(([a, b]) => [a.x, a.y, 0, b.x, b.y, 0]));
    const material = new THREE.LineMaterial({ linewidth: width, depthTest: false, depthWrite: false, transparent: true });
    const object = new THREE.LineSegments2(geometry, material);
    return this.add(Object.assign(object, { renderOrder: order, frustumCulled: false }), tone);
  }

  /** Ground: a line from x0 to x1 with short strokes below it. */
  hatch(x0, x1, y, depth, order) {
    const count = Math.max(3, Math.round((x1 - x0) / (0.8 * depth)));
    const step = (x1 - x0) / count;
    const tick = (k) => [at(x0 + (k + 1) * step, y), at(x0 + (k + 1) * step - depth, y - depth)];
    this.segments(Array.from({ length: count }, (_, k) => tick(k)), "hatch", 1.3, order);
    this.line([at(x0, y), at(x1, y)], "ink", 2.2, order + 1);
  }

  retheme(theme) {
    for (const [material, tone] of this.parts) material.color.set(theme[tone]);
  }
}

function pin(symbol, u, order) {
  symbol.disc(0.0245 * u, "ink", order);
  symbol.disc(0.0175 * u, "pin", order + 1);
}

/** The stand of a pin on ground: a triangle on a hatched line. */
function pedestal(symbol, u) {
  const [h, w] = [0.085 * u, 0.058 * u];
  const corners = [at(-0.02 * u, 0.012 * u), at(-w, -h), at(w, -h), at(0.02 * u, 0.012 * u)];
  symbol.area(corners, "pin", ORDER.ground + 2);
  symbol.line(corners, "ink", 2, ORDER.ground + 3, true);
  symbol.hatch(-1.55 * w, 1.55 * w, -h, 0.03 * u, ORDER.ground);
}

/** Two rails along x; on ground hatched, on a body plain. */
function guide(symbol, u, [from, to], grounded) {
  const half = 0.062 * u;
  const [x0, x1] = [from - 0.11 * u, to + 0.11 * u];
  if (grounded) {
    symbol.hatch(x0, x1, -half, 0.03 * u, ORDER.guide);
    const upper = new Symbol2d();
    upper.hatch(-x1, -x0, -half, 0.03 * u, ORDER.guide);
    upper.group.rotation.z = Math.PI;
    symbol.group.add(upper.group);
    symbol.parts.push(...upper.parts);
    return;
  }
  const slot = [at(x0, -0.4 * half), at(x1, -0.4 * half), at(x1, 0.4 * half), at(x0, 0.4 * half)];
  symbol.area(slot, "pin", ORDER.pin - 4);
  symbol.line(slot, "ink", 1.6, ORDER.pin - 3, true);
}

function weld(symbol, u, grounded) {
  const s = 0.026 * u;
  symbol.area([at(-s, -s), at(s, -s), at(s, s), at(-s, s)], "ink", ORDER.pin);
  if (grounded) symbol.hatch(-0.09 * u, 0.09 * u, -s, 0.03 * u, ORDER.ground);
}

/** The symbol of a planar joint; it is to be added to the body the joint rides on (or to the world). */
export function flatJoint(joint, recording, unit, index) {
  const symbol = new Symbol2d();
  const order = ORDER.pin + 2 * index;
  const grounded = joint.body === "ground";
  const slides = joint.kind === "prismatic" || (joint.kind === "cylindrical" && Math.abs(joint.axis[2]) < 0.5);
  if (slides) {
    guide(symbol, unit, sliderTravel(joint, recording, unit) ?? [-0.1 * unit, 0.1 * unit], grounded);
    symbol.group.rotation.z = Math.atan2(joint.axis[1], joint.axis[0]);
  } else if (joint.kind === "fixed") {
    weld(symbol, unit, grounded);
  } else {
    if (grounded) pedestal(symbol, unit);
    pin(symbol, unit, order);
  }
  symbol.group.position.set(joint.position[0], joint.position[1], 0);
  return { group: symbol.group, retheme: (theme) => symbol.retheme(theme) };
}
