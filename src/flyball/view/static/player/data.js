// The recording as it arrives: a JSON header and one block of numbers, see payload.py.
import * as THREE from "three";

const ALIGNMENT = 8;

/** Undo the byte shuffle: all first bytes, then all second bytes, ... back to whole numbers. */
function unshuffled(bytes, width) {
  const count = bytes.length / width;
  const out = new Uint8Array(bytes.length);
  for (let plane = 0; plane < width; plane++) {
    for (let i = 0, from = plane * count; i < count; i++) out[i * width + plane] = bytes[from + i];
  }
  return out.buffer;
}

const NUMBERS = { f8: Float64Array, f4: Float32Array, u1: Uint8Array, u2: Uint16Array, u4: Uint32Array };

const isReference = (value) => Number.isInteger(value?.at) && Number.isInteger(value.count) && value.type in NUMBERS;

/** The recording with every reference to the block replaced by a typed array. */
export function readRecording(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const start = Math.ceil((4 + length) / ALIGNMENT) * ALIGNMENT;
  const read = new Map(); // equal arrays are stored, and kept, once
  const numbers = ({ at, count, type }) => {
    const key = `${type}${at}`;
    if (!read.has(key)) {
      const width = NUMBERS[type].BYTES_PER_ELEMENT;
      const bytes = new Uint8Array(buffer, start + at, count * width);
      read.set(key, new NUMBERS[type](unshuffled(bytes, width)));
    }
    return read.get(key);
  };
  const text = new TextDecoder().decode(new Uint8Array(buffer, 4, length));
  return JSON.parse(text, (_, value) => (isReference(value) ? numbers(value) : value));
}

/** Where a time lies among the samples: between sample i and j, the fraction f on the way. */
export function frameAt(times, time) {
  const last = times.length - 1;
  if (last === 0 || time <= times[0]) return { i: 0, j: 0, f: 0 };
  if (time >= times[last]) return { i: last, j: last, f: 0 };
  let low = 0;
  let high = last;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle;
    else high = middle;
  }
  const step = times[high] - times[low];
  return { i: low, j: high, f: step > 0 ? (time - times[low]) / step : 0 };
}

/** A scalar between its samples. */
export function mixed(values, { i, j, f }) {
  return f === 0 ? values[i] : values[i] + f * (values[j] - values[i]);
}

/** A point between its samples; the three columns x, y, z lie one after the other. */
export function pointAt(columns, { i, j, f }, out) {
  const n = columns.length / 3;
  const at = (k) => columns[k * n + i] + f * (columns[k * n + j] - columns[k * n + i]);
  return out.set(at(0), at(1), at(2));
}

const next = new THREE.Quaternion();

/** An orientation between its samples (columns w, x, y, z), on the shorter great arc. */
export function quaternionAt(columns, { i, j, f }, out) {
  const n = columns.length / 4;
  out.set(columns[n + i], columns[2 * n + i], columns[3 * n + i], columns[i]);
  if (f > 0) out.slerp(next.set(columns[n + j], columns[2 * n + j], columns[3 * n + j], columns[j]), f);
  return out.normalize();
}

/** At most `limit` sample numbers spread over the whole motion, the first and the last among them. */
export function sampleNumbers(count, limit) {
  const taken = Math.min(count, limit);
  return Array.from({ length: taken }, (_, k) => (taken === 1 ? 0 : Math.round((k * (count - 1)) / (taken - 1))));
}

/** The pose of an Object3D at one sample. */
export function poseAt(body, frame, object) {
  pointAt(body.p, frame, object.position);
  quaternionAt(body.q, frame, object.quaternion);
}

/** Points along a motion where something is that rides on a body at a place of its own. */
export function ridden(body, position, numbers) {
  const pose = new THREE.Group();
  return numbers.map((i) => {
    poseAt(body, { i, j: i, f: 0 }, pose);
    return new THREE.Vector3(...position).applyQuaternion(pose.quaternion).add(pose.position);
  });
}
