// What the camera must see: points that enclose the whole motion, and the camera that just holds them.
import * as THREE from "three";
import { pointAt, poseAt, sampleNumbers } from "./data.js";
import { hull, silhouette } from "./flats.js";
import { originsBox } from "./packed.js";
import { cornersOf } from "./solids.js";

const BUDGET = 60000; // points looked at, in all

/** Corner points of a body in its own axes. */
function bodyPoints(body, planar) {
  if (!planar) return body.shapes.flatMap(cornersOf);
  if (!body.shapes.length) return [];
  const outline = hull(body.shapes.flatMap(silhouette));
  const sparse = outline.filter((_, k) => k % Math.ceil(outline.length / 16) === 0);
  return sparse.map(({ x, y }) => new THREE.Vector3(x, y, 0));
}

/** Symbols reach a little around their joint, wheels by their radius. */
function jointPoints(joint, unit, planar) {
  if (joint.kind === "rack") {
    const [w, x, y, z] = joint.quaternion;
    const turn = new THREE.Quaternion(x, y, z, w);
    const ends = [joint.reach[0] - joint.size[1], joint.reach[1] + joint.size[1]];
    return ends.map((end) => new THREE.Vector3(end, 0, 0).applyQuaternion(turn).add({ x: joint.position[0], y: joint.position[1], z: joint.position[2] }));
  }
  const bodily = ["wheel", "ball", "gear"].includes(joint.kind) ? joint.size[0] : 0;
  const reach = Math.max(0.1 * unit * joint.scale, bodily);
  const signs = [-1, 1];
  const around = bodily
    ? signs.flatMap((x) => signs.flatMap((y) => (planar ? [0] : signs).map((z) => [x, y, z])))
    : planar
      ? [
          [1, 1, 0],
          [-1, 1, 0],
          [1, -1.2, 0],
          [-1, -1.2, 0],
        ]
      : [
          [0.6, 0.6, 0.6],
          [-0.6, -0.6, -1.2],
        ];
  return around.map(([x, y, z]) =>
    new THREE.Vector3(...joint.position).add(new THREE.Vector3(x, y, z).multiplyScalar(reach)),
  );
}

const PICTURES = 40; // of a set, looked at
const SNUG = 0.6; // of the distance of a shape's corners: bodies are round, or lie flat

/** Corners of a box made larger by a length all around. */
function cornersAround([low, high], reach) {
  const ends = [0, 1, 2].map((c) => [low[c] - reach, high[c] + reach]);
  return ends[0].flatMap((x) => ends[1].flatMap((y) => ends[2].map((z) => new THREE.Vector3(x, y, z))));
}

/** Corners of boxes that hold the sets of bodies. */
function crowdPoints({ sets, t }) {
  return sets.flatMap((data) => {
    const low = new THREE.Vector3();
    const high = new THREE.Vector3();
    for (const shape of data.shapes)
      for (const corner of cornersOf(shape)) {
        low.min(corner);
        high.max(corner);
      }
    const reach = Math.max(low.length(), high.length()) * Math.max(...(data.scale ?? [1])) * SNUG;
    return sampleNumbers(t.length, PICTURES).flatMap((picture) => {
      const box = originsBox(data, picture);
      return box ? cornersAround(box, reach) : [];
    });
  });
}

