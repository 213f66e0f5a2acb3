// Solids of spatial bodies: one geometry for each kind of shape, edges softened so that they catch the light.
import * as THREE from "three";
import { sinks, THEMES } from "./theme.js";

const FEW = 300; // bodies up to which shapes and symbols are fine
/** Sides of what is round: fewer where bodies are many. */
export const FINENESS = { fine: true, sides: (n) => (FINENESS.fine ? n : Math.ceil(n / 4)) };
/** Choose the fineness for a number of bodies. */
export function refine(count) {
  FINENESS.fine = count <= FEW;
}
const PROUD = 1.004; // a hole is a dark plug that stands out by so little that only its openings show

/** A turned part along z from its profile of (radius, z) pairs, going up. */
function turned(profile) {
  const points = profile.map(([radius, z]) => new THREE.Vector2(Math.max(radius, 0), z));
  return new THREE.LatheGeometry(points, FINENESS.sides(72)).rotateX(Math.PI / 2);
}

/** A cylinder along z with chamfered rims; corners are doubled, so that faces stay flat. */
export function cylinderGeometry(radius, length, soft = 0.08) {
  const c = Math.min(radius, length) * soft;
  const h = length / 2;
  const corners = [
    [0, -h],
    [radius - c, -h],
    [radius, c - h],
    [radius, h - c],
    [radius - c, h],
    [0, h],
  ];
  const profile = corners.flatMap((corner, k) => (k === 0 || k === corners.length - 1 ? [corner] : [corner, corner]));
  return turned(profile);
}

/** A flat part along z, its edges softened. */
export function extruded(shape, thickness) {
  const bevel = thickness * 0.06;
  const geometry = new THREE.ExtrudeGeometry(shape, {
    depth: thickness - 2 * bevel,
    bevelThickness: bevel,
    bevelSize: bevel,
    bevelOffset: -bevel,
    bevelSegments: 2,
    curveSegments: 32,
  });
  return geometry.translate(0, 0, bevel - thickness / 2);
}

function plateGeometry(outline, thickness) {
  return extruded(new THREE.Shape(outline.map(([x, y]) => new THREE.Vector2(x, y))), thickness);
}

/** Columns x, y, z one after the other become triples. */
function triples(columns) {
  const n = columns.length / 3;
  return columns.map((_, k) => columns[(k % 3) * n + Math.floor(k / 3)]);
}

/** A mesh as it was recorded: shared corners, no normals. */
export function meshGeometry({ vertices, triangles }) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(triples(vertices), 3));
  return geometry.setIndex(new THREE.BufferAttribute(triples(triangles), 1));
}

const CREASE = 0.6; // rad; edges sharper than this are not smoothed over

const unitBall = () => new THREE.SphereGeometry(1, FINENESS.sides(48), FINENESS.sides(32)).rotateX(Math.PI / 2);

const MAKERS = {
  box: ([x, y, z]) => new THREE.RoundedBoxGeometry(x, y, z, FINENESS.sides(3), 0.06 * Math.min(x, y, z)),
  sphere: ([radius]) => unitBall().scale(radius, radius, radius),
  cylinder: ([radius, length]) => cylinderGeometry(radius, length),
  capsule: ([radius, length]) => new THREE.CapsuleGeometry(radius, length, FINENESS.sides(12), FINENESS.sides(36)).rotateX(Math.PI / 2),
  cone: ([radius, height]) => new THREE.ConeGeometry(radius, height, FINENESS.sides(48)).rotateX(Math.PI / 2),
  ellipsoid: ([a, b, c]) => unitBall().scale(a, b, c),
  plate: ([thickness], { outline }) => plateGeometry(outline, thickness),
  mesh: (_, shape) => THREE.toCreasedNormals(meshGeometry(shape), CREASE),
};

const MOST_KEPT = 500;
const kept = new Map(); // a shape's kind and size -> its geometry, which all bodies share

/** The geometry of a shape, in the shape's own axes. */
export function solidGeometry(shape) {
  const { kind, size, outline } = shape;
  if (kind === "mesh") return MAKERS.mesh(size, shape);
  const key = JSON.stringify([kind, size, outline, FINENESS.fine]);
  if (kept.size > MOST_KEPT) kept.clear();
  if (!kept.has(key)) kept.set(key, MAKERS[kind](size, shape));
  return kept.get(key);
}

