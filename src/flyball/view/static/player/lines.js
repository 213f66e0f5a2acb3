// Lines between two moving points: springs, dampers, rods, ropes and arrows, in space and in the plane.
import * as THREE from "three";
import { pointAt, sampleNumbers } from "./data.js";
import { Coil, coilFor } from "./coil.js";
import { ORDER, flatMaterial } from "./flats.js";

const Z = new THREE.Vector3(0, 0, 1);
const SLIM = { spring: 0.05, damper: 0.035, link: 0.014, rope: 0.006, arrow: 0.014 }; // radius over typical length

/** The shortest and the longest a line ever is. */
function lengthRange({ a, b }, count) {
  const [p, q] = [new THREE.Vector3(), new THREE.Vector3()];
  const lengths = sampleNumbers(count, 2000)
    .map((i) => pointAt(a, { i, j: i, f: 0 }, p).distanceTo(pointAt(b, { i, j: i, f: 0 }, q)))
    .filter(Number.isFinite);
  return lengths.length ? [Math.min(...lengths), Math.max(...lengths)] : [0, 0];
}

/** How surfaces look: lit in space; flat with an ink rim (a slightly larger dark copy behind) in the plane. */
class Look {
  constructor(planar, unit, order) {
    Object.assign(this, { planar, rim: 0.004 * unit, order, paints: [] });
  }

  material(tone) {
    const options = { color: "#888888" };
    const material = this.planar
      ? flatMaterial(options)
      : new THREE.MeshStandardMaterial({ ...options, roughness: 0.38, metalness: 0.1 });
    this.paints.push({ material, tone });
    return material;
  }

  mesh(geometry, material, level = 0) {
    const mesh = new THREE.Mesh(geometry, material);
    Object.assign(mesh, { castShadow: true, receiveShadow: true, frustumCulled: false });
    mesh.renderOrder = this.planar ? this.order + level : 0;
    return mesh;
  }

  /** A round bar along z from 0 to 1, to be stretched; returns the setter of its extent. */
  bar(parent, radius, tone, level = 1) {
    const geometry = this.planar
      ? new THREE.PlaneGeometry(2, 1).rotateX(Math.PI / 2)
      : new THREE.CylinderGeometry(1, 1, 1, 24).rotateX(Math.PI / 2);
    geometry.translate(0, 0, 0.5);
    const parts = [[this.mesh(geometry, this.material(tone), level), 0]];
    if (this.planar && tone !== "rope") parts.push([this.mesh(geometry, this.material("rim"), level - 1), this.rim]);
    for (const [mesh] of parts) parent.add(mesh);
    return (from, to) => {
      for (const [mesh, rim] of parts) {
        mesh.visible = to > from;
        mesh.position.z = from - rim;
        mesh.scale.set(radius + rim, radius + rim, Math.max(to - from + 2 * rim, 1e-9));
      }
    };
  }

  retheme(theme) {
    for (const { material, tone } of this.paints) material.color.set(theme[tone]);
  }
}

function spring(look, parent, radius, [shortest, longest]) {
  const { turns, wire } = coilFor(shortest, longest, radius);
  const coils = [[new Coil(turns, radius, wire), look.material("steel"), 0]];
  if (look.planar) coils.push([new Coil(turns, radius, wire + 1.2 * look.rim), look.material("rim"), -1]);
  for (const [coil, material, level] of coils) {
    // In the plane the coil alone uses depth, so that its turns pass before and behind each other.
    if (look.planar)
      Object.assign(material, { depthTest: true, depthWrite: true, side: level ? THREE.BackSide : THREE.FrontSide });
    parent.add(look.mesh(coil.geometry, material, level + 2));
  }
  return (length) => coils.forEach(([coil]) => coil.update(length));
}

