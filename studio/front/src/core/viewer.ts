/** The picture: one mesh, its colors and its motion; drawn only when something changed. */

import * as three from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Handle, Vec3 } from "./backend";
import { buildLegend, colorMap } from "./colors";
import { h } from "./dom";
import { vertexNormals } from "./motion";
import { Picker, type Hit } from "./picking";
import { MAX_REGIONS, POINT_FRAGMENT, POINT_VERTEX, SURFACE_FRAGMENT, SURFACE_VERTEX } from "./shaders";

export type { Hit };
export type PointerMode = "orbit" | "box" | "brush" | "part" | "drag" | "source";
/** A camera that survives a reload; `shape` says which mesh it looked at. */
export interface View {
  shape: number;
  position: Vec3;
  target: Vec3;
}
/** Takes over the pointer: returns false to leave it to the camera. */
export interface PointerTool {
  down(event: PointerEvent): boolean;
  move(event: PointerEvent): void;
  up(event: PointerEvent): void;
}

const MOST_PIXELS = 1.5; // device pixels for each pixel of the page: more costs much and shows little
const FIELD_OF_VIEW = 26; // degrees: almost parallel, as in the library's pictures
const MARGIN = 0.84; // share of the window that the shape fills
const CLICK = 4; // pixels that a click may move
const FADE = 160; // ms in which the exact result blends in
const PLAIN = "#cdc8c0";

