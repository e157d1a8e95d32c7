/** The picture: one mesh, its colors and its motion; drawn only when something changed. */

import * as three from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Handle, Vec3 } from "./backend";
import { buildLegend, colorMap, rgbOf, type Scale } from "./colors";
import { h } from "./dom";
import { Picker, type Hit } from "./picking";
import { MAX_REGIONS } from "./regions";
import movedSource from "../shaders/moved.glsl?raw";
import pickFragment from "../shaders/pick.frag.glsl?raw";
import pickVertex from "../shaders/pick.vert.glsl?raw";
import pointFragment from "../shaders/point.frag.glsl?raw";
import pointVertex from "../shaders/point.vert.glsl?raw";
import surfaceFragment from "../shaders/surface.frag.glsl?raw";
import surfaceVertex from "../shaders/surface.vert.glsl?raw";

/** A camera that survives a reload; `shape` says which mesh it looked at. */
export interface View {
  shape: number;
  position: Vec3;
  target: Vec3;
}
/** Takes over the pointer: `down` returns false to leave it to the camera. */
export interface PointerTool {
  down(event: PointerEvent): boolean;
  move(event: PointerEvent): void;
  up(): void;
}
export type { Hit };
export type Click = (hit: Hit, event: PointerEvent) => void;

const MOST_PIXELS = 1.5; // device pixels for each of the page: more costs much and shows little
const FIELD_OF_VIEW = 26; // degrees: almost parallel, as in the library's pictures
const MARGIN = 0.84; // share of the window that the shape fills
const CLICK = 4; // pixels that a click may move
const FADE = 160; // ms in which the exact result blends in
const PLAIN = "#cdc8c0";
const [UNCOLORED, BY_VALUE, BY_PAINT] = [0, 1, 2]; // COLORING of the shader

