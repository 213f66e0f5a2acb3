// Contact forces as arrows, all at once; green where bodies stick, amber where they slip.
import * as THREE from "three";
import { flatMaterial, ORDER } from "./flats.js";
import { sampleNumbers } from "./data.js";

const TONES = ["stick", "slip"];
const SAMPLED = 20000;
const USUALLY = 0.99;
const THIN = 0.22; // largest radius over length
const HEAD = [3.2, 6.5]; // radius and length of a head over the radius of its shaft

export class Touches {
  /** The contacts of a recording (see payload.py), drawn with arrows of a radius. */
  constructor(data, radius, planar) {
    Object.assign(this, { data, radius, planar, on: false, last: -1 });
    this.root = new THREE.Group();
    const { begin } = data;
    this.most = 1;
    for (let i = 1; i < begin.length; i++) this.most = Math.max(this.most, begin[i] - begin[i - 1]);
    this.total = begin.at(-1);
    this.#measure();
    const [shaft, head] = planar
      ? [new THREE.PlaneGeometry(1, 2).translate(0.5, 0, 0), flatHead()]
      : [
          new THREE.CylinderGeometry(1, 1, 1, 10).rotateZ(-Math.PI / 2).translate(0.5, 0, 0),
          new THREE.ConeGeometry(1, 1, 14).rotateZ(-Math.PI / 2).translate(0.5, 0, 0),
        ];
    this.meshes = [shaft, head].map((geometry) => {
      const look = { color: "#ffffff" };
      const material = planar
        ? flatMaterial(look)
        : new THREE.MeshStandardMaterial({ ...look, roughness: 0.4, metalness: 0.1 });
      const mesh = new THREE.InstancedMesh(geometry, material, this.most);
      mesh.instanceMatrix.setUsage(THREE.DynamicDrawUsage);
      mesh.setColorAt(0, new THREE.Color("#ffffff"));
      this.root.add(mesh);
      return Object.assign(mesh, { frustumCulled: false, count: 0, renderOrder: ORDER.arrow + 5e4 });
    });
    this.tones = TONES.map(() => new THREE.Color());
  }

  /** What arrows usually stay below [N]. */
  #measure() {
    const v = new THREE.Vector3();
    const all = sampleNumbers(this.total, SAMPLED)
      .map((k) => this.force(k, v).length())
      .sort((a, b) => a - b);
    this.usual = all[Math.floor(USUALLY * (all.length - 1))] ?? 0;
  }

  /** Of contacts that stick and of those that slip the largest force [N]. */
  peaks() {
    const v = new THREE.Vector3();
    const most = TONES.map(() => 0);
    for (const k of sampleNumbers(this.total, 10 * SAMPLED)) {
      const tone = this.data.state[k] === 1 ? 1 : 0;
      most[tone] = Math.max(most[tone], this.force(k, v).length());
    }
    return TONES.map((name, k) => [name, most[k]]).filter(([, force]) => force > 0);
  }

  force(k, out) {
    const { force, largest } = this.data;
    const at = (c) => {
      const root = force[k + c * this.total] / 32767 - 1;
      return Math.sign(root) * root * root * largest;
    };
    return out.set(at(0), at(1), at(2));
  }

  point(k, out) {
    const { point, low, step } = this.data;
    return out.set(
      low[0] + step * point[k],
      low[1] + step * point[k + this.total],
      low[2] + step * point[k + 2 * this.total],
    );
  }

  /** Rows of the picture that is nearest. */
  rows({ i, j, f }) {
    const picture = f < 0.5 ? i : j;
    return [this.data.begin[picture], this.data.begin[picture + 1]];
  }

  /** Draw the arrows of a time; `scale` newtons make a metre, arrows below `least` metres are left out. */
  seek(frame, scale, least) {
    this.root.visible = this.on;
    if (!this.on || !(scale > 0)) return;
    const [from, to] = this.rows(frame);
    const [v, p, s, x] = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3(1, 0, 0)];
    const [q, matrix] = [new THREE.Quaternion(), new THREE.Matrix4()];
    let n = 0;
    for (let k = from; k < to; k++) {
      const size = this.force(k, v).length();
      const length = size / scale;
      if (!(length > least)) continue;
      q.setFromUnitVectors(x, v.divideScalar(size));
      const radius = Math.min(this.radius, (THIN * length) / HEAD[1]);
      const reach = HEAD[1] * radius;
      this.point(k, p);
      this.meshes[0].setMatrixAt(n, matrix.compose(p, q, s.set(length - reach, radius, radius)));
      p.addScaledVector(v, length - reach);
      const wide = HEAD[0] * radius;
      this.meshes[1].setMatrixAt(n, matrix.compose(p, q, s.set(reach, wide, wide)));
      const tone = this.tones[this.data.state[k] === 1 ? 1 : 0];
      for (const mesh of this.meshes) mesh.setColorAt(n, tone);
      n += 1;
    }
    for (const mesh of this.meshes) {
      mesh.count = n;
      mesh.instanceMatrix.needsUpdate = true;
      mesh.instanceColor.needsUpdate = true;
    }
  }

  /** The arrows of a time as numbers. */
  list(frame) {
    const v = new THREE.Vector3();
    const [from, to] = this.rows(frame);
    return Array.from({ length: to - from }, (_, k) => ({
      at: this.point(from + k, v).toArray(),
      vector: this.force(from + k, v).toArray(),
      state: TONES[this.data.state[from + k]] ?? "open",
    }));
  }

  retheme(theme) {
    TONES.forEach((name, k) => this.tones[k].set(theme[name]));
  }
}

function flatHead() {
  const corners = [
    [1, 0],
    [0, 1],
    [0, -1],
  ].map(([x, y]) => new THREE.Vector2(x, y));
  return new THREE.ShapeGeometry(new THREE.Shape(corners));
}
