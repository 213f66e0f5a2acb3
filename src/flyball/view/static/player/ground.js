// The surroundings: a fading grid, and in space the light, the shadow on the ground and soft reflections.
import * as THREE from "three";

const VERTEX = `
varying vec2 at;
void main() {
  vec4 world = modelMatrix * vec4(position, 1.0);
  at = world.xy;
  gl_Position = projectionMatrix * viewMatrix * world;
}`;
const FRAGMENT = `
varying vec2 at;
uniform float cell, strength, radius;
uniform vec2 centre;
uniform vec3 color;
float lines(float size) {
  vec2 u = at / size;
  vec2 width = fwidth(u);
  vec2 d = abs(fract(u - 0.5) - 0.5) / width;
  return (1.0 - min(min(d.x, d.y), 1.0)) * (1.0 - smoothstep(0.2, 0.6, max(width.x, width.y)));
}
void main() {
  float fade = 1.0 - smoothstep(0.3, 1.0, length(at - centre) / radius);
  float drawn = max(0.5 * lines(cell), lines(5.0 * cell));
  gl_FragColor = vec4(color, strength * drawn * fade);
  #include <colorspace_fragment>
}`;

/** The largest of 1, 2, 5 times a power of ten that is not above a number. */
export function niceBelow(number) {
  const power = 10 ** Math.floor(Math.log10(number));
  return [5, 2, 1].find((digit) => digit * power <= number * (1 + 1e-9)) * power;
}

/** A square of grid lines at a height. */
export function makeGrid(half, radius, order) {
  const material = new THREE.ShaderMaterial({
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    uniforms: {
      cell: { value: 1 },
      strength: { value: 0.3 },
      radius: { value: radius },
      centre: { value: new THREE.Vector2() },
      color: { value: new THREE.Color() },
    },
    transparent: true,
    depthWrite: false,
    side: THREE.DoubleSide,
  });
  const mesh = new THREE.Mesh(new THREE.PlaneGeometry(2 * half, 2 * half), material);
  return Object.assign(mesh, { renderOrder: order, frustumCulled: false });
}

/** Light, shadow and ground for a motion inside a ball. */
export function spatialSurroundings(scene, { centre, radius, floor }) {
  const key = new THREE.DirectionalLight("#fff6ea", 2.5);
  key.position.copy(centre).addScaledVector(new THREE.Vector3(-0.45, -0.75, 1.5).normalize(), 3 * radius);
  key.target.position.copy(centre);
  key.castShadow = true;
  key.shadow.mapSize.set(2048, 2048);
  key.shadow.radius = 5;
  key.shadow.bias = -0.0004;
  key.shadow.normalBias = 0.012 * radius;
  const reach = 1.25 * radius;
  Object.assign(key.shadow.camera, {
    left: -reach,
    right: reach,
    top: reach,
    bottom: -reach,
    near: 0.2 * radius,
    far: 7 * radius,
  });
  const fillLight = new THREE.DirectionalLight("#dbe8ff", 1.1);
  fillLight.position.copy(centre).add(new THREE.Vector3(2, 1, 0.6).multiplyScalar(radius));
  fillLight.target = key.target;
  const sky = new THREE.HemisphereLight("#ffffff", "#b4bcc6", 2.7);
  const shadow = new THREE.Mesh(
    new THREE.CircleGeometry(6 * radius, 64),
    new THREE.ShadowMaterial({ opacity: 0.25, depthWrite: false }),
  );
  shadow.position.set(centre.x, centre.y, floor);
  shadow.receiveShadow = true;
  shadow.renderOrder = -1;
  const grid = makeGrid(6 * radius, 4.2 * radius, -2);
  grid.position.set(centre.x, centre.y, floor);
  grid.material.uniforms.centre.value.set(centre.x, centre.y);
  grid.material.uniforms.cell.value = niceBelow(radius / 3);
  scene.add(key, key.target, fillLight, sky, grid, shadow);
  return { grid, shadow: shadow.material };
}
