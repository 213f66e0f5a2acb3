// What many bodies of one shape look like: geometry as fine as their number allows, and paint that shows how they turn.
import * as THREE from "three";
import { ORDER, area, flatMaterial, inset, looksRound, silhouette } from "./flats.js";
import { placed, solidGeometry } from "./solids.js";
import { THEMES } from "./theme.js";

const FADED = 0.35;
const FEW = 150; // members up to which shapes are as fine as those of single bodies
const SHADED = 4e6; // triangles in all from which nothing throws a shadow
const FINENESS = [
  [2000, 28],
  [12000, 16],
  [40000, 10],
  [Infinity, 6],
]; // members, sides of a circle

function coarse(shape, sides) {
  const { kind, size } = shape;
  const [a, b, c] = size;
  const ball = () => new THREE.SphereGeometry(1, sides, Math.ceil(sides / 1.5)).rotateX(Math.PI / 2);
  if (kind === "sphere") return ball().scale(a, a, a);
  if (kind === "ellipsoid") return ball().scale(a, b, c);
  if (kind === "box" && sides >= 16) return new THREE.RoundedBoxGeometry(a, b, c, 1, 0.05 * Math.min(a, b, c));
  if (kind === "box") return new THREE.BoxGeometry(a, b, c);
  if (kind === "cylinder") return new THREE.CylinderGeometry(a, a, b, sides).rotateX(Math.PI / 2);
  if (kind === "capsule") return new THREE.CapsuleGeometry(a, b, Math.ceil(sides / 4), sides).rotateX(Math.PI / 2);
  if (kind === "cone") return new THREE.ConeGeometry(a, b, sides).rotateX(Math.PI / 2);
  return solidGeometry(shape).clone();
}

/** The geometry of a shape in the axes of its body. */
function geometryOf(shape, count) {
  const sides = FINENESS.find(([most]) => count <= most)[1];
  const fine =
    count <= FEW && shape.kind !== "sphere" ? solidGeometry(shape).clone() : coarse(shape, count <= FEW ? 44 : sides);
  const frame = placed(new THREE.Group(), shape);
  frame.updateMatrix();
  return fine.applyMatrix4(frame.matrix);
}

const BAND = `
  float across = abs(vOwn.z - uMiddle.z) / uSize;
  float edge = fwidth(across);
  diffuseColor.rgb = mix(diffuseColor.rgb, vec3(0.94), 0.62 * (1.0 - smoothstep(0.3 - edge, 0.3 + edge, across)));`;
const HALF = `
  float side = (vOwn.x - uMiddle.x) / uSize;
  diffuseColor.rgb *= 1.0 - 0.2 * smoothstep(-fwidth(side), fwidth(side), side);`;

/** Paint in two tones where only they show how something turns: a band around balls, one half of what is round. */
function paint(shape) {
  const material = new THREE.MeshStandardMaterial({ color: "#ffffff", roughness: 0.42, metalness: 0.04 });
  const pattern = { sphere: BAND, ellipsoid: BAND, cylinder: HALF, capsule: HALF, cone: HALF }[shape.kind];
  if (!pattern) return material;
  const size = shape.kind === "ellipsoid" ? shape.size[2] : shape.size[0];
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, {
      uSize: { value: size },
      uMiddle: { value: new THREE.Vector3(...shape.position) },
    });
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", "#include <common>\nvarying vec3 vOwn;")
      .replace("#include <begin_vertex>", "#include <begin_vertex>\nvOwn = position;");
    shader.fragmentShader = shader.fragmentShader
      .replace(
        "#include <common>",
        "#include <common>\nvarying vec3 vOwn;\nuniform float uSize;\nuniform vec3 uMiddle;",
      )
      .replace("#include <color_fragment>", `#include <color_fragment>\n{${pattern}\n}`);
  };
  material.customProgramCacheKey = () => pattern;
  return material;
}

/** Let what is inside show through, or not. */
export function fade(meshes, on) {
  for (const { material } of meshes) {
    Object.assign(material, { transparent: on, opacity: on ? FADED : 1, depthWrite: !on });
    material.needsUpdate = true;
  }
}

function instanced(geometry, material, count, order = 0) {
  const mesh = new THREE.InstancedMesh(geometry, material, count);
  return Object.assign(mesh, { frustumCulled: false, renderOrder: order });
}

function solids(data, count) {
  const geometries = data.shapes.map((shape) => geometryOf(shape, count));
  const triangles = geometries.reduce((sum, g) => sum + (g.index?.count ?? g.attributes.position.count) / 3, 0);
  const shaded = triangles * count < SHADED;
  const meshes = data.shapes.map((shape, k) => {
    const mesh = instanced(geometries[k], paint(shape), count);
    mesh.userData.coloured = true;
    return Object.assign(mesh, { castShadow: shaded, receiveShadow: shaded });
  });
  return { meshes, retheme() {} };
}

/** In the plane: dark silhouettes, the colour inside of them, and on what is round a stroke that shows how it turns. */
function flats(data, count, { unit, order }) {
  const rim = flatMaterial({ color: "#1d2733" });
  const dusk = flatMaterial({ color: "#0a1420", opacity: 0.12 });
  const place = ORDER.body + 3 * order;
  const meshes = data.shapes.flatMap((shape) => {
    const outline = silhouette(shape);
    const reach = Math.max(...outline.map((p) => p.distanceTo(outline[0])));
    const width = 0.035 * reach;
    const inner = instanced(area(inset(outline, width)), flatMaterial({ color: "#ffffff" }), count, place + 1);
    inner.userData.coloured = true;
    const shade = instanced(area(outline), dusk, count, ORDER.shadow);
    shade.position.set(0.012 * unit, -0.016 * unit, 0);
    const out = [inner, instanced(area(outline), rim, count, place), shade];
    if (looksRound(shape)) {
      const stroke = new THREE.PlaneGeometry(0.8 * shape.size[0], width);
      stroke.translate(shape.position[0] + 0.4 * shape.size[0], shape.position[1], 0);
      out.push(instanced(stroke, rim, count, place + 2));
    }
    return out;
  });
  const retheme = (theme) => {
    rim.color.set(theme === THEMES.dark ? "#04070b" : theme.ink);
    dusk.opacity = theme.flatShadow;
  };
  return { meshes, retheme };
}

/** Instanced meshes that share their matrices, and what changes their colours with the theme. */
export function crowdShapes(data, count, { planar, unit, order }) {
  return planar ? flats(data, count, { unit, order }) : solids(data, count);
}
