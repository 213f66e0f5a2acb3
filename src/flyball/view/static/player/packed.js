// Poses of a set of bodies as they arrive: differences from picture to picture, see packing.py.
const TURN = (2 * Math.PI) / 65535; // a step of a rotation vector

/** Differences summed up; `width` numbers a picture. What overflows is meant to. */
function summed(changes, width) {
  const out = changes.slice(); // equal arrays are stored once, so this may not be ours
  for (let k = width; k < out.length; k++) out[k] += out[k - width];
  return out;
}

/** The set with its `grid` of positions and its rotation vectors `turned`, both x of all, then y, then z. */
export function unpacked(data) {
  data.grid ??= summed(data.p, 3 * data.count);
  data.turned ??= new Int16Array(summed(data.q, 3 * data.count).buffer);
  return data;
}

/** Orientations at a picture into `out`: x, y, z, w of each member. */
export function turnsAt({ turned, count }, picture, out) {
  for (let k = 0, at = 3 * count * picture; k < count; k++, at++) {
    const x = TURN * turned[at];
    const y = TURN * turned[at + count];
    const z = TURN * turned[at + 2 * count];
    const angle = Math.sqrt(x * x + y * y + z * z);
    const per = angle > 1e-9 ? Math.sin(angle / 2) / angle : 0.5;
    out[4 * k] = per * x;
    out[4 * k + 1] = per * y;
    out[4 * k + 2] = per * z;
    out[4 * k + 3] = Math.cos(angle / 2);
  }
  return out;
}

const LOOKED_AT = 1500; // members, of which a box is found
const STRAYS = 0.02; // part of them that may have gone astray at either end ...
const FAR = 2; // ... when they are so many times as far away as all others

/** Least and largest coordinates of the members' origins at a picture, those gone astray left out; or null. */
export function originsBox(data, picture) {
  const { count, grid, low, step } = unpacked(data);
  const every = Math.max(1, Math.floor(count / LOOKED_AT));
  const from = 3 * count * picture;
  const there = [];
  for (let k = 0; k < count; k += every) if (grid[from + k]) there.push(from + k);
  if (!there.length) return null;
  const ends = [0, 1, 2].map((c) => {
    const x = there.map((at) => low[c] + step * grid[at + c * count]).sort((a, b) => a - b);
    const away = Math.floor(STRAYS * x.length);
    const [first, last] = [x[away], x.at(-1 - away)];
    const reach = FAR * (last - first);
    return [x[0] < first - reach ? first : x[0], x.at(-1) > last + reach ? last : x.at(-1)];
  });
  return [ends.map(([first]) => first), ends.map(([, last]) => last)];
}

/** The last `kept` pictures of a set, and of more of it; all in the steps of the first. */
export function extendSet(set, more, restart, kept) {
  if (!more) return;
  unpacked(set);
  const { grid, turned } = unpacked(more);
  const width = 3 * set.count;
  const place = (value, k) => {
    const c = Math.floor((k % width) / set.count);
    return value ? (more.low[c] + more.step * value - set.low[c]) / set.step : 0;
  };
  const tail = (old, other, kind) => {
    const all = restart ? other : kind.from([...old, ...other]);
    return all.subarray(Math.max(all.length - width * kept, 0));
  };
  set.grid = tail(set.grid, Float64Array.from(grid, place), Float64Array);
  set.turned = tail(set.turned, turned, Int16Array);
}
