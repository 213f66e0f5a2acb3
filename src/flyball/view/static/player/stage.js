// The picture: renderer, camera and its presets, drawn only when something has changed.
import * as THREE from "three";
import { fitFlat, fitSpace } from "./framing.js";
import { makeGrid, niceBelow, spatialSurroundings } from "./ground.js";

const TANGENT = Math.tan((15 * Math.PI) / 180); // half the height of the perspective camera's picture, at depth 1
const FLIGHT = 350; // ms from one preset to the next
const VIEWS = {
  iso: [-0.62, 0.95, -0.52],
  front: [0, 1, -0.0001],
  side: [-1, 0, -0.0001],
  top: [0, 0.0001, -1],
};

/** A renderer, or null where the browser has no WebGL. */
function makeRenderer(canvas) {
  try {
    const renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    renderer.setClearAlpha(0);
    return renderer;
  } catch {
    return null;
  }
}

/** The ball around points, and their lowest height. */
function ballAround(points) {
  const box = new THREE.Box3().setFromPoints(points);
  const centre = box.getCenter(new THREE.Vector3());
  const radius = points.reduce((most, point) => Math.max(most, point.distanceTo(centre)), 1e-6);
  return { centre, radius, floor: box.min.z - 0.004 * radius };
}

export class Stage {
  /**
   * A stage in an element with a canvas; `points` enclose all that is ever to be seen, `margins` returns
   * those to keep free [px]: the `least`, the corner that is `covered`, and `ways` to keep clear of it.
   */
  constructor(element, mechanism, points, margins) {
    Object.assign(this, { element, mechanism, points, margins, dirty: true, view: "iso", flight: null });
    this.planar = mechanism.recording.planar;
    this.ball = ballAround(points);
    this.scene = new THREE.Scene();
    this.scene.add(mechanism.root);
    this.top = new THREE.Scene(); // drawn after the scene and over it
    this.top.add(mechanism.overlay);
    this.followed = null;
    const canvas = element.querySelector("canvas");
    this.renderer = makeRenderer(canvas);
    if (this.planar) this.#prepareFlat();
    else this.#prepareSpace();
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.#prepareControls();
    canvas.addEventListener("webglcontextlost", () => element.dispatchEvent(new Event("stage-lost")));
    new ResizeObserver(() => this.resize()).observe(element);
    this.resize();
  }

