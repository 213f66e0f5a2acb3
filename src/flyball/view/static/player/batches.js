// Many equal parts of single bodies, joints and links: one instanced mesh in place of a mesh for each of them.
import * as THREE from "three";

const THIN = 1.6; // px
const LEAST = 8; // meshes of one geometry that are drawn together

/** Solids, and flat areas; not what is drawn in strokes, and not glass. */
function joinable({ isMesh, isInstancedMesh, isLineSegments2, material }) {
  if (!isMesh || isInstancedMesh || isLineSegments2) return false;
  return material.isMeshStandardMaterial ? !material.transparent : material.isMeshBasicMaterial && !material.depthTest;
}

/**
 * One geometry in one paint, where these meshes are, in their colours; the meshes themselves are not drawn.
 *
 * In the plane it has the place of the first in the painter's order.
 */
function batchOf(meshes) {
  const [{ geometry, material, castShadow, receiveShadow }] = meshes;
  const renderOrder = Math.min(...meshes.map((mesh) => mesh.renderOrder));
  const paint = material.clone();
  paint.color.set("#ffffff");
  const drawn = new THREE.InstancedMesh(geometry, paint, meshes.length);
  drawn.instanceMatrix.setUsage(THREE.DynamicDrawUsage);
  Object.assign(drawn, { castShadow, receiveShadow, renderOrder, frustumCulled: false });
  drawn.userData.meshes = meshes;
  for (const mesh of meshes) mesh.visible = false;
  return drawn;
}

/** Thin lines on bodies, as one object. */
class ThinLines {
  constructor(lines) {
    this.lines = lines;
    this.ends = new Float32Array(6 * lines.length);
    this.colours = new Float32Array(6 * lines.length);
    const geometry = new THREE.LineSegmentsGeometry().setPositions(this.ends).setColors(this.colours);
    const flat = { depthTest: false, depthWrite: false, transparent: true };
    const material = new THREE.LineMaterial({ vertexColors: true, linewidth: THIN, ...flat });
    this.drawn = Object.assign(new THREE.LineSegments2(geometry, material), { frustumCulled: false });
    this.drawn.renderOrder = Math.min(...lines.map(({ userData }) => userData.order));
  }

  /** Take over where the lines are; `hidden` says which are not seen. */
  update(hidden) {
    const { ends, colours, drawn } = this;
    const point = new THREE.Vector3();
    this.lines.forEach((line, k) => {
      const { line: both, color } = line.userData;
      both.forEach(({ x, y }, end) => {
        point.set(hidden(line) ? 0 : x, hidden(line) ? 0 : y, 0).applyMatrix4(line.matrixWorld).toArray(ends, 6 * k + 3 * end);
        color.toArray(colours, 6 * k + 3 * end);
      });
    });
    for (const [name, numbers] of [["instanceStart", ends], ["instanceColorStart", colours]]) {
      const { data } = drawn.geometry.attributes[name];
      data.array.set(numbers);
      data.needsUpdate = true;
    }
  }
}

export class Batches {
  /** The parts below an object that are drawn together from now on. */
  constructor(root) {
    const alike = new Map();
    const lines = [];
    root.traverse((object) => {
      if (object.userData.line) lines.push(object);
      if (!joinable(object)) return;
      const { uuid } = object.geometry;
      const { roughness, side, opacity } = object.material;
      const key = `${uuid} ${roughness} ${side} ${opacity} ${object.castShadow}`;
      if (!alike.has(key)) alike.set(key, []);
      alike.get(key).push(object);
    });
    this.drawn = [...alike.values()].filter(({ length }) => length >= LEAST).map(batchOf);
    if (this.drawn.length) root.add(...this.drawn);
    this.lines = lines.length ? new ThinLines(lines) : null;
    if (this.lines) root.add(this.lines.drawn);
    this.root = root;
    this.nowhere = new THREE.Matrix4().makeScale(0, 0, 0);
    this.colour = new THREE.Color();
  }

  /** Take over where the meshes are, what is hidden, and colours; to be called before a picture is drawn. */
  update() {
    if (!this.drawn.length && !this.lines) return;
    this.root.updateMatrixWorld();
    this.lines?.update((line) => this.#hidden(line));
    for (const drawn of this.drawn) {
      const { meshes } = drawn.userData;
      drawn.material.opacity = meshes[0].material.opacity;
      meshes.forEach((mesh, k) => {
        const { color, emissive } = mesh.material;
        drawn.setMatrixAt(k, this.#hidden(mesh) ? this.nowhere : mesh.matrixWorld);
        this.colour.copy(color);
        drawn.setColorAt(k, emissive ? this.colour.add(emissive) : this.colour);
      });
      drawn.instanceMatrix.needsUpdate = drawn.instanceColor.needsUpdate = true;
      drawn.boundingSphere = null; // found afresh when something is pointed at
    }
  }

  #hidden({ parent }) {
    for (let above = parent; above !== this.root; above = above.parent) if (!above.visible) return true;
    return false;
  }
}
