// A round tube through points that move: ropes.
import * as THREE from "three";

const SIDES = 8;
const MOST_SAG = 0.45; // of the distance between two points

/**
 * Points along a rope over fixed points. A rope longer than they are apart, by the factor `excess`, hangs between each
 * two of them in a parabola of the same length: to second order its sag is sqrt(3/8 d (l - d)).
 */
export function hang(ends, excess, down, samples) {
  const out = [];
  for (let k = 1; k < ends.length; k++) {
    const [a, b] = [ends[k - 1], ends[k]];
    const distance = a.distanceTo(b);
    const sag = Math.min(Math.sqrt(0.375 * Math.max(excess - 1, 0)), MOST_SAG) * distance;
    for (let i = k === 1 ? 0 : 1; i <= samples; i++) {
      const s = i / samples;
      out.push(
        a
          .clone()
          .lerp(b, s)
          .addScaledVector(down, 4 * sag * s * (1 - s)),
      );
    }
  }
  return out;
}

const [tangent, normal, binormal, arm] = Array.from({ length: 4 }, () => new THREE.Vector3());

export class Tube {
  /** A tube through a number of points, to be laid anew whenever they move. */
  constructor(count) {
    this.count = count;
    this.geometry = new THREE.BufferGeometry();
    for (const name of ["position", "normal"]) {
      const attribute = new THREE.BufferAttribute(new Float32Array(3 * count * (SIDES + 1)), 3);
      this.geometry.setAttribute(name, attribute.setUsage(THREE.DynamicDrawUsage));
    }
    const faces = [];
    for (let k = 0; k < count - 1; k++)
      for (let s = 0; s < SIDES; s++) {
        const a = k * (SIDES + 1) + s;
        const b = a + SIDES + 1;
        faces.push(a, a + 1, b, b, a + 1, b + 1);
      }
    this.geometry.setIndex(faces);
  }

  /** Lay it through points, with a radius; the normal is carried along, so that the tube does not twist. */
  lay(points, radius) {
    const { position, normal: normals } = this.geometry.attributes;
    normal.set(0, 0, 1);
    for (let k = 0; k < this.count; k++) {
      tangent.subVectors(points[Math.min(k + 1, this.count - 1)], points[Math.max(k - 1, 0)]).normalize();
      normal.addScaledVector(tangent, -normal.dot(tangent));
      if (normal.lengthSq() < 1e-6) normal.set(1, 0, 0).addScaledVector(tangent, -tangent.x);
      if (normal.lengthSq() < 1e-6) normal.set(0, 1, 0).addScaledVector(tangent, -tangent.y);
      normal.normalize();
      binormal.crossVectors(tangent, normal);
      for (let s = 0; s <= SIDES; s++) {
        const angle = (2 * Math.PI * s) / SIDES;
        arm.copy(normal).multiplyScalar(Math.cos(angle)).addScaledVector(binormal, Math.sin(angle));
        const v = k * (SIDES + 1) + s;
        normals.setXYZ(v, arm.x, arm.y, arm.z);
        const p = points[k];
        position.setXYZ(v, p.x + radius * arm.x, p.y + radius * arm.y, p.z + radius * arm.z);
      }
    }
    position.needsUpdate = true;
    normals.needsUpdate = true;
    this.geometry.computeBoundingSphere(); // for the pointer
  }
}
