// Symbols of joints in space: dark metal parts that ride on their body; a stand under those fixed to ground.
import * as THREE from "three";
import { gearShape, rackShape } from "./gearshape.js";
import { cylinderGeometry, extruded, FINENESS } from "./solids.js";
import { hangs } from "./travel.js";

const TURN = 2 * Math.PI;
const THREADS = [5, 60]; // turns of a thread that are drawn, at least and at most

/** How far the mate moves along the axis, with room at both ends. */
function along({ reach }, margin) {
  return reach ? [Math.min(reach[4], 0) - margin, Math.max(reach[5], 0) + margin] : [-margin, margin];
}

function rod(radius, [from, to]) {
  return cylinderGeometry(radius, to - from).translate(0, 0, (from + to) / 2);
}

function thread(u, joint) {
  const stretch = along(joint, 0.12 * u);
  const length = stretch[1] - stretch[0];
  const lead = joint.size[0] || 0.03 * u;
  const turns = Math.min(Math.max(length / Math.abs(lead), THREADS[0]), THREADS[1]) * Math.sign(lead);
  const count = Math.round(Math.abs(turns) * 18);
  const points = Array.from({ length: count + 1 }, (_, k) => {
    const angle = (TURN * turns * k) / count;
    const z = stretch[0] + (length * k) / count;
    return new THREE.Vector3(0.02 * u * Math.cos(angle), 0.02 * u * Math.sin(angle), z);
  });
  const helix = new THREE.TubeGeometry(new THREE.CatmullRomCurve3(points), count, 0.005 * u, 6);
  return [rod(0.018 * u, stretch), helix];
}

/** What a point or a body slides on: a thin slab over all the places where it comes. */
function slab(u, { reach }, radius = 0) {
  const room = 0.12 * u + radius;
  const [x0, x1, y0, y1] = reach ?? [0, 0, 0, 0];
  const box = new THREE.BoxGeometry(x1 - x0 + 2 * room, y1 - y0 + 2 * room, 0.008 * u);
  return box.translate((x0 + x1) / 2, (y0 + y1) / 2, -0.004 * u);
}

function flange(u, at) {
  return cylinderGeometry(0.036 * u, 0.016 * u).translate(0, 0, at * u);
}

/** A skate: a blade along z that stands on its point, thin across x. */
function blade(u) {
  const outline = [
    [-0.12, 0.012],
    [-0.09, 0],
    [0.09, 0],
    [0.12, 0.012],
    [0.12, 0.05],
    [-0.12, 0.05],
  ].map(([z, y]) => new THREE.Vector2(z * u, y * u));
  return [extruded(new THREE.Shape(outline), 0.01 * u).rotateY(-Math.PI / 2)];
}

const REACHING = ["cylindrical", "prismatic", "screw", "rail", "roller"]; // as long as their mate moves, or of a size
const kept = new Map(); // kind and size of a symbol -> its geometries, which equal symbols share

function partsOf(u, joint) {
  const { kind } = joint;
  const make = PARTS[kind] ?? PARTS.mark;
  if (REACHING.includes(kind)) return make(u, joint);
  const key = `${kind} ${u} ${FINENESS.fine}`;
  if (kept.size > 100) kept.clear();
  if (!kept.has(key)) kept.set(key, make(u));
  return kept.get(key);
}

const PARTS = {
  revolute: (u) => [cylinderGeometry(0.026 * u, 0.11 * u), flange(u, 0.045), flange(u, -0.045)],
  cylindrical: (u, joint) => [rod(0.017 * u, along(joint, 0.12 * u))],
  prismatic: (u, joint) => {
    const [from, to] = along(joint, 0.1 * u);
    const bar = new THREE.RoundedBoxGeometry(0.036 * u, 0.036 * u, to - from, 2, 0.004 * u);
    return [bar.translate(0, 0, (from + to) / 2)];
  },
  screw: thread,
  spherical: (u) => [new THREE.SphereGeometry(0.037 * u, FINENESS.sides(36), FINENESS.sides(24))],
  point: (u) => [new THREE.SphereGeometry(0.026 * u, 32, 20)],
  universal: (u) => [
    cylinderGeometry(0.014 * u, 0.12 * u),
    cylinderGeometry(0.014 * u, 0.12 * u).rotateY(Math.PI / 2),
    new THREE.SphereGeometry(0.026 * u, 32, 20),
  ],
  fixed: (u) => [new THREE.RoundedBoxGeometry(0.06 * u, 0.06 * u, 0.06 * u, 2, 0.007 * u)],
  rail: (u, joint) => [rod(0.012 * u, along(joint, 0.1 * u))],
  roller: (u, { size: [radius] }) => [cylinderGeometry(radius, 0.1 * u), cylinderGeometry(0.25 * radius, 0.13 * u)],
  knife_edge: blade,
  bushing: (u) => [new THREE.TorusGeometry(0.042 * u, 0.018 * u, 20, 48), cylinderGeometry(0.02 * u, 0.09 * u)],
  orientation: (u) =>
    [
      [0.1, 0.012, 0.012],
      [0.012, 0.1, 0.012],
      [0.012, 0.012, 0.1],
    ].map(([x, y, z]) => new THREE.BoxGeometry(x * u, y * u, z * u)),
  mark: (u) => [new THREE.OctahedronGeometry(0.034 * u)],
};

