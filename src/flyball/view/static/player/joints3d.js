// Symbols of joints in space: dark metal parts that ride on their body; a stand under those fixed to ground.
import * as THREE from "three";
import { cylinderGeometry } from "./solids.js";
import { sliderTravel } from "./travel.js";

const Z = new THREE.Vector3(0, 0, 1);

const PARTS = {
  revolute: (u) => [cylinderGeometry(0.026 * u, 0.11 * u), flange(u, 0.045), flange(u, -0.045)],
  cylindrical: (u, [from, to]) => [cylinderGeometry(0.017 * u, to - from).translate(0, 0, (from + to) / 2)],
  prismatic: (u, [from, to]) => [
    new THREE.RoundedBoxGeometry(0.036 * u, 0.036 * u, to - from, 2, 0.004 * u).translate(0, 0, (from + to) / 2),
  ],
  spherical: (u) => [new THREE.SphereGeometry(0.037 * u, 36, 24)],
  universal: (u) => [
    cylinderGeometry(0.014 * u, 0.12 * u).rotateX(Math.PI / 2),
    cylinderGeometry(0.014 * u, 0.12 * u).rotateY(Math.PI / 2),
    new THREE.SphereGeometry(0.026 * u, 32, 20),
  ],
  fixed: (u) => [new THREE.RoundedBoxGeometry(0.06 * u, 0.06 * u, 0.06 * u, 2, 0.007 * u)],
};

const nearer = { polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1 }; // wins where faces coincide

function flange(u, at) {
  return cylinderGeometry(0.036 * u, 0.016 * u).translate(0, 0, at * u);
}

/** A four-sided stand with a base plate, tip at the joint, upright in the world. */
function stand(u) {
  const leg = new THREE.CylinderGeometry(0.016 * u, 0.062 * u, 0.1 * u, 4, 1).rotateY(Math.PI / 4);
  leg.rotateX(Math.PI / 2).translate(0, 0, -0.056 * u);
  const plate = new THREE.RoundedBoxGeometry(0.16 * u, 0.16 * u, 0.018 * u, 2, 0.005 * u).translate(0, 0, -0.113 * u);
  return [leg.toNonIndexed(), plate];
}

/** The symbol of a joint; it is to be added to the body the joint rides on (or to the world). */
export function solidJoint(joint, recording, unit) {
  const group = new THREE.Group();
  const dark = new THREE.MeshStandardMaterial({ color: "#3a4450", roughness: 0.35, metalness: 0.1, ...nearer });
  const grey = new THREE.MeshStandardMaterial({ color: "#8d97a3", roughness: 0.7, flatShading: true });
  const slides = joint.kind === "prismatic" || joint.kind === "cylindrical";
  const travel = (slides && sliderTravel(joint, recording, unit)?.range) || [0, 0];
  const margin = joint.kind === "cylindrical" ? 0.12 * unit : 0.1 * unit;
  const symbol = new THREE.Group();
  for (const part of PARTS[joint.kind](unit, [travel[0] - margin, travel[1] + margin])) {
    symbol.add(new THREE.Mesh(part, dark));
  }
  symbol.quaternion.setFromUnitVectors(Z, new THREE.Vector3(...joint.axis).normalize());
  group.add(symbol);
  if (joint.body === "ground") for (const part of stand(unit)) group.add(new THREE.Mesh(part, grey));
  group.position.set(...joint.position);
  group.traverse((object) => Object.assign(object, { castShadow: true, receiveShadow: true }));
  const retheme = (theme) => dark.color.set(theme.metal);
  return { group, retheme };
}