/** Put an object where its shape says it sits on the body. */
export function placed(object, shape) {
  const [w, x, y, z] = shape.quaternion;
  object.position.set(...shape.position);
  object.quaternion.set(x, y, z, w);
  return object;
}

/** A small dark dimple near the rim of a wheel: without it one could not see the wheel turn. */
function spinMarks({ kind, size }, material) {
  if (kind !== "cylinder" || size[0] < 1.5 * size[1]) return [];
  const geometry = new THREE.CylinderGeometry(0.09 * size[0], 0.09 * size[0], 1.03 * size[1], 20).rotateX(Math.PI / 2);
  const mark = new THREE.Mesh(geometry.translate(0.72 * size[0], 0, 0), material);
  return [mark];
}

const EDGE = 0.012; // width of the edge around a dark shape, as part of its size

/** A lighter shell around a shape, of which only the inside is seen: an edge all around. */
function shell(geometry, material) {
  if (!geometry.boundingBox) geometry.computeBoundingBox();
  const size = geometry.boundingBox.getSize(new THREE.Vector3());
  const middle = geometry.boundingBox.getCenter(new THREE.Vector3());
  const width = 2 * EDGE * size.length();
  const mesh = new THREE.Mesh(geometry, material);
  mesh.scale.set(...size.toArray().map((x) => 1 + width / Math.max(x, 1e-12)));
  mesh.position.copy(middle).sub(middle.clone().multiply(mesh.scale));
  return mesh;
}

/** A spatial body: a group of lit meshes. */
export function solidBody(body, colour) {
  const group = new THREE.Group();
  const material = new THREE.MeshStandardMaterial({ color: colour, roughness: 0.48, metalness: 0.08 });
  const glass = body.opacity < 1;
  if (glass) Object.assign(material, { transparent: true, opacity: body.opacity, depthWrite: false });
  const dark = new THREE.MeshStandardMaterial({ color: colour, roughness: 0.7 });
  dark.color.multiplyScalar(0.3);
  const opening = new THREE.MeshStandardMaterial({ color: colour, roughness: 1 });
  opening.color.multiplyScalar(0.12);
  const shells = [];
  const light = new THREE.MeshBasicMaterial({ side: THREE.BackSide });
  for (const shape of body.shapes) {
    const holder = placed(new THREE.Group(), shape);
    if (shape.hole) {
      holder.add(new THREE.Mesh(solidGeometry(shape), opening));
      holder.children[0].scale.setScalar(PROUD);
    } else {
      const mesh = new THREE.Mesh(solidGeometry(shape), material);
      holder.add(mesh, ...spinMarks(shape, dark));
      if (!glass && sinks(colour, THEMES.dark)) shells.push([holder, shell(mesh.geometry, light)]);
    }
    group.add(holder);
  }
  group.traverse((object) => Object.assign(object, { castShadow: !glass, receiveShadow: !glass }));
  const retheme = (theme) => {
    light.color.set(theme.steel);
    for (const [holder, mesh] of shells) sinks(colour, theme) ? holder.add(mesh) : mesh.removeFromParent();
  };
  return { group, retheme, glow: (on) => material.emissive.set(colour).multiplyScalar(on ? 0.35 : 0) };
}

/** Points that enclose a shape, in the body's axes: the corners of its box. */
export function cornersOf(shape) {
  const geometry = shape.kind === "mesh" ? meshGeometry(shape) : solidGeometry(shape);
  if (!geometry.boundingBox) geometry.computeBoundingBox();
  const { min, max } = geometry.boundingBox;
  const frame = placed(new THREE.Group(), shape);
  frame.updateMatrix();
  const corners = [];
  for (const x of [min.x, max.x])
    for (const y of [min.y, max.y])
      for (const z of [min.z, max.z]) {
        corners.push(new THREE.Vector3(x, y, z).applyMatrix4(frame.matrix));
      }
  return corners;
}
