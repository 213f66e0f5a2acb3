// How bodies move about a joint: how far a slider travels, and whether a body hangs from its stand.
import * as THREE from "three";
import { poseAt, ridden, sampleNumbers } from "./data.js";
import { cornersOf } from "./solids.js";

const SAMPLES = 60;
const HANGING = 0.5; // mean direction down, as part of the distance, from which a body counts as hanging

/** Poses of a body relative to a carrier (null: the world) at the given samples. */
function relativePoses(body, carrier, numbers) {
  const [on, off] = [new THREE.Group(), new THREE.Group()];
  return numbers.map((i) => {
    const frame = { i, j: i, f: 0 };
    poseAt(body, frame, on);
    if (!carrier) return { p: on.position.clone(), q: on.quaternion.clone() };
    poseAt(carrier, frame, off);
    const back = off.quaternion.clone().invert();
    return { p: on.position.clone().sub(off.position).applyQuaternion(back), q: back.multiply(on.quaternion) };
  });
}

/**
 * The body that slides in a joint, its pose relative to the carrier at the start, and the stretch of the joint's axis
 * over which its origin moves, measured from where it is at the start; null if the joint does not say who slides.
 */
export function sliderTravel(joint, recording, size) {
  const carrier = recording.bodies.find((body) => body.name === joint.body) ?? null;
  const body = recording.bodies.find((candidate) => candidate.name === joint.mate);
  if (!body) return null;
  const poses = relativePoses(body, carrier, sampleNumbers(recording.t.length, SAMPLES));
  const origin = new THREE.Vector3(...joint.position);
  const axis = new THREE.Vector3(...joint.axis).normalize();
  const along = poses.map(({ p }) => p.clone().sub(origin).dot(axis)).filter(Number.isFinite);
  if (!along.length) return null;
  const range = [Math.min(...along), Math.max(...along)];
  if (range[1] - range[0] < 1e-4 * size) [range[0], range[1]] = [range[0] - 0.05 * size, range[1] + 0.05 * size];
  return { body, pose: poses[0], first: along[0], range };
}

/** Whether the body that a joint on ground holds is mostly on the side that `down` points to. */
export function hangs(joint, recording, down) {
  const body = recording.bodies.find((candidate) => candidate.name === joint.mate);
  const corners = body?.shapes.flatMap(cornersOf) ?? [];
  if (!corners.length) return false;
  const middle = corners.reduce((sum, p) => sum.add(p), new THREE.Vector3()).divideScalar(corners.length);
  const arms = ridden(body, middle.toArray(), sampleNumbers(recording.t.length, SAMPLES))
    .map((p) => p.sub(new THREE.Vector3(...joint.position)))
    .filter((p) => Number.isFinite(p.lengthSq()));
  const reach = arms.reduce((sum, p) => sum + p.length(), 0);
  return arms.reduce((sum, p) => sum + p.dot(down), 0) > HANGING * reach;
}