/** Wheels and bars that are the body itself: in its colour; dark marks show how they turn. */
const BODILY = {
  gear: (u, { size }) => [extruded(gearShape(size), Math.min(Math.max(0.22 * size[0], 0.02 * u), 0.1 * u)), null],
  rack: (u, { size, reach }) => [extruded(rackShape(size, reach[0], reach[1]), Math.min(0.3 * size[0], 0.1 * u)), null],
  wheel: (_, { size: [r] }) => [cylinderGeometry(r, 0.14 * r), holes(r)],
  ball: (_, { size: [r] }) => [
    new THREE.SphereGeometry(r, 48, 32),
    new THREE.TorusGeometry(0.985 * r, 0.022 * r, 10, 64),
  ],
};

function holes(r) {
  const one = (k) => {
    const angle = (TURN * k) / 5;
    const disc = new THREE.CylinderGeometry(0.15 * r, 0.15 * r, 0.144 * r, 24).rotateX(Math.PI / 2);
    return disc.translate(0.58 * r * Math.cos(angle), 0.58 * r * Math.sin(angle), 0);
  };
  return Array.from({ length: 5 }, (_, k) => one(k));
}

const STANDS = ["revolute", "prismatic", "cylindrical", "screw", "spherical", "universal", "fixed"];
const nearer = { polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1 }; // wins where faces coincide

/** A four-sided stand with a base plate, tip at the joint, upright in the world. */
function stand(u) {
  const leg = new THREE.CylinderGeometry(0.016 * u, 0.062 * u, 0.1 * u, 4, 1).rotateY(Math.PI / 4);
  leg.rotateX(Math.PI / 2).translate(0, 0, -0.056 * u);
  const plate = new THREE.RoundedBoxGeometry(0.16 * u, 0.16 * u, 0.018 * u, 2, 0.005 * u).translate(0, 0, -0.113 * u);
  return [leg.toNonIndexed(), plate];
}

/** The symbol of a joint; it is to be added to the body the joint rides on (or to the world). */
export function solidJoint(joint, recording, unit, index, colour) {
  const group = new THREE.Group();
  const u = joint.scale * unit;
  const dark = new THREE.MeshStandardMaterial({ color: "#3a4450", roughness: 0.35, metalness: 0.1, ...nearer });
  const symbol = new THREE.Group();
  const [w, x, y, z] = joint.quaternion;
  symbol.quaternion.set(x, y, z, w);
  const put = (geometry, material) => symbol.add(new THREE.Mesh(geometry, material));
  if (joint.kind === "plane") put(slab(u, joint), glass());
  else if (BODILY[joint.kind]) {
    const [geometry, marks] = BODILY[joint.kind](u, joint);
    const paint = new THREE.MeshStandardMaterial({ color: colour, roughness: 0.5, metalness: 0.08 });
    const shade = new THREE.MeshStandardMaterial({
      color: new THREE.Color(colour).multiplyScalar(0.3),
      roughness: 0.7,
    });
    put(geometry, paint);
    for (const mark of [marks ?? []].flat()) put(mark, shade);
  } else for (const part of partsOf(u, joint)) put(part, dark);
  group.add(symbol);
  if (joint.body === "ground" && STANDS.includes(joint.kind)) {
    const grey = new THREE.MeshStandardMaterial({ color: "#8d97a3", roughness: 0.7, flatShading: true });
    const base = new THREE.Group();
    for (const part of stand(Math.max(joint.scale, 0.6) * unit)) base.add(new THREE.Mesh(part, grey));
    if (hangs(joint, recording, new THREE.Vector3(0, 0, -1))) base.rotation.x = Math.PI;
    group.add(base);
  }
  group.position.set(...joint.position);
  group.traverse((object) => Object.assign(object, { castShadow: joint.kind !== "plane", receiveShadow: true }));
  const look = { theme: null, glowing: false };
  const paint = () => dark.color.set(look.glowing ? look.theme.accent : look.theme.metal);
  const retheme = (theme) => paint((look.theme = theme));
  const glow = (on) => look.theme && paint((look.glowing = on));
  return { group, retheme, glow };
}

function glass() {
  const clear = { transparent: true, opacity: 0.3, depthWrite: false, side: THREE.DoubleSide };
  return new THREE.MeshStandardMaterial({ color: "#8fa6bd", roughness: 0.5, ...clear });
}
