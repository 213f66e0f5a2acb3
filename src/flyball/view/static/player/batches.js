// Many equal solids of single bodies, joints and links: one instanced mesh in place of a mesh for each of them.
import * as THREE from "three";

const LEAST = 8; // meshes of one geometry that are drawn together

const joinable = ({ isMesh, isInstancedMesh, isLineSegments2, material }) =>
  isMesh && !isInstancedMesh && !isLineSegments2 && material.isMeshStandardMaterial && !material.transparent;

/** One geometry in one paint, where these meshes are, in their colours; the meshes themselves are not drawn. */
function batchOf(meshes) {
  const [{ geometry, material, castShadow, receiveShadow }] = meshes;
  const paint = material.clone();
  paint.color.set("#ffffff");
  const drawn = new THREE.InstancedMesh(geometry, paint, meshes.length);
  drawn.instanceMatrix.setUsage(THREE.DynamicDrawUsage);
  Object.assign(drawn, { castShadow, receiveShadow, frustumCulled: false });
  drawn.userData.meshes = meshes;
  for (const mesh of meshes) mesh.visible = false;
  return drawn;
}

export class Batches {
  /** The solids below an object that are drawn together from now on. */
  constructor(root) {
    const alike = new Map();
    root.traverse((object) => {
      if (!joinable(object)) return;
      const { uuid } = object.geometry;
      const key = `${uuid} ${object.material.roughness} ${object.material.side} ${object.castShadow}`;
      if (!alike.has(key)) alike.set(key, []);
      alike.get(key).push(object);
    });
    this.drawn = [...alike.values()].filter(({ length }) => length >= LEAST).map(batchOf);
    if (this.drawn.length) root.add(...this.drawn);
    this.root = root;
    this.nowhere = new THREE.Matrix4().makeScale(0, 0, 0);
    this.colour = new THREE.Color();
  }

  /** Take over where the meshes are, what is hidden, and colours; to be called before a picture is drawn. */
  update() {
    if (!this.drawn.length) return;
    this.root.updateMatrixWorld();
    for (const drawn of this.drawn) {
      drawn.userData.meshes.forEach((mesh, k) => {
        drawn.setMatrixAt(k, this.#hidden(mesh) ? this.nowhere : mesh.matrixWorld);
        drawn.setColorAt(k, this.colour.copy(mesh.material.color).add(mesh.material.emissive));
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
