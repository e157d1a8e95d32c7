/** The picture of one mesh: what is shown and from where; drawn only when something changed. */

import * as three from "three";
import { Ambient } from "./ambient";
import type { Handle, Vec3 } from "./backend";
import { Eye } from "./camera";
import { buildLegend, formatNumber, rgbOf, type Scale } from "./colors";
import { h, nextFrame } from "./dom";
import { Edges } from "./edges";
import { define, Motion } from "./motion";
import { Picker, type Hit } from "./picking";
import { Pointer, type Click, type PointerTool } from "./pointer";
import { startRenderer } from "./renderer";
import type { Skin } from "./skin";
import { Surface, vertexNormals } from "./surface";
import pickFragment from "../shaders/pick.frag.glsl?raw";
import pickVertex from "../shaders/pick.vert.glsl?raw";
import pointFragment from "../shaders/point.frag.glsl?raw";
import pointVertex from "../shaders/point.vert.glsl?raw";

/** A camera that survives a reload; `shape` says which mesh it looked at. */
export interface View {
  shape: number;
  position: Vec3;
  target: Vec3;
  parallel: boolean;
}
export type { Hit, Click, PointerTool };
/** What colors a shape; a second picture may take it over. */
export type Colors = Pick<Viewer, "setScalars" | "setLabels" | "setMarks">;

const FINE = 2; // pixels of the picture for each of the page, in both directions
const REST = 250; // ms after which a picture drawn in software is drawn again with smooth edges
const FADE = 160; // ms in which the exact result blends in
const DISC = 14; // pixels of the page
const SWING = 0.04; // how far a vibration reaches, of the extent

export class Viewer {
  /** Number of the mesh that is shown; views of another mesh are not restored. */
  shape = -1;
  onView: (view: View) => void = () => {};
  onMove: () => void = () => {}; // of the camera
  twin: Colors | null = null; // is told of all colors
  partNames: Record<number, string> = {}; // that the person gave, by the number of the part
  /** Everything in the coordinates of the mesh; the scene around it has size 1 at any unit. */
  readonly space = new three.Group();
  readonly scene = new three.Scene();
  readonly canvas = h("canvas", { tabindex: "0", "data-test": "canvas" });
  readonly motion = new Motion();
  readonly surface = new Surface(this.motion);
  readonly box = new three.Box3(); // around the mesh, as it was loaded
  extent = 1; // its diagonal
  readonly edges = new Edges(this.surface, this.motion);
  readonly onDraw: (() => void)[] = [];
  private readonly skeleton = new Surface(this.motion, "#3f7fae");
  private readonly disc = { size: { value: DISC }, picture: this.surface.material.uniforms.picture! };
  private readonly discs = new three.Points(
    new three.BufferGeometry(),
    this.motion.material(pointVertex, pointFragment, this.disc),
  );
  /** The same discs where something hides them: as rings. */
  private readonly rings = new three.Points(
    this.discs.geometry,
    this.motion.material(pointVertex, pointFragment, this.disc),
  );
  private readonly renderer: three.WebGLRenderer | null = null;
  private readonly inSoftware: boolean = false;
  private readonly picker: Picker | null = null;
  private readonly ambient: Ambient | null = null;
  private readonly eye: Eye;
  private readonly pointer: Pointer;
  private readonly watch = new ResizeObserver(() => this.resize());
  private readonly tip = h("div", { class: "tip", "data-test": "tip", hidden: true });
  private legend: HTMLDetailsElement | null = null;
  private scalars: { values: Float32Array; scale: Scale } | null = null;
  /** Color maps and ranges that the person chose, by the title of the function. */
  private readonly chosen = new Map<string, Partial<Scale>>();
  private frame = 0;
  private drawings = 0;
  private fading = 0;
  private up: Vec3 = [0, 1, 0];
  private solid = false;
  private folded = false;
  private clipped = false;
  covered = 0; // pixels, from below

