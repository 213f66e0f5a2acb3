// Symbols of joints in the plane, as in a textbook: open pins, hatched ground, slotted guides, toothed wheels.
import * as THREE from "three";
import { poseAt } from "./data.js";
import { ORDER, hull, silhouette } from "./flats.js";
import { gearShape, rackShape } from "./gearshape.js";
import { Symbol2d, at } from "./parts2d.js";
import { outlineColour } from "./theme.js";
import { hangs, sliderTravel } from "./travel.js";

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

const ON_EDGE = 1e-4; // relative to the unit: a joint on an outline is within the body, whatever rounding makes of it
const START = { i: 0, j: 0, f: 0 };
const outlines = new WeakMap(); // shape -> its convex outline in the axes of its body

function convexOutline(shape) {
  if (!outlines.has(shape)) outlines.set(shape, hull(silhouette(shape)));
  return outlines.get(shape);
}

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
    if (joint.mate && body.name !== joint.body && body.name !== joint.mate) continue;
    poseAt(body, START, pose);
    const local = point.clone().sub(pose.position).applyQuaternion(pose.quaternion.invert());
    for (const shape of body.shapes) {
      const depth = depthInside(at(local.x, local.y), convexOutline(shape));
      if (depth > -ON_EDGE * unit) radius = Math.min(radius, Math.max(0.6 * depth, 0.006 * unit));
    }
  }
  return Number(radius.toPrecision(3)); // equal pins share their geometry
}

/** The stand of a pin on ground: a triangle on a hatched line; upside down where the body hangs from it. */
function pedestal(symbol, u, hanging) {
  const [h, w] = [0.11 * u, 0.074 * u];
  const corners = [at(-0.02 * u, 0.012 * u), at(-w, -h), at(w, -h), at(0.02 * u, 0.012 * u)];
  const stand = new Symbol2d();
  stand.area(corners, "pin", ORDER.ground + 2);
  stand.line(corners, "ink", 2, ORDER.ground + 3, true);
  stand.hatch(-1.55 * w, 1.55 * w, -h, 0.03 * u, ORDER.ground);
  if (hanging) stand.group.rotation.z = Math.PI;
  symbol.include(stand);
}