function damper(look, parent, radius, [shortest, longest]) {
  const housing = 0.5 * (0.35 * shortest + 0.65 * longest);
  const start = 0.12 * housing;
  const stub = look.bar(parent, 0.3 * radius, "steel");
  const rod = look.bar(parent, 0.3 * radius, "steel", 3);
  const tube = look.bar(parent, radius, "tube", 5);
  const collar = look.bar(parent, 1.12 * radius, "steel", 7);
  return (length) => {
    const end = Math.min(start + housing, 0.9 * length);
    stub(0, start);
    tube(start, end);
    collar(end - 0.1 * housing, end + 0.02 * housing);
    rod(end, length);
  };
}

function arrow(look, parent, radius) {
  const shaft = look.bar(parent, radius, "force");
  const head = look.planar
    ? new THREE.ShapeGeometry(
        new THREE.Shape(
          [
            [0, 1],
            [-1, 0],
            [1, 0],
          ].map(([x, y]) => new THREE.Vector2(x, y)),
        ),
      ).rotateX(Math.PI / 2)
    : new THREE.ConeGeometry(1, 1, 28).rotateX(Math.PI / 2).translate(0, 0, 0.5);
  const tip = look.mesh(head, look.material("force"), 2);
  parent.add(tip);
  return (length) => {
    const reach = Math.min(7 * radius, 0.6 * length);
    shaft(0, length - reach);
    tip.position.z = length - reach;
    const width = Math.min(2.6 * radius, 0.42 * reach);
    tip.scale.set(width, width, reach);
  };
}

const DRAWERS = {
  spring,
  damper,
  arrow,
  link(look, parent, radius) {
    const bar = look.bar(parent, radius, "steel");
    return (length) => bar(0, length);
  },
  rope(look, parent, radius) {
    const bar = look.bar(parent, radius, "rope");
    return (length) => bar(0, length);
  },
};

/** Round eyes at both ends of a planar line, where it is pinned. */
function eyes(look, parent, radius) {
  const circle = new THREE.CircleGeometry(1, 32).rotateX(-Math.PI / 2);
  const pair = ["rim", "steel"].map((tone, k) => [look.material(tone), radius + (k ? 0 : look.rim), 11 + k]);
  const ends = [0, 1].map(() =>
    pair.map(([material, size, level]) => {
      const mesh = look.mesh(circle, material, level);
      mesh.scale.setScalar(size);
      parent.add(mesh);
      return mesh;
    }),
  );
  return (length) => ends[1].forEach((mesh) => (mesh.position.z = length));
}

/** A recorded line, ready to be drawn at any time. */
export function buildLine(line, recording, unit, index) {
  const look = new Look(recording.planar, unit, ORDER.line + 20 * index);
  const group = new THREE.Group();
  const radius = line.radius ?? SLIM[line.kind] * unit;
  const range = lengthRange(line, recording.t.length);
  const setters = [DRAWERS[line.kind](look, group, radius, range)];
  if (recording.planar && (line.kind === "spring" || line.kind === "damper")) {
    setters.push(eyes(look, group, 0.011 * unit));
  }
  const [a, b] = [new THREE.Vector3(), new THREE.Vector3()];
  const update = (frame) => {
    pointAt(line.a, frame, a);
    const length = pointAt(line.b, frame, b).sub(a).length();
    group.visible = length > 1e-9 * unit;
    if (!group.visible) return;
    group.position.copy(a);
    aim(group, b.divideScalar(length), recording.planar);
    for (const set of setters) set(length);
  };
  return { name: line.name, group, update, retheme: (theme) => look.retheme(theme) };
}

const [across, up] = [new THREE.Vector3(), new THREE.Vector3()];
const basis = new THREE.Matrix4();

/** Turn an object so that its z axis points along a unit vector; in the plane its y axis stays normal to the page. */
function aim(object, direction, planar) {
  if (!planar) return object.quaternion.setFromUnitVectors(Z, direction);
  across.crossVectors(up.set(0, 0, -1), direction);
  return object.quaternion.setFromRotationMatrix(basis.makeBasis(across, up, direction));
}