  #prepareFlat() {
    this.camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.1, 1000);
    this.grid = makeGrid(1, 1e9, 0);
    this.grid.material.depthTest = false;
    this.scene.add(this.grid);
  }

  #prepareSpace() {
    this.camera = new THREE.PerspectiveCamera((2 * Math.atan(TANGENT) * 180) / Math.PI, 1, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    const { grid, shadow } = spatialSurroundings(this.scene, this.ball);
    Object.assign(this, { grid, shadow });
    const light = new THREE.DirectionalLight("#ffffff", 2.2);
    light.position.set(-0.5, -0.7, 1);
    this.top.add(light, new THREE.HemisphereLight("#ffffff", "#d8dde4", 3.4));
    if (!this.renderer) return;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.renderer.toneMapping = THREE.NeutralToneMapping;
  }

  #prepareControls() {
    const { controls } = this;
    controls.enableDamping = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    controls.dampingFactor = 0.15;
    controls.zoomToCursor = true;
    controls.screenSpacePanning = true;
    if (this.planar) {
      controls.enableRotate = false;
      controls.mouseButtons = { LEFT: THREE.MOUSE.PAN, MIDDLE: THREE.MOUSE.DOLLY, RIGHT: THREE.MOUSE.PAN };
      controls.touches = { ONE: THREE.TOUCH.PAN, TWO: THREE.TOUCH.DOLLY_PAN };
    }
    controls.addEventListener("start", () => Object.assign(this, { view: null, flight: null }));
    controls.addEventListener("change", () => (this.dirty = true));
  }

  /** Show another mechanism in place of this one, from where one looks; `findPoints` is called when they are needed. */
  replace(mechanism, findPoints) {
    this.retired ??= [];
    this.retired.push(this.mechanism);
    for (const part of [this.mechanism.root, this.mechanism.overlay]) part.removeFromParent();
    Object.assign(this, { mechanism, points: null, findPoints, dirty: true });
    this.scene.add(mechanism.root);
    this.top.add(mechanism.overlay);
  }

  get size() {
    return [Math.max(this.element.clientWidth, 1), Math.max(this.element.clientHeight, 1)];
  }

  resize() {
    const [width, height] = this.size;
    this.renderer?.setSize(width, height, false);
    if (this.planar)
      Object.assign(this.camera, { left: -width / 2, right: width / 2, top: height / 2, bottom: -height / 2 });
    else this.camera.aspect = width / height;
    if (this.view) this.look(this.view);
    else this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  /** A fit that keeps the motion clear of what lies over the picture, unless that costs too much size. */
  #fitted(fit) {
    const { least, covered, ways } = this.margins();
    const plain = fit(least);
    const hidden = ([x, y]) => covered && x < covered.right && y < covered.bottom;
    if (!this.points.some((point) => hidden(plain.project(point)))) return plain;
    const clear = ways.map(fit).sort((a, b) => b.size - a.size)[0];
    return clear.size > 0.72 * plain.size ? clear : plain;
  }

  /** Look from a preset, or from where one looks ("fit"); all of the motion is in the picture. */
  look(view, smooth = false) {
    this.points ??= this.findPoints();
    this.view = view;
    this.followed = null;
    const [width, height] = this.size;
    if (this.planar) {
      const { x, y, scale } = this.#fitted((inset) => fitFlat(this.points, width, height, inset));
      this.controls.target.set(x, y, 0);
      this.camera.position.set(x, y, 500);
      this.camera.zoom = scale;
    } else {
      const [direction, up] = this.#facing(view);
      const fit = (inset) => fitSpace(this.points, direction, up, TANGENT, width, height, inset);
      const goal = this.#fitted(fit);
      if (smooth && this.controls.enableDamping) this.flight = this.#flightTo(goal);
      else this.#stand(goal);
    }
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  /** Direction of sight and what is up in the picture. */
  #facing(view) {
    const free = this.controls.target.clone().sub(this.camera.position);
    const direction = VIEWS[view]
      ? new THREE.Vector3(...VIEWS[view])
      : free.lengthSq()
        ? free
        : new THREE.Vector3(...VIEWS.iso);
    const steep = Math.abs(direction.normalize().z) > 0.9999;
    return [direction, steep ? new THREE.Vector3(0, 1, 0) : this.camera.up];
  }

  /** Let the camera go with a drawn body, or with none. */
  follow(body) {
    this.followed = body ? { group: body.group, at: body.group.position.clone() } : null;
    if (body) this.view = null;
  }

  #goAlong() {
    const { group, at } = this.followed;
    if (!Number.isFinite(group.position.x)) return;
    const step = group.position.clone().sub(at);
    at.copy(group.position);
    this.camera.position.add(step);
    this.controls.target.add(step);
    if (step.lengthSq()) this.dirty = true;
  }

  #stand({ position, target }) {
    this.camera.position.copy(position);
    this.controls.target.copy(target);
  }

  #flightTo(goal) {
    return {
      begin: performance.now(),
      from: { position: this.camera.position.clone(), target: this.controls.target.clone() },
      goal,
    };
  }

  #fly(now) {
    const { begin, from, goal } = this.flight;
    const s = Math.min(Math.max((now - begin) / FLIGHT, 0), 1);
    const u = s * s * (3 - 2 * s);
    const arm = ({ position, target }) => position.clone().sub(target);
    const [a, b] = [arm(from), arm(goal)];
    const target = from.target.clone().lerp(goal.target, u);
    const reach = a.length() + u * (b.length() - a.length());
    this.#stand({
      target,
      position: a.normalize().lerp(b.normalize(), u).normalize().multiplyScalar(reach).add(target),
    });
    if (s === 1) this.flight = null;
    this.dirty = true;
  }

  retheme(theme) {
    const { uniforms } = this.grid.material;
    uniforms.color.value.set(theme.grid);
    uniforms.strength.value = theme.gridStrength;
    if (this.shadow) this.shadow.opacity = theme.shadow;
    this.dirty = true;
  }

  /** Side of a grid cell and pixels per metre, for the scale's legend. */
  get scale() {
    return { cell: this.grid.material.uniforms.cell.value, pixels: this.planar ? this.camera.zoom : null };
  }

  #prepareDraw() {
    const { camera, controls, ball } = this;
    if (this.planar) {
      const [width, height] = this.size;
      const half = (width + height) / camera.zoom;
      this.grid.scale.set(half, half, 1);
      this.grid.position.set(controls.target.x, controls.target.y, 0);
      this.grid.material.uniforms.cell.value = niceBelow(110 / camera.zoom) / 5;
      return;
    }
    const depth = camera.position.distanceTo(ball.centre);
    camera.near = Math.max(depth - 3 * ball.radius, 0.01 * ball.radius, 0.002 * depth);
    camera.far = depth + 9 * ball.radius;
    camera.updateProjectionMatrix();
  }

  /** Draw if anything has changed; true if it has. */
  draw(now) {
    if (this.flight) this.#fly(now);
    if (this.followed) this.#goAlong();
    this.controls.update();
    if (!this.dirty) return false;
    this.dirty = false;
    this.#prepareDraw();
    this.mechanism.prepare();
    if (!this.renderer) return true;
    this.renderer.autoClear = true;
    this.renderer.render(this.scene, this.camera);
    this.drawn = { ...this.renderer.info.render };
    this.renderer.autoClear = false;
    this.renderer.clearDepth();
    this.renderer.render(this.top, this.camera);
    for (const old of this.retired?.splice(0) ?? []) old.dispose(); // after a picture of the new one, which shares shaders
    return true;
  }

  /** The point of the world under a point of the element: in the plane, or as far away as another point. */
  pointAt(x, y, beside) {
    const [width, height] = this.size;
    const near = new THREE.Vector3((2 * x) / width - 1, 1 - (2 * y) / height, -1).unproject(this.camera);
    if (this.planar) return near.setZ(0);
    const sight = this.camera.getWorldDirection(new THREE.Vector3());
    const ray = near.sub(this.camera.position);
    return ray.multiplyScalar(beside.clone().sub(this.camera.position).dot(sight) / ray.dot(sight)).add(this.camera.position);
  }

  /** The part under a point of the element (pixels from its corner), or null. */
  pick(x, y) {
    const [width, height] = this.size;
    const raycaster = new THREE.Raycaster();
    raycaster.setFromCamera(new THREE.Vector2((2 * x) / width - 1, 1 - (2 * y) / height), this.camera);
    return this.mechanism.pick(raycaster);
  }
}