  constructor(readonly stage: HTMLElement) {
    const { canvas, surface, skeleton, rings, discs } = this;
    stage.append(canvas, h("div", { class: "cross" }), this.tip);
    canvas.setAttribute(
      "aria-label",
      "The shape. Arrow keys turn it, with Ctrl they move it, + and - zoom, Space clicks in the middle.",
    );
    skeleton.visible = discs.visible = rings.visible = false;
    for (const { material } of [skeleton, discs, rings]) material.transparent = true;
    define(rings.material, "HOLLOW", 1);
    Object.assign(rings.material, { depthFunc: three.GreaterDepth, depthWrite: false });
    // The skeleton is drawn over the veil of the surface, also where it lies behind it.
    const drawn = [surface, skeleton, rings, discs, this.edges];
    drawn.forEach((object, order) => (object.renderOrder = order));
    discs.frustumCulled = rings.frustumCulled = false;
    this.space.add(...drawn);
    this.scene.add(this.space);
    const started = startRenderer(canvas, stage, () => this.invalidate());
    if (started) {
      const { renderer, inSoftware } = started;
      [this.renderer, this.inSoftware] = [renderer, inSoftware];
      const grid = { value: new three.Vector2() };
      const material = this.motion.material(pickVertex, pickFragment, { grid });
      this.picker = new Picker(renderer, surface.geometry, material);
      this.ambient = new Ambient(renderer, surface, () => this.invalidate());
      this.scene.add(this.ambient.ground);
    }
    this.eye = new Eye(
      canvas,
      () => {
        this.invalidate();
        this.onMove();
      },
      () => this.onView({ shape: this.shape, ...this.eye.view }),
    );
    this.pointer = new Pointer(canvas, (x, y) => this.pick(x, y));
    this.pointer.onHover = (hit, x, y) => this.showTip(hit, x, y);
    this.watch.observe(stage);
    this.resize();
  }

  get camera() {
    return this.eye.camera;
  }
  get controls() {
    return this.eye.controls;
  }
  /** Whether one finger turns the view, whatever the tool. */
  get fingerTurns() {
    return this.pointer.fingerTurns;
  }
  set fingerTurns(turns: boolean) {
    this.pointer.fingerTurns = turns;
  }
  get geometry() {
    return this.surface.geometry;
  }
  get vertices() {
    return this.surface.vertices;
  }
  get faces() {
    return this.surface.faces;
  }
  get labels() {
    return this.surface.labels;
  }

  setMesh(vertices: Float32Array, faces: Uint32Array, up: Vec3, towards: Vec3): void {
    this.folded = false;
    this.surface.setMesh(vertices, faces);
    this.edges.show(this.edges.visible);
    this.cut(null);
    this.setPoints([], "#000000");
    this.setSkeleton(null);
    this.setScalars(null);
    this.setHandles([]);
    const size = this.box.setFromArray(vertices).getSize(new three.Vector3()).length() || 1;
    this.extent = size;
    this.space.scale.setScalar(1 / size);
    this.space.position.copy(this.box.getCenter(new three.Vector3())).multiplyScalar(-1 / size);
    this.space.updateMatrixWorld(true);
    this.face(up, towards);
  }

  /** Let a direction be up and a side the front, and show the shape from there. */
  face(up: Vec3, towards: Vec3): void {
    this.up = up;
    this.eye.face(up, towards);
    this.fit();
    this.ambient?.start(up);
  }

  get axes() {
    return this.eye.axes;
  }

  /**
   * Take a new pose. The motion ends: the new vertices are at rest. `folded` says that the inside
   * of the surface may be seen, as where few modes express the shape.
   */
  setVertices(vertices: Float32Array<ArrayBuffer>, folded = false): void {
    this.surface.setVertices(vertices);
    this.setHandles([]);
    this.folded = folded;
    this.setSolid(this.solid);
    this.ambient?.start(this.up);
  }