export class Viewer {
  /** Number of the mesh that is shown; views of another mesh are not restored. */
  shape = -1;
  onView: (view: View) => void = () => {};
  /** Everything in the coordinates of the mesh; the scene around it has size 1 at any unit. */
  readonly space = new three.Group();
  readonly scene = new three.Scene();
  readonly camera = new three.PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 100);
  readonly canvas = h("canvas", { tabindex: "0", "data-test": "canvas" });
  readonly geometry = new three.BufferGeometry();
  controls: OrbitControls;
  vertices = new Float32Array(0);
  faces = new Uint32Array(0);
  labels: Int32Array | null = null;
  readonly box = new three.Box3(); // around the mesh, as it was loaded
  extent = 1; // its diagonal
  private readonly renderer: three.WebGLRenderer | null;
  private readonly picker: Picker | null;
  private readonly motion = {
    n_moving: { value: 0 },
    kind: { value: new Int32Array(MAX_REGIONS) },
    pivot: { value: Array.from({ length: MAX_REGIONS }, () => new three.Vector3()) },
    direction: { value: Array.from({ length: MAX_REGIONS }, () => new three.Vector3()) },
    angle: { value: new Float32Array(MAX_REGIONS) },
    blend: { value: 0 },
  };
  private readonly surface = new three.Mesh(this.geometry, this.surfaceMaterial(PLAIN));
  private readonly skeleton = new three.Mesh(
    new three.BufferGeometry(),
    this.surfaceMaterial("#3f7fae"),
  );
  private readonly discs = new three.Points(
    new three.BufferGeometry(),
    this.material(pointVertex, pointFragment, {
      size: { value: 14 * Math.min(devicePixelRatio, MOST_PIXELS) },
    }),
  );
  private readonly watch = new ResizeObserver(() => this.resize());
  private legend: HTMLElement | null = null;
  private tool: PointerTool | null = null;
  private click: Click | null = null;
  private frame = 0;
  private fading = 0;
  private up: Vec3 = [0, 1, 0];
  private towards: Vec3 = [0, 0, 1]; // from the shape to the viewer

  constructor(readonly stage: HTMLElement) {
    stage.append(this.canvas);
    this.canvas.setAttribute("aria-label", "The shape. Arrow keys turn it, + and - zoom.");
    this.skeleton.visible = this.discs.visible = false;
    this.skeleton.material.transparent = this.discs.material.transparent = true;
    // The skeleton is drawn over the veil of the surface, also where it lies behind it.
    [this.surface, this.skeleton, this.discs].forEach((object, order) => {
      object.renderOrder = order;
      object.frustumCulled = false; // the shader moves vertices out of the box of the geometry
      this.space.add(object);
    });
    this.scene.add(this.space);
    this.renderer = this.startRenderer();
    const grid = { value: new three.Vector2() };
    const material = this.material(pickVertex, pickFragment, { grid });
    this.picker = this.renderer && new Picker(this.renderer, this.geometry, material);
    this.controls = this.startControls();
    this.listenToPointer();
    this.canvas.addEventListener("keydown", (event) => this.turnByKey(event));
    this.watch.observe(stage);
    this.resize();
  }

  setMesh(vertices: Float32Array, faces: Uint32Array, up: Vec3, towards: Vec3): void {
    const count = vertices.length / 3;
    Object.assign(this, { vertices, faces, up, towards });
    this.geometry.dispose();
    const attributes = {
      position: [vertices, 3],
      normal: [vertexNormals(vertices, faces), 3],
      exact: [vertices.slice(), 3],
      exact_normal: [new Float32Array(3 * count), 3],
      shares: [new Float32Array(MAX_REGIONS * count), MAX_REGIONS],
      value: [new Float32Array(count), 1],
      paint: [new Uint8Array(3 * count), 3],
      mark: [new Uint8Array(4 * count), 4],
    } as const;
    this.geometry.setIndex(new three.BufferAttribute(faces, 1));
    for (const [name, [array, size]] of Object.entries(attributes)) {
      const normalized = array instanceof Uint8Array;
      this.geometry.setAttribute(name, new three.BufferAttribute(array, size, normalized));
    }
    this.setPoints([], PLAIN);
    this.setSkeleton(null);
    this.setScalars(null);
    this.setHandles([]);
    const size = this.box.setFromArray(vertices).getSize(new three.Vector3()).length() || 1;
    this.extent = size;
    this.space.scale.setScalar(1 / size);
    this.space.position.copy(this.box.getCenter(new three.Vector3())).multiplyScalar(-1 / size);
    this.space.updateMatrixWorld(true);
    this.camera.up.set(...up);
    this.controls.dispose();
    this.controls = this.startControls(); // they read the upward direction only once
    this.fit();
  }

  /** Take a new pose. The motion ends: the new vertices are at rest. */
  setVertices(vertices: Float32Array<ArrayBuffer>): void {
    this.vertices = vertices;
    this.replace("position", vertices);
    this.replace("normal", vertexNormals(vertices, this.faces));
    this.setHandles([]);
  }

  /** Set by how much each vertex follows each region: one number for each of `MAX_REGIONS`. */
  setShares(shares: Float32Array): void {
    this.replace("shares", shares);
  }

  /** Show the motion of the regions by shares, computed in the shader. */
  setHandles(handles: Handle[]): void {
    const { kind, pivot, direction, angle } = this.motion;
    this.motion.n_moving.value = handles.some((handle) => handle) ? handles.length : 0;
    handles.forEach((handle, region) => {
      kind.value[region] = handle ? (handle.type === "rotation" ? 1 : 2) : 0;
      if (handle?.type === "rotation") {
        pivot.value[region]!.set(...handle.pivot);
        direction.value[region]!.set(...handle.axis);
        angle.value[region] = handle.angle;
      } else if (handle) direction.value[region]!.set(...handle.vector);
    });
    this.motion.blend.value = 0;
    cancelAnimationFrame(this.fading);
    this.invalidate();
  }

  /** Blend the exact result of the present motion in. */
  setExact(vertices: Float32Array): void {
    this.replace("exact", vertices);
    this.replace("exact_normal", vertexNormals(vertices, this.faces));
    const begin = performance.now();
    const step = () => {
      this.motion.blend.value = Math.min((performance.now() - begin) / FADE, 1);
      this.invalidate();
      if (this.motion.blend.value < 1) this.fading = requestAnimationFrame(step);
    };
    cancelAnimationFrame(this.fading);
    step();
  }

  /** Color by a function; nodal lines mark where it is zero. */
  setScalars(values: Float32Array | null, scale?: Scale): void {
    const { table, range, nodal } = this.surface.material.uniforms;
    this.legend?.remove();
    this.labels = null;
    this.setColoring(values ? BY_VALUE : UNCOLORED);
    if (!values || !scale) return;
    this.replace("value", values);
    table!.value?.dispose();
    table!.value = new three.DataTexture(colorMap(scale.map), 256, 1);
    table!.value.needsUpdate = true;
    range!.value.set(...scale.range);
    nodal!.value = scale.nodal ?? false;
    this.legend = buildLegend(scale);
    this.stage.append(this.legend);
  }

  /** Color by parts; `palette` has three bytes a label. Labels below 0 stay plain. */
  setLabels(labels: Int32Array | null, palette: Uint8Array = new Uint8Array(0)): void {
    this.setScalars(null);
    this.labels = labels;
    if (!labels) return;
    const paint = new Uint8Array(3 * labels.length).fill(209);
    labels.forEach((label, vertex) => {
      if (label >= 0) paint.set(palette.subarray(3 * label, 3 * label + 3), 3 * vertex);
    });
    this.replace("paint", paint);
    this.turnCorners(labels);
    this.setColoring(BY_PAINT);
  }

  /** Let each face end with a corner of its most frequent label: the shader takes that color. */
  private turnCorners(labels: Int32Array): void {
    const { faces } = this;
    for (let place = 0; place < faces.length; place += 3) {
      const [a, b, c] = faces.subarray(place, place + 3) as unknown as [number, number, number];
      if (labels[a] === labels[b] && labels[b] !== labels[c]) faces.set([c, a, b], place);
    }
    this.geometry.index!.needsUpdate = true;
  }

  private setColoring(kind: number): void {
    this.define("COLORING", kind);
    this.invalidate();
  }

  /** Say whether the inside of the surface is never seen: without it a frame takes a third less. */
  setSolid(solid: boolean): void {
    this.surface.material.side = solid ? three.FrontSide : three.DoubleSide;
    this.invalidate();
  }

  /** Tint vertices: red, green, blue and strength of each, in bytes. */
  setMarks(marks: Uint8Array): void {
    this.define("MARKED", marks.some((byte) => byte > 0));
    this.replace("mark", marks);
  }

  /** Compile the shader of the surface anew if a constant of it changes. */
  private define(name: string, value: unknown): void {
    const { material } = this.surface;
    if (material.defines[name] !== value) material.needsUpdate = true;
    material.defines[name] = value;
  }

  /** Mark vertices by discs of constant size on the screen, of one color or one each. */
  setPoints(vertices: ArrayLike<number>, colors: string | Uint8Array): void {
    this.discs.visible = vertices.length > 0;
    this.shareBuffers(this.discs.geometry, Uint32Array.from(vertices));
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
      this.shareBuffers(geometry, this.faces);
      geometry.setAttribute("position", new three.BufferAttribute(points, 3));
      const normals = vertexNormals(points, this.faces);
      geometry.setAttribute("normal", new three.BufferAttribute(normals, 3));
    }
    const { material } = this.surface;
    material.transparent = points !== null;
    material.depthWrite = points === null;
    material.uniforms.opacity!.value = points ? 0.28 : 1;
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

  screenshot(): Promise<Blob> {
    this.draw(); // a drawing buffer is readable only in the turn in which it was drawn
    return new Promise((resolve, reject) =>
      this.canvas.toBlob((blob) =>
        blob ? resolve(blob) : reject(new Error("There is no picture.")),
      ),
    );
  }

  /** Give the graphics memory back: browsers allow only few pictures at a time. */
  dispose(): void {
    cancelAnimationFrame(this.frame);
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
    this.canvas.style.cursor = cursor;
    [this.click, this.tool] = [click, tool];
  }

  /** Show the whole shape upright, from the side that the library chose. */
  fit(): void {
    const up = new three.Vector3(...this.up);
    const towards = new three.Vector3(...this.towards);
    const right = up.clone().cross(towards).normalize();
    const above = towards.clone().cross(right);
    const turn = new three.Matrix4().makeBasis(right, above, towards).transpose();
    turn.multiply(this.space.matrixWorld);
    const tangent = MARGIN * Math.tan((FIELD_OF_VIEW * Math.PI) / 360);
    const halves = new three.Vector3(tangent * this.camera.aspect, tangent, 0);
    // A vertex (x, y, z), z towards the camera, is in the picture if the camera stands at least
    // x / tan away from it in z, and so on each of the four sides. Opposite sides are balanced.
    const sides = new three.Box3();
    const [point, reach] = [new three.Vector3(), new three.Vector3()];
    for (let place = 0; place < this.vertices.length; place += 3) {
      point.fromArray(this.vertices, place).applyMatrix4(turn);
      sides.expandByPoint(reach.copy(point).addScaledVector(halves, point.z));
      sides.expandByPoint(reach.copy(point).addScaledVector(halves, -point.z));
    }
    const middle = sides.getCenter(new three.Vector3());
    const size = sides.getSize(new three.Vector3()).divideScalar(2);
    const distance = Math.max(size.x / halves.x, size.y / halves.y);
    const target = right.multiplyScalar(middle.x).addScaledVector(above, middle.y);
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(towards, distance);
    this.controls.update();
  }

  setView(view: View): void {
    this.camera.position.set(...view.position);
    this.controls.target.set(...view.target);
    this.controls.update();
  }

  /** Return how many pixels of the page a length has at the point that the camera turns about. */
  pixelsOf(length: number): number {
    const distance = this.camera.position.distanceTo(this.controls.target);
    const seen = 2 * Math.tan((FIELD_OF_VIEW * Math.PI) / 360) * distance * this.extent;
    return (this.canvas.clientHeight * length) / seen;
  }

  /** Return the ray through a place of the canvas, in the coordinates of the mesh. */
  rayAt(x: number, y: number): three.Ray {
    const { clientWidth, clientHeight } = this.canvas;
    const caster = new three.Raycaster();
    this.camera.updateMatrixWorld();
    const place = new three.Vector2((2 * x) / clientWidth - 1, 1 - (2 * y) / clientHeight);
    caster.setFromCamera(place, this.camera);
    return caster.ray.applyMatrix4(this.space.matrixWorld.clone().invert());
  }

  private startRenderer(): three.WebGLRenderer | null {
    // Without a graphics card, smoothing edges would double the time of a frame.
    const context =
      this.canvas.getContext("webgl2", { failIfMajorPerformanceCaveat: true }) ??
      this.canvas.getContext("webgl2", { antialias: false });
    if (!context?.getExtension("EXT_color_buffer_float")) {
      this.showNotice(
        "This browser has no WebGL2 with float buffers, which the picture needs. Enable hardware " +
          "acceleration, or use a recent Chrome, Edge, Firefox or Safari.",
      );
      return null;
    }
    const renderer = new three.WebGLRenderer({ canvas: this.canvas, context });
    renderer.setClearColor(0, 0);
    renderer.setPixelRatio(Math.min(devicePixelRatio, MOST_PIXELS));
    let notice: HTMLElement | null = null;
    this.canvas.addEventListener("webglcontextlost", () => {
      notice = this.showNotice("The graphics card was reset. The picture returns in a moment.");
    });
    this.canvas.addEventListener("webglcontextrestored", () => {
      notice?.remove();
      this.invalidate();
    });
    return renderer;
  }

  private showNotice(text: string): HTMLElement {
    const notice = h("div", { class: "notice", role: "alert", "data-test": "notice" }, text);
    this.stage.append(notice);
    return notice;
  }

  private startControls(): OrbitControls {
    const controls = new OrbitControls(this.camera, this.canvas);
    controls.zoomToCursor = true;
    controls.addEventListener("change", () => this.invalidate());
    controls.addEventListener("end", () => {
      const [position, target] = [this.camera.position.toArray(), controls.target.toArray()];
      this.onView({ shape: this.shape, position, target });
    });
    return controls;
  }

  /** Tell clicks from drags, and let the tool take the pointer before the camera. */
  private listenToPointer(): void {
    let from: [number, number] | null = null;
    let holder: PointerTool | null = null; // the tool that has the pointer
    const take = (event: PointerEvent) => {
      if (event.button !== 0 || !event.isPrimary) return;
      from = [event.offsetX, event.offsetY];
      holder = this.tool?.down(event) ? this.tool : null;
      if (!holder) return;
      this.canvas.setPointerCapture(event.pointerId);
      event.stopImmediatePropagation();
    };
    const release = (event: PointerEvent) => {
      const [x, y] = [event.offsetX, event.offsetY];
      const still = from && Math.hypot(x - from[0], y - from[1]) < CLICK;
      if (holder) holder.up();
      else if (this.click && still && event.type === "pointerup") {
        const hit = this.pick(x, y);
        if (hit) this.click(hit, event);
      }
      from = holder = null;
    };
    this.canvas.addEventListener("pointerdown", take, { capture: true });
    this.canvas.addEventListener("pointermove", (event) => holder?.move(event));
    this.canvas.addEventListener("pointerup", release);
    this.canvas.addEventListener("pointercancel", release);
  }

  private turnByKey(event: KeyboardEvent): void {
    const { controls } = this;
    const actions: Record<string, () => void> = {
      ArrowLeft: () => controls.rotateLeft(0.1),
      ArrowRight: () => controls.rotateLeft(-0.1),
      ArrowUp: () => controls.rotateUp(0.1),
      ArrowDown: () => controls.rotateUp(-0.1),
      "+": () => controls.dollyIn(0.9),
      "-": () => controls.dollyOut(0.9),
    };
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
    controls.dispatchEvent({ type: "end" });
  }

  private surfaceMaterial(plain: string) {
    const material = this.material(surfaceVertex, surfaceFragment, {
      table: { value: null },
      range: { value: new three.Vector2(0, 1) },
      nodal: { value: false },
      plain: { value: new three.Vector3(...rgbOf(plain)).divideScalar(255) },
      opacity: { value: 1 },
    });
    material.side = three.DoubleSide;
    material.defines = { COLORING: UNCOLORED };
    return material;
  }

  /** Return a material whose vertices move as `moved.glsl` says. */
  private material(vertex: string, fragmentShader: string, own: Record<string, three.IUniform>) {
    const uniforms = { ...this.motion, ...own };
    const vertexShader = movedSource + vertex;
    const glslVersion = three.GLSL3;
    return new three.ShaderMaterial({ glslVersion, vertexShader, fragmentShader, uniforms });
  }

  private replace(name: string, values: Float32Array | Uint8Array): void {
    const attribute = this.geometry.getAttribute(name) as three.BufferAttribute;
    attribute.array.set(values);
    attribute.needsUpdate = true;
    this.invalidate();
  }

  /** Let a geometry use the buffers of the surface with corners of its own. */
  private shareBuffers(geometry: three.BufferGeometry, corners: Uint32Array): void {
    geometry.setIndex(new three.BufferAttribute(corners, 1));
    for (const [name, attribute] of Object.entries(this.geometry.attributes))
      geometry.setAttribute(name, attribute);
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.stage;
    if (!width || !height) return;
    this.renderer?.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  private draw(): void {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    if (this.vertices.length) this.renderer?.render(this.scene, this.camera);
  }
}

/** Return unit normals at the vertices, weighted by the areas of the faces. */
function vertexNormals(points: Float32Array, faces: Uint32Array): Float32Array {
  const surface = new three.BufferGeometry();
  surface.setAttribute("position", new three.BufferAttribute(points, 3));
  surface.setIndex(new three.BufferAttribute(faces, 1)).computeVertexNormals();
  return surface.getAttribute("normal").array as Float32Array;
}
