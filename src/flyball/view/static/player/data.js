// The recording as it arrives: a JSON header and one block of numbers, see payload.py.
import * as THREE from "three";
import { extendSet } from "./packed.js";

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

const LONGEST = 3000; // times of a recording that grows: earlier ones are forgotten

/** Columns of arrays with `from` and `more` rows, one after the other; the last `kept` rows of both. */
function joined(old, more, width, kept) {
  const [from, rows] = [old.length / width, more.length / width];
  const out = new old.constructor(width * kept);
  for (let k = 0; k < width; k++) {
    const column = out.subarray(k * kept, (k + 1) * kept);
    const first = Math.max(kept - rows, 0);
    column.set(old.subarray(k * from + from - first, (k + 1) * from));
    column.set(more.subarray(k * rows + rows - (kept - first), (k + 1) * rows), first);
  }
  return out;
}

/** The last row of columns, `count` times. */
function repeated(columns, width, count) {
  const rows = columns.length / width;
  return columns.constructor.from({ length: width * count }, (_, i) => columns[Math.floor(i / count) * rows + rows - 1]);
}

/** Put a recording's times in place of another one's, or after them; what it does not have stays, or is unknown. */
export function extendRecording(recording, chunk, restart) {
  const count = chunk.t.length;
  const kept = Math.min(count + (restart ? 0 : recording.t.length), LONGEST);
  const grown = (old, more, width) => (restart && more ? more : joined(restart ? more : old, more, width, kept));
  const named = (list, name) => list.find((item) => item.name === name);
  for (const body of recording.bodies) {
    const other = named(chunk.bodies, body.name) ?? { p: repeated(body.p, 3, count), q: repeated(body.q, 4, count) };
    Object.assign(body, { p: grown(body.p, other.p, 3), q: grown(body.q, other.q, 4) });
  }
  for (const line of recording.lines) {
    const other = named(chunk.lines, line.name);
    line.points = line.points.map((p, k) => grown(p, other?.points[k] ?? repeated(p, 3, count), 3));
    if (line.rest) line.rest = grown(line.rest, other?.rest ?? repeated(line.rest, 1, count), 1);
  }
  for (const channel of recording.channels) {
    const other = named(chunk.channels, channel.name);
    channel.values = grown(channel.values, other?.values ?? new Float32Array(count).fill(NaN), 1);
  }
  for (const set of recording.sets) extendSet(set, named(chunk.sets, set.name), restart, kept);
  recording.t = grown(recording.t, chunk.t, 1);
}