  /** Show how the file says that the shape looks, while no result colors it. */
  setSkin(skin: Skin): void {
    this.surface.setSkin(skin);
    this.invalidate();
  }

  showTexture(textured: boolean): void {
    this.surface.showTexture(textured);
    this.invalidate();
  }

  /** Set by how much each vertex follows each region: one number for each of `MAX_REGIONS`. */
  setShares(shares: Float32Array): void {
    this.surface.replace("shares", shares);
  }

  /** Show the motion of the regions by shares, computed in the shader. */
  setHandles(handles: Handle[]): void {
    this.motion.set(handles);
    cancelAnimationFrame(this.fading);
    this.invalidate();
  }

  /** Blend the exact result of the present motion in. */
  setExact(vertices: Float32Array): void {
    this.surface.setExact(vertices);
    const begin = performance.now();
    const step = () => {
      const share = Math.min((performance.now() - begin) / FADE, 1);
      this.motion.fade(share);
      this.invalidate();
      if (share < 1) this.fading = requestAnimationFrame(step);
    };
    cancelAnimationFrame(this.fading);
    step();
  }

  /** Color by a function; nodal lines mark where it is zero. */
  setScalars(values: Float32Array | null, scale?: Scale): void {
    const open = this.legend?.open ?? false;
    this.legend?.remove();
    this.legend = this.scalars = null;
    this.tip.hidden = true;
    const seen = scale && { ...scale, ...this.chosen.get(scale.title) };
    this.surface.setScalars(values, seen);
    this.twin?.setScalars(values, seen);
    this.surface.vibrate(0, 1);
    if (values && scale) {
      this.scalars = { values, scale };
      const choose = (choice: Partial<Scale>) => {
        this.chosen.set(scale.title, { ...this.chosen.get(scale.title), ...choice });
        this.setScalars(values, scale);
      };
      this.stage.append((this.legend = buildLegend(seen!, open, choose)));
    }
    this.invalidate();
  }

  /** Say what value or part lies under the pointer. */
  private showTip(hit: Hit | null, x: number, y: number): void {
    const { scalars, labels, tip } = this;
    const value = hit && scalars && formatNumber(scalars.values[hit.vertex]!);
    const label = hit && labels && labels[hit.vertex]!;
    const part = label !== null && (this.partNames[label] ?? `part ${label}`);
    tip.hidden = !value && !part;
    tip.textContent = value ? `${value} at vertex ${hit.vertex}` : part || "";
    Object.assign(tip.style, { left: `${x}px`, top: `${y}px` });
  }

  /** Let the shown function swing along the normals, in a phase from -1 to 1; 1 and `still` end it. */
  vibrate(phase: number, still = false): void {
    this.surface.vibrate(still ? 0 : SWING * this.extent, phase);
    this.invalidate();
  }

  /** Turn the camera about the shape by an angle. */
  turn(angle: number): void {
    this.controls.rotateLeft(angle);
  }

  /** Cut off what lies beyond a share of the box of the shape along a direction. */
  cut(direction: three.Vector3 | null, share = 0.5): void {
    const plane = direction && this.planeAt(direction, share);
    this.clipped = plane !== null;
    const materials = [this.surface.material, this.edges.material, this.picker?.material];
    this.motion.cut(plane, materials.filter((material) => material !== undefined));
    this.setSolid(this.solid);
    this.invalidate();
  }

  private planeAt(direction: three.Vector3, share: number): three.Vector4 {
    const { vertices } = this;
    let [low, high] = [Infinity, -Infinity];
    const point = new three.Vector3();
    for (let place = 0; place < vertices.length; place += 3) {
      const along = point.fromArray(vertices, place).dot(direction);
      [low, high] = [Math.min(low, along), Math.max(high, along)];
    }
    return new three.Vector4(...direction.toArray(), low + share * (high - low));
  }

