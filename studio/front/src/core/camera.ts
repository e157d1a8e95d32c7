/** The eye: from where the shape is seen, and how mouse, fingers and keys move it. */

import * as three from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Vec3 } from "./backend";

const FIELD_OF_VIEW = 26; // degrees: almost parallel, as in the library's pictures
// Degrees: from so far away, lines of sight are parallel to a quarter of a pixel. With one kind of
// camera all that turns, picks and drags is the same.
const PARALLEL = 0.1;
const AROUND = 2; // from the origin to the end of what is seen, of the extent
const NEAREST = 0.01;
const STEP = 40; // pixels by which a key moves the shape
const MARGIN = 0.84; // share of the window that the shape fills

export class Eye {
  readonly camera = new three.PerspectiveCamera(FIELD_OF_VIEW);
  controls: OrbitControls;
  private up: Vec3 = [0, 1, 0];
  private towards: Vec3 = [0, 0, 1]; // from the shape to the viewer

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly onMove: () => void,
    private readonly onEnd: () => void,
  ) {
    this.controls = this.startControls();
    canvas.addEventListener("keydown", (event) => this.turnByKey(event));
  }

  /** Take the upward direction of a shape, and its front. */
  face(up: Vec3, towards: Vec3): void {
    Object.assign(this, { up, towards });
    this.camera.up.set(...up);
    this.controls.dispose();
    this.controls = this.startControls(); // they read the upward direction only once
  }

  /** Return where the picture's right and the viewer are, in the coordinates of the scene. */
  get axes(): { right: three.Vector3; above: three.Vector3; towards: three.Vector3 } {
    const [right, above, towards] = [0, 1, 2].map(() => new three.Vector3());
    this.camera.updateMatrixWorld();
    this.camera.matrixWorld.extractBasis(right!, above!, towards!);
    return { right: right!, above: above!, towards: towards! };
  }

  private startControls(): OrbitControls {
    const controls = new OrbitControls(this.camera, this.canvas);
    controls.zoomToCursor = true;
    controls.addEventListener("change", () => this.moved());
    controls.addEventListener("end", this.onEnd);
    return controls;
  }

  /** Let the range of depths be that of the scene: from far away there would be too few of them. */
  private moved(): void {
    const { camera } = this;
    const away = camera.position.length();
    camera.near = Math.max(away - AROUND, NEAREST);
    camera.far = away + AROUND;
    camera.updateProjectionMatrix();
    this.onMove();
  }

  /** Whether the lines of sight are parallel, as in a drawing; else they meet in the eye. */
  get parallel(): boolean {
    return this.camera.fov === PARALLEL;
  }

  /** At the point about which the camera turns, lengths keep their size. */
  set parallel(parallel: boolean) {
    if (parallel === this.parallel) return;
    const { target } = this.controls;
    const before = this.tangent;
    this.camera.fov = parallel ? PARALLEL : FIELD_OF_VIEW;
    this.camera.position.sub(target).multiplyScalar(before / this.tangent).add(target);
    this.controls.update();
  }

  /** Of half the angle from the lower to the upper end of the picture. */
  private get tangent(): number {
    return Math.tan((this.camera.fov * Math.PI) / 360);
  }

  /** Take the size of the canvas, of which the lowest pixels are covered: pictures fit above them. */
  frame(width: number, height: number, covered: number): void {
    this.camera.setViewOffset(width, height - covered, 0, 0, width, height);
  }

  /** Return how many pixels of the canvas the picture is high. */
  get pixels(): number {
    return this.camera.view?.fullHeight ?? this.canvas.clientHeight;
  }

  /** Take another size, and come nearer or go away so that the shape fills the picture as before. */
  reframe(act: () => void, vertices: Float32Array, world: three.Matrix4): void {
    const whole = () => this.lookAt(vertices, world, this.axes.towards).distance;
    const before = whole();
    act();
    const { target } = this.controls;
    this.camera.position.sub(target).multiplyScalar(whole() / before).add(target);
    this.controls.update();
  }

  /** Show all vertices upright, from a side; `world` brings them into the scene. */
  fit(vertices: Float32Array, world: three.Matrix4, side: Vec3 = this.towards): void {
    const towards = new three.Vector3(...side).normalize();
    const { target, distance } = this.lookAt(vertices, world, towards);
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(towards, distance);
    this.controls.update();
  }

  /** Return the point to look at, and from how far, for all vertices to be seen from a side. */
  private lookAt(vertices: Float32Array, world: three.Matrix4, towards: three.Vector3) {
    const up = new three.Vector3(...this.up);
    const right = up.clone().cross(towards).normalize();
    const above = towards.clone().cross(right);
    const turn = new three.Matrix4().makeBasis(right, above, towards).transpose();
    turn.multiply(world);
    const tangent = MARGIN * this.tangent;
    const halves = new three.Vector3(tangent * this.camera.aspect, tangent, 0);
    // A vertex (x, y, z), z towards the camera, is in the picture if the camera stands at least
    // x / tan away from it in z, and so on each of the four sides. Opposite sides are balanced.
    const sides = new three.Box3();
    const [point, reach] = [new three.Vector3(), new three.Vector3()];
    for (let place = 0; place < vertices.length; place += 3) {
      point.fromArray(vertices, place).applyMatrix4(turn);
      sides.expandByPoint(reach.copy(point).addScaledVector(halves, point.z));
      sides.expandByPoint(reach.copy(point).addScaledVector(halves, -point.z));
    }
    const middle = sides.getCenter(new three.Vector3());
    const size = sides.getSize(new three.Vector3()).divideScalar(2);
    const distance = Math.max(size.x / halves.x, size.y / halves.y);
    const target = right.multiplyScalar(middle.x).addScaledVector(above, middle.y);
    return { target, distance };
  }

  get view(): { position: Vec3; target: Vec3; parallel: boolean } {
    const { camera, controls, parallel } = this;
    return { position: camera.position.toArray(), target: controls.target.toArray(), parallel };
  }

  set view({ position, target, parallel }) {
    this.parallel = parallel;
    this.camera.position.set(...position);
    this.controls.target.set(...target);
    this.controls.update();
  }

  /** Return the height of the scene that is seen at the point about which the camera turns. */
  get height(): number {
    return 2 * this.tangent * this.camera.position.distanceTo(this.controls.target);
  }

  /** Return the ray through a place of the canvas, in the coordinates of the scene. */
  rayAt(x: number, y: number): three.Ray {
    const { clientWidth, clientHeight } = this.canvas;
    const caster = new three.Raycaster();
    this.camera.updateMatrixWorld();
    const place = new three.Vector2((2 * x) / clientWidth - 1, 1 - (2 * y) / clientHeight);
    caster.setFromCamera(place, this.camera);
    return caster.ray;
  }

  private turnByKey(event: KeyboardEvent): void {
    const { controls } = this;
    const moves: Record<string, () => void> = {
      ArrowLeft: () => controls.pan(STEP, 0),
      ArrowRight: () => controls.pan(-STEP, 0),
      ArrowUp: () => controls.pan(0, STEP),
      ArrowDown: () => controls.pan(0, -STEP),
    };
    const turns: Record<string, () => void> = {
      ArrowLeft: () => controls.rotateLeft(0.1),
      ArrowRight: () => controls.rotateLeft(-0.1),
      ArrowUp: () => controls.rotateUp(0.1),
      ArrowDown: () => controls.rotateUp(-0.1),
      "+": () => controls.dollyIn(0.9),
      "-": () => controls.dollyOut(0.9),
    };
    if (event.shiftKey && event.key in moves) return; // these keys bend a limb
    const action = (event.ctrlKey ? moves : turns)[event.key];
    if (!action) return;
    event.preventDefault();
    action();
    controls.update();
    controls.dispatchEvent({ type: "end" });
  }
}
