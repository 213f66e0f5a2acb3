// Symbols of joints in the plane, as in a textbook: open pins, hatched ground, slotted guides.
import * as THREE from "three";
import { poseAt } from "./data.js";
import { ORDER, flatMaterial, hull, silhouette, stroke } from "./flats.js";
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
    const geometry = new THREE.LineSegmentsGeometry().setPositions(
      pairs.flatMap(([a, b]) => [a.x, a.y, 0, b.x, b.y, 0]),
    );
    const material = new THREE.LineMaterial({
      linewidth: width,
      depthTest: false,
      depthWrite: false,
      transparent: true,
    });
    const object = new THREE.LineSegments2(geometry, material);
    return this.add(Object.assign(object, { renderOrder: order, frustumCulled: false }), tone);
  }

  /** Ground: a line from x0 to x1 with short strokes below it. */
  hatch(x0, x1, y, depth, order) {
    const count = Math.max(3, Math.round((x1 - x0) / (0.8 * depth)));
    const step = (x1 - x0) / count;
    const tick = (k) => [at(x0 + (k + 1) * step, y), at(x0 + (k + 1) * step - depth, y - depth)];
    this.segments(
      Array.from({ length: count }, (_, k) => tick(k)),
      "hatch",
      1.3,
      order,
    );
    this.line([at(x0, y), at(x1, y)], "ink", 2.2, order + 1);
  }

  retheme(theme) {
    for (const [material, tone] of this.parts) material.color.set(theme[tone]);
  }
}

/** A pin: an open circle; one fixed to ground has a dot, which shows even when a wheel hides its stand. */
function pin(symbol, radius, order, grounded) {
  symbol.disc(radius, "ink", order);
  symbol.disc(0.72 * radius, "pin", order + 1);
  if (grounded) symbol.disc(0.3 * radius, "ink", order + 2);
}

/** How far a point inside an outline is from its edge; negative or infinite outside. */
function depthInside(point, outline) {
  let depth = Infinity;
  outline.forEach((a, k) => {
    const edge = outline[(k + 1) % outline.length].clone().sub(a);
    depth = Math.min(depth, edge.cross(point.clone().sub(a)) / (edge.length() || 1));
  });
  return depth;
}

const START = { i: 0, j: 0, f: 0 };

/** The size of a pin: as wanted, but narrow enough for every body that it passes through at the start. */
function pinRadius(joint, recording, unit) {
  const pose = new THREE.Group();
  const point = new THREE.Vector3(...joint.position);
  const carrier = recording.bodies.find((body) => body.name === joint.body);
  if (carrier) {
    poseAt(carrier, START, pose);
    point.applyQuaternion(pose.quaternion).add(pose.position);
  }
  let radius = 0.0245 * unit;
  for (const body of recording.bodies) {
    poseAt(body, START, pose);
    const local = point.clone().sub(pose.position).applyQuaternion(pose.quaternion.invert());
    for (const shape of body.shapes) {
      const depth = depthInside(at(local.x, local.y), hull(silhouette(shape)));
      if (depth > 0) radius = Math.min(radius, Math.max(0.6 * depth, 0.006 * unit));
    }
  }
  return radius;
}

/** The stand of a pin on ground: a triangle on a hatched line. */
function pedestal(symbol, u) {
  const [h, w] = [0.11 * u, 0.074 * u];
  const corners = [at(-0.02 * u, 0.012 * u), at(-w, -h), at(w, -h), at(0.02 * u, 0.012 * u)];
  symbol.area(corners, "pin", ORDER.ground + 2);
  symbol.line(corners, "ink", 2, ORDER.ground + 3, true);
  symbol.hatch(-1.55 * w, 1.55 * w, -h, 0.03 * u, ORDER.ground);
}

/** The room that a slider sweeps, along (x) and across (y) the axis of its joint. */
function sweptRoom(joint, recording, u) {
  const travel = sliderTravel(joint, recording, u);
  if (!travel) return { x: [-0.2 * u, 0.2 * u], y: [-0.06 * u, 0.06 * u] };
  const [along, across] = [at(joint.axis[0], joint.axis[1]).normalize(), at(-joint.axis[1], joint.axis[0]).normalize()];
  const origin = new THREE.Vector3(...joint.position);
  const points = travel.body.shapes.flatMap(silhouette).map(({ x, y }) => {
    const point = new THREE.Vector3(x, y, 0).applyQuaternion(travel.pose.q).add(travel.pose.p).sub(origin);
    return at(along.dot(point) - travel.first, across.dot(point));
  });
  if (!points.length) points.push(at(-0.06 * u, -0.04 * u), at(0.06 * u, 0.04 * u));
  const [xs, ys] = [points.map((point) => point.x), points.map((point) => point.y)];
  const [from, to] = travel.range;
  return { x: [from + Math.min(...xs), to + Math.max(...xs)], y: [Math.min(...ys), Math.max(...ys)] };
}

/** Rails along x: on ground hatched, beside the slider; on a body a slot within it. */
function guide(symbol, u, { x: [x0, x1], y: [y0, y1] }, carrier) {
  const spare = 0.03 * u;
  if (carrier < 0) {
    symbol.hatch(x0 - spare, x1 + spare, y0, 0.03 * u, ORDER.guide);
    const upper = new Symbol2d();
    upper.hatch(-x1 - spare, -x0 + spare, -y1, 0.03 * u, ORDER.guide);
    upper.group.rotation.z = Math.PI;
    symbol.group.add(upper.group);
    symbol.parts.push(...upper.parts);
    return;
  }
  const half = Math.min(0.3 * (y1 - y0), 0.02 * u);
  const slot = [at(x0, -half), at(x1, -half), at(x1, half), at(x0, half)];
  const order = ORDER.body + 3 * carrier + 2;
  symbol.area(slot, "pin", order);
  symbol.line(slot, "ink", 1.6, order, true);
}

function weld(symbol, u, grounded) {
  const s = 0.026 * u;
  symbol.area([at(-s, -s), at(s, -s), at(s, s), at(-s, s)], "ink", ORDER.pin);
  if (grounded) symbol.hatch(-0.09 * u, 0.09 * u, -s, 0.03 * u, ORDER.ground);
}

/** The symbol of a planar joint; it is to be added to the body the joint rides on (or to the world). */
export function flatJoint(joint, recording, unit, index) {
  const symbol = new Symbol2d();
  const order = ORDER.pin + 3 * index;
  const grounded = joint.body === "ground";
  const slides = joint.kind === "prismatic" || (joint.kind === "cylindrical" && Math.abs(joint.axis[2]) < 0.5);
  if (slides) {
    const carrier = grounded ? -1 : recording.bodies.findIndex((body) => body.name === joint.body);
    guide(symbol, unit, sweptRoom(joint, recording, unit), carrier);
    symbol.group.rotation.z = Math.atan2(joint.axis[1], joint.axis[0]);
  } else if (joint.kind === "fixed") {
    weld(symbol, unit, grounded);
  } else {
    if (grounded) pedestal(symbol, unit);
    pin(symbol, pinRadius(joint, recording, unit), order, grounded);
  }
  symbol.group.position.set(joint.position[0], joint.position[1], 0);
  return { group: symbol.group, retheme: (theme) => symbol.retheme(theme) };
}
