// How far a slider travels: found from the motion, since a recorded joint names one body only.
import * as THREE from "three";
import { poseAt, sampleNumbers } from "./data.js";

const SAMPLES = 60;

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

/** Travel of a body along an axis through a point of the carrier, or null if it moves otherwise. */
function travelOf(poses, origin, axis, kind, size) {
  const offsets = poses.map(({ p }) => p.clone().sub(poses[0].p));
  const along = offsets.map((d) => d.dot(axis));
  const strays = offsets.some((d, k) => d.addScaledVector(axis, -along[k]).length() > 2e-3 * size);
  const turns = kind === "prismatic" && poses.some(({ q }) => Math.abs(q.dot(poses[0].q)) < 1 - 1e-5);
  if (strays || turns || !along.every(Number.isFinite)) return null;
  const start = poses[0].p.clone().sub(origin);
  const first = start.dot(axis);
  const miss = start.addScaledVector(axis, -first).length();
  const range = [first + Math.min(...along), first + Math.max(...along)];
  return range[1] - range[0] > 1e-4 * size ? { range, miss, first } : null;
}

/**
 * The body that slides in a joint, its pose relative to the carrier at the start, and the stretch of the joint's axis
 * (measured from the joint's point) over which its origin moves; null if no body is seen to slide.
 */
export function sliderTravel(joint, recording, size) {
  const carrier = recording.bodies.find((body) => body.name === joint.body) ?? null;
  const numbers = sampleNumbers(recording.t.length, SAMPLES);
  const origin = new THREE.Vector3(...joint.position);
  const axis = new THREE.Vector3(...joint.axis).normalize();
  const found = recording.bodies
    .filter((body) => body !== carrier)
    .map((body) => {
      const poses = relativePoses(body, carrier, numbers);
      return { body, pose: poses[0], ...travelOf(poses, origin, axis, joint.kind, size) };
    })
    .filter(({ range, miss }) => range && miss < 0.5 * size)
    .sort((a, b) => a.miss + Math.abs(a.first) - b.miss - Math.abs(b.first));
  return found[0] ?? null;
}
