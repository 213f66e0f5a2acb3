// Lines through moving points: springs, dampers, rods, ropes and arrows, in space and in the plane.
import * as THREE from "three";
import { pointAt, mixed, sampleNumbers } from "./data.js";
import { Coil, coilFor } from "./coil.js";
import { ORDER } from "./flats.js";
import { Look } from "./look.js";
import { hang, Tube } from "./tube.js";

const Z = new THREE.Vector3(0, 0, 1);
const SLIM = { spring: 0.036, damper: 0.03, link: 0.014, rope: 0.008, arrow: 0.014 }; // radius over typical length
const LOOSE = 0.55; // thickness of a slack rope, as part of that of a taut one
const ALONG = 12; // samples between two points of a rope

/** The shortest and the longest a line between two points ever is. */
function lengthRange([a, b], count) {
  const [p, q] = [new THREE.Vector3(), new THREE.Vector3()];
  const lengths = sampleNumbers(count, 2000)
    .map((i) => pointAt(a, { i, j: i, f: 0 }, p).distanceTo(pointAt(b, { i, j: i, f: 0 }, q)))
    .filter(Number.isFinite);
  return lengths.length ? [Math.min(...lengths), Math.max(...lengths)] : [0, 0];
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

const DRAWERS = {
  spring,
  damper,
  arrow: (look, parent, radius) => look.arrow(parent, radius, "load"),
  link: (look, parent, radius) => {
    const bar = look.bar(parent, radius, "steel");
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
  const radius = line.radius ?? SLIM[line.kind] * unit;
  const drawn =
    line.kind === "rope" ? rope(line, recording, look, radius) : straight(line, recording, look, radius, unit);
  return { name: line.name, ...drawn, retheme: (theme) => look.retheme(theme), glow: (on) => look.glow(on) };
}

/** A line between two points, drawn along z and stretched. */
function straight(line, recording, look, radius, unit) {
  const group = new THREE.Group();
  const range = lengthRange(line.points, recording.t.length);
  const setters = [DRAWERS[line.kind](look, group, radius, range)];
  if (recording.planar && (line.kind === "spring" || line.kind === "damper"))
    setters.push(eyes(look, group, 0.011 * unit));
  const [a, b] = [new THREE.Vector3(), new THREE.Vector3()];
  const update = (frame) => {
    pointAt(line.points[0], frame, a);
    const length = pointAt(line.points[1], frame, b).sub(a).length();
    group.visible = length > 1e-9 * unit;
    if (!group.visible) return;
    group.position.copy(a);
    aim(group, b.divideScalar(length), recording.planar);
    for (const set of setters) set(length);
  };
  return { group, update };
}

/** A rope over several points: taut along straight lines; where it is longer than them it hangs, and is thinner. */
function rope(line, recording, look, radius) {
  const group = new THREE.Group();
  const ends = line.points.map(() => new THREE.Vector3());
  const tube = new Tube(ALONG * (ends.length - 1) + 1);
  group.add(look.mesh(tube.geometry, look.material("rope"), 1));
  const down = new THREE.Vector3(...recording.down);
  if (!down.lengthSq()) down.set(0, recording.planar ? -1 : 0, recording.planar ? 0 : -1);
  const state = { slack: false };
  const update = (frame) => {
    line.points.forEach((p, k) => pointAt(p, frame, ends[k]));
    const length = ends.reduce((sum, p, k) => (k ? sum + p.distanceTo(ends[k - 1]) : 0), 0);
    const rest = line.rest ? mixed(line.rest, frame) : 0;
    state.slack = length < rest * (1 - 1e-9);
    group.visible = Number.isFinite(length);
    if (group.visible)
      tube.lay(hang(ends, state.slack ? rest / length : 1, down, ALONG), radius * (state.slack ? LOOSE : 1));
  };
  return { group, update, state };
}

const [across, up] = [new THREE.Vector3(), new THREE.Vector3()];
const basis = new THREE.Matrix4();

/** Turn an object so that its z axis points along a unit vector; in the plane its y axis stays normal to the page. */
export function aim(object, direction, planar) {
  if (!planar) return object.quaternion.setFromUnitVectors(Z, direction);
  across.crossVectors(up.set(0, 0, -1), direction);
  return object.quaternion.setFromRotationMatrix(basis.makeBasis(across, up, direction));
}
