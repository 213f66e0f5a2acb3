// The picture as vectors (SVG): faces and strokes from back to front, each in one colour.
import * as THREE from "three";

const LIGHT = new THREE.Vector3(-0.45, -0.75, 1.5).normalize();
const SHADE = { ambient: 0.42, key: 0.62 };
const TINY = 0.12; // twice the area of a face in square pixels that is left out: strokes close the gaps
const FACING = 12; // steps of a normal's components: faces of a shape that face alike are one path

/** Everything below an object that is seen, with its matrix in the world up to date. */
function seen(root) {
  const out = [];
  root.updateMatrixWorld(true);
  root.traverseVisible((object) => object.isMesh && object.material.color && out.push(object));
  return out;
}

/** Projects points of the world to pixels, with their depth. */
class Eye {
  constructor({ camera, size }) {
    camera.updateMatrixWorld();
    Object.assign(this, { camera, size });
  }

  see(point) {
    const depth = -point.clone().applyMatrix4(this.camera.matrixWorldInverse).z;
    const { x, y } = point.project(this.camera);
    return { x: ((x + 1) / 2) * this.size[0], y: ((1 - y) / 2) * this.size[1], depth };
  }
}

const text = ({ x, y }) => `${x.toFixed(1)} ${y.toFixed(1)}`;
const mean = (points) => points.reduce((sum, { depth }) => sum + depth, 0) / points.length;

/** A stroke: segments that follow one another are one path. */
function* strokes(object, eye) {
  const { instanceStart: from, instanceEnd: to } = object.geometry.attributes;
  const count = Math.min(object.geometry.instanceCount, from.count);
  let [d, before, ends] = ["", null, []];
  for (let k = 0; k < count; k++) {
    const [a, b] = [from, to].map((side) => eye.see(new THREE.Vector3().fromBufferAttribute(side, k).applyMatrix4(object.matrixWorld)));
    d += text(a) === before ? `L${text(b)}` : `M${text(a)}L${text(b)}`;
    before = text(b);
    ends.push(a, b);
  }
  const { color, linewidth, opacity } = object.material;
  if (d) yield { order: object.renderOrder, depth: mean(ends), look: `fill="none" stroke="${color.getStyle()}" stroke-width="${linewidth}" opacity="${opacity}"`, d };
}

/** The faces of a mesh at one place: those that face alike are one path. */
function* faces({ geometry, material, renderOrder }, matrix, colour, eye) {
  const { position } = geometry.attributes;
  const corner = (k) => new THREE.Vector3().fromBufferAttribute(position, geometry.index ? geometry.index.getX(k) : k).applyMatrix4(matrix);
  const flat = material.isMeshBasicMaterial;
  const paths = new Map();
  for (let k = 0; k + 2 < (geometry.index ?? position).count; k += 3) {
    const points = [corner(k), corner(k + 1), corner(k + 2)];
    const [a, b, c] = points;
    const normal = b.clone().sub(a).cross(c.clone().sub(a)).normalize();
    const [p, q, r] = points.map((point) => eye.see(point));
    const turn = (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x); // y points down: below zero towards us
    if (Math.abs(turn) < TINY || (material.side !== THREE.DoubleSide && turn < 0 !== (material.side === THREE.FrontSide))) continue;
    const key = flat ? "" : normal.toArray().map((x) => Math.round(FACING * x)).join();
    if (!paths.has(key)) paths.set(key, { normal: turn < 0 ? normal : normal.negate(), corners: [], d: "" });
    const path = paths.get(key);
    path.corners.push(p, q, r);
    path.d += `M${text(p)}L${text(q)} ${text(r)}Z`;
  }
  for (const { normal, corners, d } of paths.values()) {
    const light = flat ? 1 : SHADE.ambient + SHADE.key * Math.max(normal.dot(LIGHT), 0);
    const style = colour.clone().multiplyScalar(light).getStyle();
    yield { order: renderOrder, depth: mean(corners), look: `fill="${style}" stroke="${style}" stroke-width="0.7" opacity="${material.opacity}"`, d };
  }
}

function* drawn(object, eye) {
  if (object.isLineSegments2) return yield* strokes(object, eye);
  if (!object.isInstancedMesh) return yield* faces(object, object.matrixWorld, object.material.color, eye);
  for (let k = 0; k < object.count; k++) {
    const [matrix, colour] = [new THREE.Matrix4(), object.material.color.clone()];
    object.getMatrixAt(k, matrix);
    if (object.instanceColor) colour.multiply(new THREE.Color().fromArray(object.instanceColor.array, 3 * k));
    if (matrix.determinant()) yield* faces(object, matrix.premultiply(object.matrixWorld), colour, eye);
  }
}

/** The picture of a stage as the text of an SVG file: in the plane in the painter's order, in space by depth. */
export function vectorPicture(stage, ground) {
  const eye = new Eye(stage);
  const { mechanism, planar, size } = stage;
  const sorted = (root) => {
    const parts = seen(root).flatMap((object) => [...drawn(object, eye)]);
    return parts.sort((a, b) => (planar ? a.order - b.order : 0) || b.depth - a.depth);
  };
  const paths = [...sorted(mechanism.root), ...sorted(mechanism.overlay)].map(({ look, d }) => `<path ${look} d="${d}"/>`);
  const [width, height] = size;
  return [
    `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}" stroke-linejoin="round" stroke-linecap="round">`,
    `<rect width="100%" height="100%" fill="${ground}"/>`,
    ...paths,
    "</svg>",
  ].join("\n");
}
