// Flat bodies of planar mechanisms: silhouettes with an ink outline, drawn in a fixed order without depth.
import * as THREE from "three";
import { outlineColour } from "./theme.js";
import { meshGeometry, placed } from "./solids.js";

// The painter's order: what comes later lies on top. A body takes two numbers, outline and fill.
export const ORDER = { floor: 5, shadow: 10, ground: 20, trail: 30, guide: 40, body: 100, line: 1e5, pin: 2e5, arrow: 4e5 };
const MANY = 60; // corners of an outline from which it is taken as a curve and not rounded
const CIRCLE = Array.from({ length: 64 }, (_, k) => (k * Math.PI) / 32);

/** The convex hull of points in the plane, anticlockwise (Andrew's monotone chain). */
export function hull(points) {
  const sorted = [...points].sort((a, b) => a.x - b.x || a.y - b.y);
  const turn = (o, a, b) => (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
  const chain = (list) => {
    const out = [];
    for (const point of list) {
      while (out.length > 1 && turn(out.at(-2), out.at(-1), point) <= 1e-14) out.pop();
      out.push(point);
    }
    return out.slice(0, -1);
  };
  return [...chain(sorted), ...chain(sorted.reverse())];
}

/** A closed outline with its corners rounded; short edges keep their shape. */
export function rounded(points, radius) {
  const n = points.length;
  return points.flatMap((corner, k) => {
    const before = points[(k + n - 1) % n];
    const after = points[(k + 1) % n];
    const cut = Math.min(radius, 0.35 * corner.distanceTo(before), 0.35 * corner.distanceTo(after));
    const from = corner.clone().lerp(before, cut / (corner.distanceTo(before) || 1));
    const to = corner.clone().lerp(after, cut / (corner.distanceTo(after) || 1));
    return [0, 0.2, 0.4, 0.6, 0.8, 1].map((s) => {
      const middle = corner.clone();
      return from
        .clone()
        .multiplyScalar((1 - s) ** 2)
        .addScaledVector(middle, 2 * s * (1 - s))
        .addScaledVector(to, s * s);
    });
  });
}

/** Points on the surface of a convex shape, in its own axes: enough to find its silhouette from anywhere. */
function surface({ kind, size }) {
  const [a, b, c] = size;
  const ring = (radius, z) => CIRCLE.map((s) => new THREE.Vector3(radius * Math.cos(s), radius * Math.sin(s), z));
  if (kind === "cylinder") return [...ring(a, b / 2), ...ring(a, -b / 2)];
  if (kind === "cone") return [...ring(a, -b / 2), new THREE.Vector3(0, 0, b / 2)];
  if (kind === "ellipsoid") {
    return CIRCLE.flatMap((s) => ring(Math.cos(s), Math.sin(s))).map((p) => p.multiply(new THREE.Vector3(a, b, c)));
  }
  const signs = [-0.5, 0.5];
  return signs.flatMap((x) => signs.flatMap((y) => signs.map((z) => new THREE.Vector3(a * x, b * y, c * z))));
}

/** The outline of a shape seen along z, in the body's axes. */
export function silhouette(shape) {
  const frame = placed(new THREE.Group(), shape);
  frame.updateMatrix();
  const flat = (p) => new THREE.Vector2(p.x, p.y);
  const onBody = (p) => flat(p.applyMatrix4(frame.matrix));
  const { kind, size } = shape;
  if (kind === "mesh") return hull(corners(meshGeometry(shape)).map(onBody));
  if (kind === "plate") {
    const points = shape.outline.map(([x, y]) => onBody(new THREE.Vector3(x, y, 0)));
    if (points.length > MANY) return points;
    return rounded(points, 0.06 * Math.max(...points.map((point) => point.distanceTo(points[0]))));
  }
  if (kind === "sphere" || kind === "capsule") {
    const half = kind === "capsule" ? size[1] / 2 : 0;
    const centres = [-half, half].map((z) => onBody(new THREE.Vector3(0, 0, z)));
    const rim = CIRCLE.map((s) => new THREE.Vector2(size[0] * Math.cos(s), size[0] * Math.sin(s)));
    return hull(centres.flatMap((centre) => rim.map((point) => point.clone().add(centre))));
  }
  const outline = hull(surface(shape).map(onBody));
  return kind === "box" ? rounded(outline, 0.18 * Math.min(size[0], size[1])) : outline;
}

function corners(geometry) {
  const { position } = geometry.attributes;
  return Array.from({ length: position.count }, (_, k) => new THREE.Vector3().fromBufferAttribute(position, k));
}

/** Edges of a mesh where it ends, seen along z: those of one triangle, or between one that looks up and one down. */
function rimOf(geometry) {
  const points = corners(geometry);
  const index = geometry.index.array;
  const seen = new Map();
  for (let k = 0; k < index.length; k += 3) {
    const [a, b, c] = [index[k], index[k + 1], index[k + 2]];
    const [p, q, r] = [points[a], points[b], points[c]];
    const up = (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x) > 0;
    for (const [i, j] of [
      [a, b],
      [b, c],
      [c, a],
    ]) {
      const key = i < j ? `${i},${j}` : `${j},${i}`;
      seen.set(key, [...(seen.get(key) ?? []), up]);
    }
  }
  const ends = [...seen].filter(([, ups]) => ups.length === 1 || ups.includes(true) !== ups.every(Boolean));
  return ends.map(([key]) => key.split(",").map((k) => points[k]));
}

/** A mesh in the plane: all of its triangles filled, and the edges where it ends. */
function flatMesh(shape, colour, paint, order) {
  const geometry = meshGeometry(shape);
  const flat = { depthTest: false, depthWrite: false, transparent: true };
  const lines = new THREE.LineSegmentsGeometry().setPositions(
    rimOf(geometry).flatMap(([a, b]) => [a.x, a.y, a.z, b.x, b.y, b.z]),
  );
  const edge = new THREE.LineSegments2(lines, new THREE.LineMaterial({ color: colour, linewidth: 4, ...flat }));
  Object.assign(edge, { renderOrder: order, frustumCulled: false });
  const face = Object.assign(new THREE.Mesh(geometry, paint), { renderOrder: order + 1 });
  return [placed(edge, shape), placed(face, shape)];
}

/** A shape that looks round in the plane: only a mark shows how it turns. */
export function looksRound({ kind, quaternion: [, x, y] }) {
  return kind === "sphere" || (kind === "cylinder" && Math.abs(x) + Math.abs(y) < 1e-6);
}

/** Paint without depth; all of it counts as transparent, because three.js would draw opaque things first. */
export function flatMaterial(options) {
  const flat = { depthTest: false, depthWrite: false, transparent: true, side: THREE.DoubleSide };
  return new THREE.MeshBasicMaterial({ ...flat, ...options });
}

/** A pixel-wide stroke through points in the plane. */
export function stroke(points, { color, width, order, closed = false, ...rest }) {
  const path = closed ? [...points, points[0]] : points;
  const geometry = new THREE.LineGeometry().setPositions(path.flatMap((p) => [p.x, p.y, p.z ?? 0]));
  const flat = { depthTest: false, depthWrite: false, transparent: true };
  const material = new THREE.LineMaterial({ color, linewidth: width, ...flat, ...rest });
  return Object.assign(new THREE.Line2(geometry, material), { renderOrder: order, frustumCulled: false });
}

function fill(outline, material, order) {
  return Object.assign(new THREE.Mesh(new THREE.ShapeGeometry(new THREE.Shape(outline)), material), {
    renderOrder: order,
  });
}

/** A planar body. All outlines lie under all fills, so that overlapping shapes read as one. */
export function flatBody(body, colour, index) {
  const group = new THREE.Group();
  const shade = new THREE.Group();
  const order = body.ground ? ORDER.floor : ORDER.body + 3 * index;
  const paint = flatMaterial({ color: colour });
  const dusk = flatMaterial({ color: "#0a1420", opacity: 0.12 });
  const edges = [];
  const paper = flatMaterial({ color: "#ffffff" });
  for (const shape of body.shapes) {
    if (shape.hole) {
      const outline = silhouette(shape);
      edges.push(stroke(outline, { color: colour, width: 2, order: order + 2, closed: true }));
      group.add(fill(outline, paper, order + 2), edges.at(-1));
      continue;
    }
    if (shape.kind === "mesh") {
      const [edge, face] = flatMesh(shape, colour, paint, order);
      edges.push(edge);
      group.add(edge, face);
      continue;
    }
    const outline = silhouette(shape);
    edges.push(stroke(outline, { color: colour, width: 4, order, closed: true }));
    group.add(edges.at(-1), fill(outline, paint, order + 1));
    shade.add(fill(outline, dusk, ORDER.shadow));
    if (looksRound(shape)) {
      const [x, y] = shape.position;
      edges.push(
        stroke(
          [
            { x, y },
            { x: x + 0.82 * shape.size[0], y },
          ],
          { color: colour, width: 1.6, order: order + 2 },
        ),
      );
      group.add(edges.at(-1));
    }
  }
  const retheme = (theme) => {
    for (const edge of edges) edge.material.color.copy(outlineColour(colour, theme));
    dusk.opacity = theme.flatShadow;
    paper.color.set(theme.pin);
  };
  const glow = (on) => paint.color.set(colour).lerp(new THREE.Color("#ffffff"), on ? 0.18 : 0);
  return { group, shade, retheme, glow };
}