/** Points that enclose the motion over all times. */
export function motionPoints(recording, unit) {
  const { bodies, lines, joints, curves, planar, t } = recording;
  const own = new Map(bodies.map((body) => [body.name, bodyPoints(body, planar)]));
  const points = [];
  for (const joint of joints) {
    const target = own.get(joint.body) ?? (joint.body === "ground" ? points : []);
    target.push(...jointPoints(joint, unit, planar));
  }
  for (const { body, points: columns } of curves) {
    const target = own.get(body) ?? points;
    const n = columns.length / 3;
    for (const i of sampleNumbers(n, 24)) target.push(pointAt(columns, { i, j: i, f: 0 }, new THREE.Vector3()));
  }
  for (const point of crowdPoints(recording)) points.push(point);
  const ends = lines.flatMap((line) => line.points);
  const each = [...own.values()].reduce((sum, list) => sum + list.length, 1) + ends.length;
  const pose = new THREE.Group();
  for (const i of sampleNumbers(t.length, Math.max(12, Math.min(400, Math.floor(BUDGET / each))))) {
    const frame = { i, j: i, f: 0 };
    for (const body of bodies) {
      poseAt(body, frame, pose);
      pose.updateMatrix();
      for (const point of own.get(body.name)) points.push(point.clone().applyMatrix4(pose.matrix));
      if (!own.get(body.name).length) points.push(pose.position.clone());
    }
    for (const end of ends) points.push(pointAt(end, frame, new THREE.Vector3()));
  }
  const finite = points.filter((point) => Number.isFinite(point.x + point.y + point.z));
  return finite.length ? finite : [new THREE.Vector3(-unit, -unit, -unit), new THREE.Vector3(unit, unit, unit)];
}

/** Extent of numbers along one axis. */
function extent(values) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return [low, high];
}

/** Where an orthographic camera looks (x, y) and how many pixels a metre takes; insets in pixels. */
export function fitFlat(points, width, height, inset) {
  const [x0, x1] = extent(points.map((p) => p.x));
  const [y0, y1] = extent(points.map((p) => p.y));
  const across = Math.max(width - inset.left - inset.right, 40);
  const down = Math.max(height - inset.top - inset.bottom, 40);
  const scale = Math.min(across / (x1 - x0 || 1e-9), down / (y1 - y0 || 1e-9), 1e7);
  const x = (x0 + x1) / 2 + (inset.right - inset.left) / 2 / scale;
  const y = (y0 + y1) / 2 + (inset.top - inset.bottom) / 2 / scale;
  const project = (p) => [width / 2 + (p.x - x) * scale, height / 2 - (p.y - y) * scale];
  return { x, y, scale, size: scale, project };
}

/**
 * Where a perspective camera stands so that the points just fill its picture.
 *
 * A point of right, up, depth (a, b, d) from a camera at depth c is inside when its distance to each side plane is
 * positive; each side gives one bound, two opposite sides give the nearest depth and the place between them.
 */
export function fitSpace(points, direction, up, tangent, width, height, inset) {
  const right = new THREE.Vector3().crossVectors(direction, up).normalize();
  const above = new THREE.Vector3().crossVectors(right, direction);
  const per = (2 * tangent) / height; // tangent per pixel
  const side = (pixels, margin) => Math.max(pixels / 2 - margin, 20) * per;
  const pair = (axis, plus, minus) => {
    let [p, m] = [-Infinity, -Infinity];
    for (const point of points) {
      const [a, d] = [point.dot(axis), point.dot(direction)];
      p = Math.max(p, a - plus * d);
      m = Math.max(m, -a - minus * d);
    }
    const nearest = -(p + m) / (plus + minus);
    return { nearest, at: (depth) => (p + plus * depth - m - minus * depth) / 2 };
  };
  const across = pair(right, side(width, inset.right), side(width, inset.left));
  const down = pair(above, side(height, inset.top), side(height, inset.bottom));
  const [d0, d1] = extent(points.map((point) => point.dot(direction)));
  const depth = Math.min(across.nearest, down.nearest, d0 - 1e-6);
  const position = right.clone().multiplyScalar(across.at(depth)).addScaledVector(above, down.at(depth));
  position.addScaledVector(direction, depth);
  const distance = (d0 + d1) / 2 - depth;
  const project = (point) => {
    const arm = point.clone().sub(position);
    const pixels = 1 / (per * arm.dot(direction));
    return [width / 2 + pixels * arm.dot(right), height / 2 - pixels * arm.dot(above)];
  };
  return { position, target: position.clone().addScaledVector(direction, distance), size: 1 / distance, project };
}