  /** Color by parts; `palette` has three bytes a label. Labels below 0 stay plain. */
  setLabels(labels: Int32Array | null, palette: Uint8Array = new Uint8Array(0)): void {
    this.setScalars(null);
    if (!labels) return;
    this.surface.setLabels(labels, palette);
    this.twin?.setLabels(labels, palette);
  }

  /** Tint vertices: red, green, blue and strength of each, in bytes. */
  setMarks(marks: Uint8Array): void {
    this.surface.setMarks(marks);
    this.twin?.setMarks(marks);
    this.invalidate();
  }

  /** Say whether the inside of the surface is never seen: without it a frame takes a third less. */
  setSolid(solid: boolean): void {
    this.solid = solid;
    const inside = this.folded || this.clipped || !solid;
    const side = inside ? three.DoubleSide : three.FrontSide;
    if (side === this.surface.material.side) return; // the page asks with each state that it hears of
    this.surface.material.side = side;
    this.invalidate();
  }

  /** Mark vertices by discs of constant size on the screen, or rings behind the shape; of one color or one each. */
  setPoints(vertices: ArrayLike<number>, colors: string | Uint8Array): void {
    this.discs.visible = this.rings.visible = vertices.length > 0;
    this.surface.shareBuffers(this.discs.geometry, Uint32Array.from(vertices));
    const tints = new Uint8Array(this.vertices.length);
    Array.from(vertices).forEach((vertex, i) => {
      const tint = typeof colors === "string" ? rgbOf(colors) : colors.subarray(3 * i, 3 * i + 3);
      tints.set(tint, 3 * vertex);
    });
    this.discs.geometry.setAttribute("tint", new three.BufferAttribute(tints, 3, true));
    this.invalidate();
  }

  /** Show the eigen-skeleton in a veil of the surface. */
  setSkeleton(points: Float32Array | null): void {
    this.skeleton.visible = points !== null;
    if (points) {
      const { geometry } = this.skeleton;
      this.surface.shareBuffers(geometry, this.faces);
      geometry.setAttribute("position", new three.BufferAttribute(points, 3));
      const normals = vertexNormals(points, this.faces);
      geometry.setAttribute("normal", new three.BufferAttribute(normals, 3));
    }
    this.surface.setVeil(points !== null);
    this.invalidate();
  }

  /** Return what lies under a place of the canvas, as it is shown. */
  pick(x: number, y: number): Hit | null {
    if (!this.faces.length || !this.canvas.clientWidth) return null;
    this.camera.updateMatrixWorld();
    return this.picker?.pick(x, y, this.camera, this.space.matrixWorld) ?? null;
  }

  readPositions(): Float32Array {
    return this.picker?.readPositions() ?? new Float32Array(0);
  }

  /** Return the picture as PNG, with FINE × FINE pixels for each of the page. */
  screenshot(): Promise<Blob> {
    this.draw(true); // a drawing buffer is readable only in the turn in which it was drawn
    return new Promise((resolve, reject) =>
      this.canvas.toBlob((blob) =>
        blob ? resolve(blob) : reject(new Error("There is no picture.")),
      ),
    );
  }

  /** Give the graphics memory back: browsers allow only few pictures at a time. */
  dispose(): void {
    cancelAnimationFrame(this.frame);
    this.drawings += 1; // whoever waits for a rest hears that it is over
    this.ambient?.dispose();
    this.watch.disconnect();
    this.controls.dispose();
    this.renderer?.dispose();
    this.renderer?.forceContextLoss();
    this.canvas.remove();
  }

  /** Draw soon, once, however often this is called. */
  invalidate(): void {
    this.frame ||= requestAnimationFrame(() => this.draw());
  }

  /** Give the pointer to a tool that drags, or to what a click does; else it turns the camera. */
  setPointer(cursor = "grab", click: Click | null = null, tool: PointerTool | null = null): void {
    this.pointer.set(cursor, click, tool);
  }