/** The room that a slider sweeps, along (x) and across (y) the axis of its joint. */
function sweptRoom(joint, recording, u) {
  const travel = sliderTravel(joint, recording, u);
  if (!travel) return { x: [-0.2 * u, 0.2 * u], y: [-0.06 * u, 0.06 * u] };
  const [along, across] = [at(joint.axis[0], joint.axis[1]).normalize(), at(-joint.axis[1], joint.axis[0]).normalize()];
  const origin = new THREE.Vector3(...joint.position);
  const points = travel.body.shapes.filter(({ link }) => !link).flatMap(silhouette).map(({ x, y }) => {
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
    symbol.include(upper);
    return;
  }
  slot(symbol, x0, x1, Math.min(0.3 * (y1 - y0), 0.02 * u), ORDER.body + 3 * carrier + 2);
}

function slot(symbol, x0, x1, half, order) {
  const ends = [at(x0, -half), at(x1, -half), at(x1, half), at(x0, half)];
  symbol.area(ends, "pin", order);
  symbol.line(ends, "ink", 1.6, order, true);
}

function weld(symbol, u, grounded) {
  const s = 0.026 * u;
  symbol.area([at(-s, -s), at(s, -s), at(s, s), at(-s, s)], "ink", ORDER.pin);
  if (grounded) symbol.hatch(-0.09 * u, 0.09 * u, -s, 0.03 * u, ORDER.ground);
}

/** A part of a body: its colour, and the ink around it. */
function bodily(symbol, shape, colour, order) {
  const { shape: outline, holes } = shape.extractPoints(48);
  for (const path of [outline, ...holes]) symbol.line(path, outlineColour(colour), 3, order, true);
  symbol.area(shape, colour, order + 1);
}

function wheel(symbol, radius, colour, order) {
  const shape = new THREE.Shape().absarc(0, 0, radius, 0, 2 * Math.PI);
  for (let k = 0; k < 5; k++) {
    const angle = (2 * Math.PI * k) / 5;
    const hole = new THREE.Path();
    hole.absarc(0.58 * radius * Math.cos(angle), 0.58 * radius * Math.sin(angle), 0.17 * radius, 0, 2 * Math.PI);
    shape.holes.push(hole);
  }
  bodily(symbol, shape, colour, order);
}

/** A blade along x, with short marks of the ways that are barred. */
function knife(symbol, u, order) {
  const [half, thick] = [0.13 * u, 0.012 * u];
  symbol.area(
    [
      at(-half, 0),
      at(-0.6 * half, -thick),
      at(0.6 * half, -thick),
      at(half, 0),
      at(0.6 * half, thick),
      at(-0.6 * half, thick),
    ],
    "ink",
    order,
  );
  const mark = (x, s) => [at(x, 1.6 * s * thick), at(x, 3.4 * s * thick)];
  symbol.segments(
    [mark(0, 1), mark(0, -1), mark(0.4 * half, 1), mark(0.4 * half, -1), mark(-0.4 * half, 1), mark(-0.4 * half, -1)],
    "hatch",
    1.5,
    order,
  );
}

/** Drawers of what is not a pin, a slide or a weld, in the frame of the joint. */
const DRAWERS = {
  gear: (s, { joint, colour, body }) => bodily(s, gearShape(joint.size), colour, body),
  rack: (s, { joint, colour, body }) => bodily(s, rackShape(joint.size, joint.reach[0], joint.reach[1]), colour, body),
  wheel: (s, { joint, colour, body }) => wheel(s, joint.size[0], colour, body),
  ball: (s, { joint, colour, body }) => wheel(s, joint.size[0], colour, body),
  roller: (s, { joint, order }) => pin(s, joint.size[0], order, true),
  point: (s, { u, order }) => pin(s, 0.02 * u, order, false),
  knife_edge: (s, { u, order }) => knife(s, u, order),
  bushing: (s, { u, order }) => {
    s.disc(0.045 * u, "tube", order);
    s.disc(0.026 * u, "steel", order + 1);
    s.disc(0.014 * u, "ink", order + 2);
  },
  orientation: (s, { u, order }) => {
    const h = 0.034 * u;
    s.line([at(-h, -h), at(h, -h), at(h, h), at(-h, h)], "ink", 2, order, true);
    s.segments(
      [
        [at(-h, 0), at(h, 0)],
        [at(0, -h), at(0, h)],
      ],
      "ink",
      2,
      order,
    );
  },
  rail: (s, { u, joint: { reach }, carrier }) => {
    const spare = 0.03 * u;
    slot(s, reach[4] - spare, reach[5] + spare, spare, carrier < 0 ? ORDER.guide : ORDER.body + 3 * carrier + 2);
  },
  plane: (s, { u, joint: { reach } }) => {
    const spare = 0.2 * u + 0.5 * Math.abs(reach[0] + reach[1]);
    const line = new Symbol2d();
    // x of the frame points to the left of the line: to where the wheel is, or away from it
    const above = reach[0] + reach[1] >= 0;
    const [from, to] = [reach[4] - spare, reach[5] + spare];
    line.hatch(above ? from : -to, above ? to : -from, 0, 0.03 * u, ORDER.guide);
    if (!above) line.group.rotation.z = Math.PI;
    s.include(line);
  },
  mark: (s, { u, order }) => {
    const h = 0.03 * u;
    s.area([at(-h, 0), at(0, -h), at(h, 0), at(0, h)], "ink", order);
    s.area([at(-0.6 * h, 0), at(0, -0.6 * h), at(0.6 * h, 0), at(0, 0.6 * h)], "pin", order + 1);
  },
};
const PINS = ["revolute", "spherical", "universal"];
const ALONG = ["rail", "plane", "knife_edge"]; // drawn along the z axis of their frame

/** How a symbol lies on its body: a slide along its axis, other kinds as their frame is turned. */
function turnOf(joint, slides) {
  if (slides || ALONG.includes(joint.kind)) return Math.atan2(joint.axis[1], joint.axis[0]);
  const [w, x, y, z] = joint.quaternion;
  const ahead = new THREE.Vector3(1, 0, 0).applyQuaternion(new THREE.Quaternion(x, y, z, w));
  return Math.atan2(ahead.y, ahead.x);
}

/** The symbol of a planar joint; it is to be added to the body the joint rides on (or to the world). */
export function flatJoint(joint, recording, unit, index, colour) {
  const symbol = new Symbol2d();
  const order = ORDER.pin + 3 * index;
  const grounded = joint.body === "ground";
  const carrier = grounded ? -1 : recording.bodies.findIndex((body) => body.name === joint.body);
  const slides = joint.kind === "prismatic" || (joint.kind === "cylindrical" && Math.abs(joint.axis[2]) < 0.5);
  const u = Math.max(joint.scale, 0.6) * unit;
  if (slides) guide(symbol, u, sweptRoom(joint, recording, unit), carrier);
  else if (joint.kind === "fixed") weld(symbol, u, grounded);
  else if (PINS.includes(joint.kind) || joint.kind === "cylindrical") {
    if (grounded) pedestal(symbol, u, hangs(joint, recording, new THREE.Vector3(0, -1, 0)));
    pin(symbol, pinRadius(joint, recording, unit), order, grounded);
  } else {
    const body = carrier < 0 ? ORDER.guide : ORDER.body + 3 * carrier;
    (DRAWERS[joint.kind] ?? DRAWERS.mark)(symbol, { u, order, joint, colour, carrier, body });
  }
  if (slides || !PINS.includes(joint.kind))
    symbol.group.rotation.z = joint.kind === "fixed" ? 0 : turnOf(joint, slides);
  symbol.group.position.set(joint.position[0], joint.position[1], 0);
  return { group: symbol.group, retheme: (theme) => symbol.retheme(theme), glow: (on) => symbol.glow(on) };
}
