// Flat bodies of planar mechanisms: silhouettes with an ink outline, drawn in a fixed order without depth.
import * as THREE from "three";
import { outlineColour } from "./theme.js";
import { FINENESS, meshGeometry, placed } from "./solids.js";

// The painter's order: what comes later lies on top. A body takes two numbers, outline and fill.
export const ORDER = { floor: 5, shadow: 10, ground: 20, trail: 30, guide: 40, body: 100, line: 1e5, pin: 2e5, arrow: 4e5 };
const MANY = 60; // corners of an outline from which it is taken as a curve and not rounded
const SIDES = 64; // of a circle where bodies are few

/** Angles around a circle. */
function circle() {
  const n = FINENESS.fine ? SIDES : 0.375 * SIDES;
  return Array.from({ length: n }, (_, k) => (2 * k * Math.PI) / n);
}

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
  const angles = circle();
  const ring = (radius, z) => angles.map((s) => new THREE.Vector3(radius * Math.cos(s), radius * Math.sin(s), z));
  if (kind === "cylinder") return [...ring(a, b / 2), ...ring(a, -b / 2)];
  if (kind === "cone") return [...ring(a, -b / 2), new THREE.Vector3(0, 0, b / 2)];
  if (kind === "ellipsoid") {
    return angles.flatMap((s) => ring(Math.cos(s), Math.sin(s))).map((p) => p.multiply(new THREE.Vector3(a, b, c)));
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
    const rim = circle().map((s) => new THREE.Vector2(size[0] * Math.cos(s), size[0] * Math.sin(s)));
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

/** The filled area within an outline. */
export const area = (outline) => new THREE.ShapeGeometry(new THREE.Shape(outline));

function fill(outline, material, order) {
  return Object.assign(new THREE.Mesh(area(outline), material), { renderOrder: order });
}

/** An outline moved inwards everywhere by a width. */
export function inset(outline, width) {
  const n = outline.length;
  const swept = outline.reduce((sum, p, k) => sum + p.cross(outline[(k + 1) % n]), 0);
  const around = swept > 0 ? 1 : -1; // anticlockwise or not
  return outline.map((corner, k) => {
    const [before, after] = [outline[(k + n - 1) % n], outline[(k + 1) % n]];
    const inward = [before.clone().sub(corner), corner.clone().sub(after)].map(({ x, y }) =>
      new THREE.Vector2(y, -x).normalize(),
    ); // to the left of both edges of an anticlockwise outline, which are gone along backwards
    const middle = inward[0].clone().add(inward[1]).normalize();
    return corner.clone().addScaledVector(middle, (around * width) / Math.max(middle.dot(inward[0]), 0.5));
  });
}

const SLENDER = 8; // length over width from which a shape has a line along it, seen where it is thinner than a pixel
const RIM = 0.035; // width of a rim that is part of the picture, relative to the reach of the shape
const DIGITS = 6; // shapes that agree so far share their geometry
const kept = new Map(); // shape -> its areas

/** The ends of the middle line of a slender outline, or null. */
function longest(outline) {
  const [xs, ys] = [outline.map(({ x }) => x), outline.map(({ y }) => y)];
  const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  if (Math.max(x1 - x0, y1 - y0) < SLENDER * Math.min(x1 - x0, y1 - y0)) return null;
  const [x, y] = [(x0 + x1) / 2, (y0 + y1) / 2];
  const ends = x1 - x0 > y1 - y0 ? [[x0, y], [x1, y]] : [[x, y0], [x, y1]];
  return ends.map(([a, b]) => new THREE.Vector2(a, b));
}

/** Areas of a shape about its position, shared by all shapes that are alike: the whole, and what its rim leaves. */
export function sharedAreas(shape) {
  const { kind, size, outline, quaternion } = shape;
  const round = (key, x) => (typeof x === "number" ? Number(x.toPrecision(DIGITS)) : x);
  const key = JSON.stringify([kind, size, outline, quaternion], round);
  if (!kept.has(key)) {
    const rim = silhouette({ ...shape, position: [0, 0, 0] });
    const reach = Math.max(...rim.map((p) => p.distanceTo(rim[0])));
    const areas = { whole: area(rim), inner: area(inset(rim, RIM * reach)), width: RIM * reach };
    areas.line = longest(rim);
    if (looksRound(shape)) {
      areas.mark = new THREE.PlaneGeometry(0.8 * size[0], areas.width).translate(0.4 * size[0], 0, 0);
    }
    kept.set(key, areas);
  }
  return kept.get(key);
}

/** One of many bodies: areas that are drawn together with those of other bodies (`batches.js`), and no strokes. */
function simpleBody(body, colour, order) {
  const [group, shade] = [new THREE.Group(), new THREE.Group()];
  const [paint, rim] = [flatMaterial({ color: colour }), flatMaterial({ color: colour })];
  const dusk = flatMaterial({ color: "#0a1420", opacity: 0.12 });
  const put = (parent, drawn, { position: [x, y] }) => {
    drawn.position.set(x, y, 0);
    parent.add(drawn);
  };
  const filled = (geometry, material, renderOrder) =>
    Object.assign(new THREE.Mesh(geometry, material), { renderOrder });
  for (const shape of body.shapes) {
    const { whole, inner, mark, line } = sharedAreas(shape);
    if (line) put(group, Object.assign(new THREE.Group(), { userData: { line, color: rim.color, order } }), shape);
    put(group, filled(whole, rim, order), shape);
    put(group, filled(inner, paint, order + 1), shape);
    put(shade, filled(whole, dusk, ORDER.shadow), shape);
    if (mark) put(group, filled(mark, rim, order + 2), shape);
  }
  const retheme = (theme) => {
    rim.color.copy(outlineColour(colour, theme));
    dusk.opacity = theme.flatShadow;
  };
  const glow = (on) => paint.color.set(colour).lerp(new THREE.Color("#ffffff"), on ? 0.18 : 0);
  return { group, shade, retheme, glow };
}

/** A planar body. All outlines lie under all fills, so that overlapping shapes read as one. */
export function flatBody(body, colour, index) {
  const group = new THREE.Group();
  const shade = new THREE.Group();
  const order = body.ground ? ORDER.floor : ORDER.body + 3 * index;
  const simple = !FINENESS.fine && !body.ground && body.shapes.every(({ hole, kind }) => !hole && kind !== "mesh");
  if (simple) return simpleBody(body, colour, order);
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
