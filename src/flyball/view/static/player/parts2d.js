// The drawing kit of planar symbols: discs, areas, lines and hatching, each in a colour of the theme.
import * as THREE from "three";
import { flatMaterial, stroke } from "./flats.js";
import { FINENESS } from "./solids.js";

export const at = (x, y) => new THREE.Vector2(x, y);

const discs = new Map(); // radius -> its geometry, which all discs share
function discGeometry(radius) {
  if (!discs.has(radius)) discs.set(radius, new THREE.CircleGeometry(radius, FINENESS.sides(48)));
  return discs.get(radius);
}

/** Collects the parts of one symbol, each with the theme's colour that it takes, or a colour of its own. */
export class Symbol2d {
  group = new THREE.Group();
  parts = [];

  add(object, tone) {
    this.parts.push([object.material, tone]);
    this.group.add(object);
    return object;
  }

  disc(radius, tone, order) {
    const mesh = new THREE.Mesh(discGeometry(radius), flatMaterial({}));
    return this.add(Object.assign(mesh, { renderOrder: order }), tone);
  }

  /** A filled area: corners, or a shape with holes. */
  area(outline, tone, order) {
    const shape = outline instanceof THREE.Shape ? outline : new THREE.Shape(outline);
    const mesh = new THREE.Mesh(new THREE.ShapeGeometry(shape, 48), flatMaterial({}));
    return this.add(Object.assign(mesh, { renderOrder: order }), tone);
  }

  line(points, tone, width, order, closed = false) {
    return this.add(stroke(points, { color: "#000000", width, order, closed }), tone);
  }

  /** Separate segments, drawn in one go. */
  segments(pairs, tone, width, order) {
    const positions = pairs.flatMap(([a, b]) => [a.x, a.y, 0, b.x, b.y, 0]);
    const geometry = new THREE.LineSegmentsGeometry().setPositions(positions);
    const flat = { depthTest: false, depthWrite: false, transparent: true };
    const material = new THREE.LineMaterial({ linewidth: width, ...flat });
    const object = new THREE.LineSegments2(geometry, material);
    return this.add(Object.assign(object, { renderOrder: order, frustumCulled: false }), tone);
  }

  /** Ground: a line from x0 to x1 with short strokes below it. */
  hatch(x0, x1, y, depth, order) {
    const count = Math.min(Math.max(3, Math.round((x1 - x0) / (0.8 * depth))), 400);
    const step = (x1 - x0) / count;
    const tick = (k) => [at(x0 + (k + 1) * step, y), at(x0 + (k + 1) * step - depth, y - depth)];
    const ticks = Array.from({ length: count }, (_, k) => tick(k));
    this.segments(ticks, "hatch", 1.3, order);
    this.line([at(x0, y), at(x1, y)], "ink", 2.2, order + 1);
  }

  /** Take in another symbol, as it lies. */
  include(other) {
    this.group.add(other.group);
    this.parts.push(...other.parts);
  }

  retheme(theme) {
    this.theme = theme;
    for (const [material, tone] of this.parts) material.color.set(theme[tone] ?? tone);
  }

  /** Light up, or not. */
  glow(on) {
    for (const [material, tone] of this.parts)
      if (tone === "ink" && this.theme) material.color.set(on ? this.theme.accent : this.theme.ink);
  }
}