  /** Show the whole shape upright, from a side; that which the library chose unless one is given. */
  fit(side?: Vec3): void {
    this.eye.fit(this.vertices, this.space.matrixWorld, side);
  }

  /** Whether the picture is orthographic, or in perspective. */
  get parallel(): boolean {
    return this.eye.parallel;
  }
  set parallel(parallel: boolean) {
    this.eye.parallel = parallel;
    this.onView({ shape: this.shape, ...this.eye.view });
  }

  /** Give all clicks on the shape to one taker, before any tool; null ends that. */
  takeClicks(click: Click | null): void {
    this.pointer.first = click;
  }

  /** Return what is drawn now in so many pixels of width, over a color. */
  frameOf(width: number, ground: string): ImageData {
    this.draw(false);
    const { canvas } = this;
    const height = 2 * Math.round((width * canvas.height) / canvas.width / 2);
    const copy = new OffscreenCanvas(width, height);
    const pen = copy.getContext("2d", { willReadFrequently: true })!;
    pen.fillStyle = ground;
    pen.fillRect(0, 0, width, height);
    pen.imageSmoothingQuality = "high";
    pen.drawImage(canvas, 0, 0, width, height);
    return pen.getImageData(0, 0, width, height);
  }

  setView(view: View): void {
    this.eye.view = view;
  }

  /** Return how many pixels of the page a length has at the point that the camera turns about. */
  pixelsOf(length: number): number {
    return (this.eye.pixels * length) / (this.eye.height * this.extent);
  }

  /** Return the ray through a place of the canvas, in the coordinates of the mesh. */
  rayAt(x: number, y: number): three.Ray {
    return this.eye.rayAt(x, y).applyMatrix4(this.space.matrixWorld.clone().invert());
  }

  /** Return where a point of the mesh is seen, in pixels of the canvas. */
  placeOf(point: Vec3): [number, number] {
    const { clientWidth, clientHeight } = this.canvas;
    this.camera.updateMatrixWorld();
    const seen = new three.Vector3(...point).applyMatrix4(this.space.matrixWorld);
    const { x, y } = seen.project(this.camera);
    return [((x + 1) / 2) * clientWidth, ((1 - y) / 2) * clientHeight];
  }

  /** Fill the stage. */
  resize(): void {
    const { clientWidth: width, clientHeight: height } = this.stage;
    if (!width || !height) return;
    this.renderer?.setSize(width, height);
    this.eye.frame(width, height, this.covered);
    this.draw();
  }

  /**
   * Let the shape be seen above what covers so many of the lowest pixels. A camera that follows
   * another one is moved by that.
   */
  cover(pixels: number, follows = false): void {
    if (pixels === this.covered) return;
    this.covered = pixels;
    if (follows || !this.vertices.length) this.resize();
    else this.eye.reframe(() => this.resize(), this.vertices, this.space.matrixWorld);
  }

  /** Draw now. In software, edges are smooth only in a `fine` picture, drawn when all is at rest. */
  private draw(fine = !this.inSoftware): void {
    cancelAnimationFrame(this.frame);
    this.drawings += 1;
    this.frame = 0;
    const { renderer } = this;
    if (!renderer || !this.vertices.length) return;
    const ratio = fine ? FINE : 1;
    if (renderer.getPixelRatio() !== ratio) renderer.setPixelRatio(ratio);
    this.disc.size.value = DISC * ratio;
    this.surface.material.uniforms.line!.value = ratio;
    renderer.render(this.scene, this.camera);
    for (const act of this.onDraw) act();
    if (!fine) this.drawFineAtRest();
  }

  /** Draw with smooth edges when nothing has moved for a while. */
  private async drawFineAtRest(): Promise<void> {
    const drawn = this.drawings;
    // A slow frame is no rest: two frames later this one has been shown.
    await nextFrame();
    await nextFrame();
    await new Promise((done) => setTimeout(done, REST));
    if (drawn === this.drawings) this.draw(true);
  }
}