export class Viewer {
  /** Number of the mesh that is shown; views of another mesh are not restored. */
  shape = -1;
  onView: (view: View) => void = () => {};
  tool: PointerTool | null = null;
  /** Everything in the coordinates of the mesh; the scene around it has size 1 at any unit. */
  readonly space = new three.Group();
  readonly scene = new three.Scene();
  readonly camera = new three.PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 100);
  readonly canvas: HTMLCanvasElement = h("canvas", { tabindex: "0", "data-test": "canvas" });
  readonly geometry = new three.BufferGeometry();
  controls: OrbitControls;
  vertices: Float32Array = new Float32Array(0);
  faces: Uint32Array = new Uint32Array(0);
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
  private readonly surface: three.Mesh<three.BufferGeometry, three.ShaderMaterial>;
  private readonly skeleton: three.Mesh<three.BufferGeometry, three.ShaderMaterial>;
  private readonly discs: three.Points<three.BufferGeometry, three.ShaderMaterial>;
  private readonly layers = new Map<string, { vertices: ArrayLike<number>; color: string }>();
  private readonly watch = new ResizeObserver(() => this.resize());
  private readonly listeners = new Set<(hit: Hit, event: PointerEvent) => void>();
  private legend: HTMLElement | null = null;
  private mode: PointerMode = "orbit";
  private frame = 0;
  private fading = 0;
  private up: Vec3 = [0, 1, 0];
  private front: Vec3 = [0, 0, 1];

  constructor(readonly stage: HTMLElement) {
    stage.append(this.canvas);
    this.canvas.setAttribute("aria-label", "The shape. Arrow keys turn it, + and - zoom.");
    this.surface = new three.Mesh(this.geometry, this.surfaceMaterial(PLAIN));
    this.skeleton = new three.Mesh(new three.BufferGeometry(), this.surfaceMaterial("#3f7fae"));
    this.discs = new three.Points(new three.BufferGeometry(), this.pointMaterial());
    this.skeleton.visible = this.discs.visible = false;
    this.surface.renderOrder = 1;
    this.skeleton.renderOrder = 2; // over the veil of the surface, also where it lies behind it
    this.skeleton.material.transparent = true;
    this.discs.renderOrder = 3;
    for (const object of [this.skeleton, this.surface, this.discs]) {
      object.frustumCulled = false; // the shader moves vertices out of the box of the geometry
      this.space.add(object);
    }
    this.scene.add(this.space);
    this.renderer = this.startRenderer();
    this.picker = this.renderer && new Picker(this.renderer, this.geometry, this.motion);
    this.controls = this.startControls();
    this.listenToPointer();
    this.watch.observe(stage);
    this.resize();
  }

  setMesh(vertices: Float32Array, faces: Uint32Array, up: Vec3, front: Vec3): void {
    const count = vertices.length / 3;
    [this.vertices, this.faces, this.up, this.front] = [vertices, faces, up, front];
    this.geometry.dispose();
    const attribute = (name: string, array: Float32Array | Uint8Array, size: number) =>
      this.geometry.setAttribute(name, new three.BufferAttribute(array, size, array instanceof Uint8Array));
    this.geometry.setIndex(new three.BufferAttribute(faces, 1));
    attribute("position", vertices, 3);
    attribute("normal", vertexNormals(vertices, faces), 3);
    attribute("exact", vertices.slice(), 3);
    attribute("exact_normal", new Float32Array(3 * count), 3);
    attribute("shares", new Float32Array(MAX_REGIONS * count), MAX_REGIONS);
    attribute("value", new Float32Array(count), 1);
    attribute("paint", new Uint8Array(3 * count), 3);
    attribute("mark", new Uint8Array(4 * count), 4);
    this.layers.clear();
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
  setVertices(vertices: Float32Array): void {
    this.vertices = vertices;
    this.replace("position", vertices);
    this.replace("normal", vertexNormals(vertices, this.faces));
    this.setHandles([]);
  }

  /** Set by how much each vertex follows each region: row r of `shares` is region r. */
  setShares(shares: Float32Array, nRegions: number): void {
    const count = this.vertices.length / 3;
    const packed = new Float32Array(MAX_REGIONS * count);
    for (let region = 0; region < nRegions; region++)
      for (let vertex = 0; vertex < count; vertex++)
        packed[MAX_REGIONS * vertex + region] = shares[region * count + vertex]!;
    this.replace("shares", packed);
  }

  /** Show the motion of the regions by shares, computed in the shader. */
  setHandles(handles: Handle[]): void {
    const { kind, pivot, direction, angle } = this.motion;
    this.motion.n_moving.value = handles.some((handle) => handle) ? handles.length : 0;
    for (let region = 0; region < MAX_REGIONS; region++) {
      const handle = handles[region] ?? null;
      kind.value[region] = handle ? (handle.type === "rotation" ? 1 : 2) : 0;
      if (handle?.type === "rotation") {
        pivot.value[region]!.set(...handle.pivot);
        direction.value[region]!.set(...handle.axis);
        angle.value[region] = handle.angle;
      } else if (handle) direction.value[region]!.set(...handle.vector);
    }
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
  setScalars(
    values: Float32Array | null,
    o: { map: string; range: [number, number]; nodal?: boolean; title: string; unit?: string } | null = null,
  ): void {
    const uniforms = this.surface.material.uniforms;
    this.legend?.remove();
    this.legend = null;
    this.labels = null;
    this.setColoring(values && o ? 1 : 0);
    if (values && o) {
      this.replace("value", values);
      const colors = colorMap(o.map);
      const bytes = new Uint8Array(1024).map((_, i) => (i % 4 === 3 ? 255 : colors[3 * (i >> 2) + (i % 4)]!));
      uniforms.table!.value?.dispose();
      uniforms.table!.value = new three.DataTexture(bytes, 256, 1);
      uniforms.table!.value.needsUpdate = true;
      uniforms.range!.value.set(...o.range);
      uniforms.nodal!.value = o.nodal ?? false;
      this.legend = buildLegend(o.title, o.unit ?? "", o.map, o.range);
      this.stage.append(this.legend);
    }
    this.invalidate();
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
    this.setColoring(2);
  }

  private setColoring(kind: number): void {
    const { material } = this.surface;
    if (material.defines.COLORING === kind) return;
    material.defines.COLORING = kind;
    material.needsUpdate = true;
  }

  /** Tint vertices. Each layer has its own vertices and color. */
  setMarks(vertices: ArrayLike<number>, color: string, layer = "marks"): void {
    if (vertices.length) this.layers.set(layer, { vertices, color });
    else if (!this.layers.delete(layer)) return;
    const marks = new Uint8Array((4 * this.vertices.length) / 3);
    for (const one of this.layers.values()) {
      const hex = new three.Color(one.color).getHex(three.SRGBColorSpace);
      const tint = [hex >> 16, (hex >> 8) & 255, hex & 255, 190];
      for (let place = 0; place < one.vertices.length; place++) marks.set(tint, 4 * one.vertices[place]!);
    }
    this.replace("mark", marks);
  }

  /** Mark vertices by discs of constant size on the screen, of one color or one each. */
  setPoints(vertices: ArrayLike<number>, colors: string | string[]): void {
    this.discs.visible = vertices.length > 0;
    this.shareBuffers(this.discs.geometry, Uint32Array.from(vertices));
    const tints = new Float32Array(this.vertices.length);
    for (let place = 0; place < vertices.length; place++) {
      const color = this.colorOf(typeof colors === "string" ? colors : colors[place]!);
      tints.set(color.toArray(), 3 * vertices[place]!);
    }
    this.discs.geometry.setAttribute("tint", new three.BufferAttribute(tints, 3));
    this.invalidate();
  }

  /** Tint the corners of faces in red. */
  markFaces(faces: ArrayLike<number>): void {
    const corners = Array.from(faces, (face) => [...this.faces.subarray(3 * face, 3 * face + 3)]);
    this.setMarks(corners.flat(), "#d8301f", "crossing");
  }

  /** Show the eigen-skeleton in a veil of the surface. */
  setSkeleton(points: Float32Array | null): void {
    this.skeleton.visible = points !== null;
    if (points) {
      this.shareBuffers(this.skeleton.geometry, this.faces);
      this.skeleton.geometry.setAttribute("position", new three.BufferAttribute(points, 3));
      const normals = vertexNormals(points, this.faces);
      this.skeleton.geometry.setAttribute("normal", new three.BufferAttribute(normals, 3));
    }
    const material = this.surface.material;
    material.transparent = points !== null;
    material.depthWrite = points === null;
    material.uniforms.opacity!.value = points ? 0.28 : 1;
    this.invalidate();
  }

  pick(x: number, y: number): Hit | null {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!this.picker || !this.faces.length || !width) return null;
    this.camera.updateMatrixWorld();
    return this.picker.pick(x, y, width, height, this.camera, this.space.matrixWorld);
  }

  readPositions(): Float32Array {
    return this.picker?.readPositions() ?? new Float32Array(0);
  }

  screenshot(): Promise<Blob> {
    this.draw(); // a drawing buffer is readable only in the turn in which it was drawn
    return new Promise((resolve, reject) =>
      this.canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("There is no picture.")))),
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

  /** Call back with what was clicked, in every mode but "orbit"; returns how to stop. */
  onPick(callback: (hit: Hit, event: PointerEvent) => void): () => void {
    this.listeners.add(callback);
    return () => this.listeners.delete(callback);
  }

  setMode(mode: PointerMode): void {
    this.mode = mode;
    this.canvas.style.cursor = mode === "orbit" ? "grab" : mode === "drag" ? "pointer" : "crosshair";
  }

  /** Show the whole shape upright, from its front left and a little from above. */
  fit(): void {
    const up = new three.Vector3(...this.up);
    const front = new three.Vector3(...this.front);
    const side = up.clone().cross(front);
    const towards = front.multiplyScalar(0.78).addScaledVector(side, 0.48).addScaledVector(up, 0.4).normalize();
    const right = up.clone().cross(towards).normalize();
    const above = towards.clone().cross(right);
    const tangent = Math.tan((FIELD_OF_VIEW * Math.PI) / 360);
    const halves = [tangent * this.camera.aspect * MARGIN, tangent * MARGIN] as const;
    // A vertex (x, y, z), z towards the camera, is in the picture if the camera stands at least
    // x / tan away from it in z, and so on each of the four sides. Opposite sides are balanced.
    const low = [Infinity, Infinity];
    const high = [-Infinity, -Infinity];
    const point = new three.Vector3();
    for (let place = 0; place < this.vertices.length; place += 3) {
      point.fromArray(this.vertices, place).applyMatrix4(this.space.matrixWorld);
      const depth = point.dot(towards);
      [right, above].forEach((axis, i) => {
        const reach = point.dot(axis);
        high[i] = Math.max(high[i]!, reach + depth * halves[i]!);
        low[i] = Math.min(low[i]!, reach - depth * halves[i]!);
      });
    }
    const middle = [0, 1].map((i) => (low[i]! + high[i]!) / 2);
    const distance = Math.max(...[0, 1].map((i) => (high[i]! - low[i]!) / 2 / halves[i]!));
    const target = right.multiplyScalar(middle[0]!).addScaledVector(above, middle[1]!);
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(towards, distance);
    this.controls.update();
    this.invalidate();
  }

  setView(view: View): void {
    this.camera.position.set(...view.position);
    this.controls.target.set(...view.target);
    this.controls.update();
    this.invalidate();
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
    const antialias = !rendersInSoftware();
    const context = this.canvas.getContext("webgl2", { antialias, alpha: true });
    if (!context?.getExtension("EXT_color_buffer_float")) {
      this.showNotice("This browser has no WebGL2 with float buffers, which the picture needs. Enable hardware acceleration, or use a recent Chrome, Edge, Firefox or Safari.");
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

  /** Tell clicks from drags, and let the tool of the mode take the pointer before the camera. */
  private listenToPointer(): void {
    let from: [number, number] | null = null;
    let taken = false;
    const before = { capture: true };
    this.canvas.addEventListener(
      "pointerdown",
      (event) => {
        if (event.button !== 0 || !event.isPrimary) return;
        from = [event.offsetX, event.offsetY];
        taken = this.tool?.down(event) ?? false;
        if (!taken) return;
        this.canvas.setPointerCapture(event.pointerId);
        event.stopImmediatePropagation();
      },
      before,
    );
    this.canvas.addEventListener("pointermove", (event) => {
      if (taken) this.tool?.move(event);
    });
    const finish = (event: PointerEvent) => {
      if (taken) this.tool?.up(event);
      else if (from && this.mode !== "orbit" && event.type === "pointerup") {
        const [x, y] = [event.offsetX, event.offsetY];
        const still = Math.hypot(x - from[0], y - from[1]) < CLICK;
        const hit = still ? this.pick(x, y) : null;
        if (hit) for (const listener of this.listeners) listener(hit, event);
      }
      from = null;
      taken = false;
    };
    this.canvas.addEventListener("keydown", (event) => this.turnByKey(event));
    this.canvas.addEventListener("pointerup", finish);
    this.canvas.addEventListener("pointercancel", finish);
  }

  private turnByKey(event: KeyboardEvent): void {
    const { controls } = this;
    const actions: Record<string, () => void> = {
      ArrowLeft: () => controls.rotateLeft(0.1),
      ArrowRight: () => controls.rotateLeft(-0.1),
      ArrowUp: () => controls.rotateUp(0.1),
      ArrowDown: () => controls.rotateUp(-0.1),
      "+": () => controls.dollyIn(1.1),
      "-": () => controls.dollyOut(1.1),
    };
    if (!actions[event.key]) return;
    event.preventDefault();
    actions[event.key]!();
    controls.dispatchEvent({ type: "end" });
  }

  private surfaceMaterial(plain: string): three.ShaderMaterial {
    return new three.ShaderMaterial({
      glslVersion: three.GLSL3,
      side: three.DoubleSide,
      vertexShader: SURFACE_VERTEX,
      fragmentShader: SURFACE_FRAGMENT,
      defines: { COLORING: 0 },
      uniforms: {
        ...this.motion,
        table: { value: null },
        range: { value: new three.Vector2(0, 1) },
        nodal: { value: false },
        plain: { value: this.colorOf(plain) },
        opacity: { value: 1 },
      },
    });
  }

  private pointMaterial(): three.ShaderMaterial {
    return new three.ShaderMaterial({
      glslVersion: three.GLSL3,
      vertexShader: POINT_VERTEX,
      fragmentShader: POINT_FRAGMENT,
      transparent: true,
      uniforms: {
        ...this.motion,
        size: { value: 14 * Math.min(devicePixelRatio, MOST_PIXELS) },
      },
    });
  }

  /** Return a color without conversion: the shaders compute with the numbers of the page. */
  private colorOf(color: string): three.Color {
    const converted = new three.Color(color);
    return new three.Color().setHex(converted.getHex(three.SRGBColorSpace), three.LinearSRGBColorSpace);
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

/** Say whether there is no graphics card: smoothing edges would then double the time of a frame. */
function rendersInSoftware(): boolean {
  const context = document.createElement("canvas").getContext("webgl2");
  if (!context) return false;
  let name = String(context.getParameter(context.RENDERER));
  const info = name === "WebKit WebGL" && context.getExtension("WEBGL_debug_renderer_info");
  if (info) name = String(context.getParameter(info.UNMASKED_RENDERER_WEBGL));
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}
