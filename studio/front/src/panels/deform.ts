/** Deform: choose regions, move them, and let the shape follow (chapter 6 of the thesis). */

import type { App, Panel } from "../app";
import type { Change, DeformMode, Handle, State, Vec3 } from "../core/backend";
import { BoxTool } from "../core/box";
import { partColors } from "../core/colors";
import { button, chooseFile, chooseFiles, download, h } from "../core/dom";
import { selectBox, Surface } from "../core/geodesic";
import { MotionTool, type MotionKind } from "../core/gizmo";
import { add, middleOf, regionBoundary } from "../core/motion";
import { cutTree, relabel } from "../core/parts";
import { FIXED, Regions } from "../core/regions";
import type { PointerTool } from "../core/viewer";
import { buildChoice, ProgressBar, Slider } from "./controls";

const REST = 150; // ms without motion after which the exact result is requested
const COLORS = ["#e08a2e", "#3b8fd4", "#46a564", "#b468c8", "#4f6072"]; // of the regions, and fixed
const NAMES = { 0: "1", 1: "2", 2: "3", 3: "4", [FIXED]: "Fixed" };
const SELECTORS = { box: "Box", brush: "Brush", part: "Part" };
const MOTIONS = { rotate: "Rotate", move: "Move", pull: "Pull", swing: "Swing", pivot: "Pivot" };
const HINTS: Record<Tool, string> = {
  box: "Drag the handles of the box.",
  brush: "Paint on the surface. Shift erases.",
  part: "Click on parts. Shift removes them.",
  rotate: "Drag a ring: the region turns about the pivot.",
  move: "Drag an arrow: the region moves.",
  pull: "Drag a point of the region: it moves in the plane of the screen.",
  swing: "Drag a point of the region: it turns about the pivot.",
  pivot: "Drag the pivot, about which the region turns.",
};
const SHORTCUTS: Record<Tool, string> = {
  box: "B", brush: "P", part: "A", rotate: "R", move: "G", pull: "D", swing: "W", pivot: "V",
};
const AXES = ["x", "y", "z"];
const LOADABLE = ".ply,.obj,.off,.stl,.glb";

type Selector = keyof typeof SELECTORS;
type Tool = Selector | MotionKind;

export class DeformPanel implements Panel {
  readonly id = "deform";
  readonly title = "Deform";
  readonly needs = ["rig", "finish"];
  private app!: App;
  private regions = new Regions(0);
  private region = 0; // that the tools change
  private tool: Tool = "brush";
  private box!: BoxTool;
  private mover!: MotionTool;
  private surface: Surface | null = null;
  private labels: Int32Array | null = null; // part of each vertex
  private rows: number[] = []; // the region of each row of the shares
  private handles: Handle[] = []; // of each region
  private pivots: (Vec3 | null)[] = []; // that the person chose; otherwise the middle of the rim
  private bindings = 0; // counts requests, so that only the last answer is used
  private motions = 0;
  private resting = 0;
  private pose = "";
  private active = false;
  private stopPicking = () => {};

  private readonly root = h("div");
  private readonly progress = new ProgressBar("rig-progress");
  private readonly regionChoice = buildChoice("region", NAMES, (id) => this.chooseRegion(Number(id)));
  private readonly selectors = buildChoice("tool", SELECTORS, (id) => this.chooseTool(id as Tool));
  private readonly motionChoice = buildChoice("tool", MOTIONS, (id) => this.chooseTool(id as Tool));
  private readonly hint = h("p", { class: "note", "data-test": "hint" });
  private readonly count = h("span", { class: "faint", "data-test": "region-count" });
  private readonly bound = h("p", { class: "note", "data-test": "bound" });
  private readonly corners = ["low", "high"].map((name) =>
    AXES.map((axis, i) => numberInput(`box-${name}-${i}`, `${name} ${axis}`, () => this.readBox())),
  );
  private readonly boxOptions = h(
    "div", { class: "corners" }, "low", ...this.corners[0]!, "high", ...this.corners[1]!,
  );
  private readonly radius = new Slider("Radius, of the extent", "brush-radius", (value) => this.setRadius(value));
  private readonly nParts = new Slider("Number of parts", "region-parts", (value) => this.showParts(value));
  private readonly mode = choice("mode", "Method", ["graded", "uncrossed", "thesis"]);
  private readonly nModes = numberInput("n-modes", "Number of modes that spread the motion; automatic if empty", () => this.bind());
  private readonly several = checkbox("several", "Several motions at once", () => this.showTools());
  private readonly apply = button("Apply", "apply", "Apply the motions (Enter)", () => this.commit());
  private readonly exactKind = choice("exact-kind", "Motion in numbers", [
    ...AXES.map((axis) => `Rotate about ${axis}, °`), ...AXES.map((axis) => `Move along ${axis}`),
  ]);
  private readonly amount = numberInput("exact-amount", "Amount", () => {});
  private readonly undo = button("Undo", "undo", "Undo (Ctrl+Z)", () => this.change({ kind: "undo" }, "Undoing"));
  private readonly redo = button("Redo", "redo", "Redo (Ctrl+Shift+Z)", () => this.change({ kind: "redo" }, "Redoing"));
  private readonly reset = button("Reset", "reset", "Undo all edits", () => this.change({ kind: "reset" }, "Undoing all"));
  private readonly skeleton = checkbox("skeleton", "Skeleton of", () => this.showSkeleton());
  private readonly skeletonModes = numberInput("skeleton-modes", "Modes of the skeleton", () => this.showSkeleton());
  private readonly crossings = checkbox("crossings", "Crossing faces in red", () => this.showCrossings());
  private readonly ring = h("div", { class: "ring", hidden: true });

  build(app: App): HTMLElement {
    this.app = app;
    this.box = new BoxTool(app.viewer, () => this.boxMoved(), () => this.bind());
    this.mover = new MotionTool(app.viewer, {
      canDrag: (vertex) => this.canDrag(vertex),
      moved: (handle) => this.moved(handle),
      released: () => this.several.input.checked || this.commit(),
      pivoted: (pivot) => (this.pivots[this.region] = pivot),
    });
    app.viewer.stage.append(this.ring);
    app.viewer.canvas.addEventListener("pointermove", (event) => this.moveRing(event));
    this.regionChoice.element.querySelectorAll("button").forEach((each, number) => {
      each.style.setProperty("--swatch", COLORS[number]!);
      each.classList.add("swatch");
    });
    this.radius.setRange(0.01, 0.5, 0.005);
    this.radius.show(app.settings.get("radius", 0.1), "");
    this.nParts.setRange(2, 30, 1);
    this.skeletonModes.valueAsNumber = 50;
    this.nModes.placeholder = "auto";
    this.amount.placeholder = "amount";
    this.amount.addEventListener("keydown", ({ key }) => key === "Enter" && this.moveExactly());
    this.exactKind.className = "wide";
    for (const [tool, key] of Object.entries(SHORTCUTS)) {
      const label = { ...SELECTORS, ...MOTIONS }[tool as Tool];
      app.shortcut(key, `Deform: ${label.toLowerCase()}`, () => (app.open(this.id), this.chooseTool(tool as Tool)));
    }
    app.shortcut("Enter", "Apply the motions", () => this.commit());
    app.shortcut("Escape", "Drop the motion", () => this.drop());
    const exact = button("Go", "exact-go", "Move the region by this amount", () => this.moveExactly());
    const clear = button("Clear", "clear", "Empty this region", () => this.clear());
    this.root.append(
      this.progress.element,
      h("h3", {}, "Region"), this.regionChoice.element, this.selectors.element,
      this.boxOptions, this.radius.element, this.nParts.element,
      h("div", { class: "row" }, clear, this.count),
      h("h3", {}, "Motion"), this.motionChoice.element, this.hint,
      h("div", { class: "row tight" }, this.exactKind, this.amount, exact), this.bound,
      h("div", { class: "row tight" }, "Method", this.mode, "Modes", this.nModes),
      h("div", { class: "row" }, this.several.element, this.apply),
      h("h3", {}, "Edits"),
      h("div", { class: "row tight" }, this.undo, this.redo, this.reset,
        button("Save", "save-edits", "Save the edits as JSON", () => this.save("edits", "json")),
        button("Load", "load-edits", "Apply saved edits. If they were made on another mesh of this shape, choose its file, too", () => this.replay()),
      ),
      h("h3", {}, "Show"),
      h("div", { class: "row" }, this.skeleton.element, this.skeletonModes, "modes"),
      h("div", { class: "row" }, this.crossings.element),
      h("h3", {}, "Export"),
      h("div", { class: "row" },
        ...["ply", "obj", "glb"].map((type) =>
          button(type.toUpperCase(), `export-${type}`, `Save as ${type.toUpperCase()}`, () => this.save(type, type)),
        ),
        button("Pose to a file …", "transfer", "Carry this pose to another shape", () => this.transfer()),
      ),
    );
    this.regionChoice.press("0");
    return this.root;
  }

  refresh(state: State): void {
    const { deformation } = state;
    const pose = `${state.shape} ${state.pose} ${deformation.status}`;
    this.progress.show(deformation);
    this.undo.disabled = this.reset.disabled = !deformation.n_edits;
    this.redo.disabled = !deformation.n_redoable;
    if (pose === this.pose) {
      if (this.tool === "part" && !this.labels && state.parts.status === "ready") this.loadParts();
      return;
    }
    if (state.shape !== Number(this.pose.split(" ")[0] || NaN)) this.startShape(state);
    this.pose = pose;
    [this.surface, this.handles] = [null, []];
    this.paint();
    this.bind();
    if (this.skeleton.input.checked) this.showSkeleton();
    if (this.crossings.input.checked) this.showCrossings();
  }

  shown(): void {
    this.active = true;
    this.stopPicking = this.app.viewer.onPick((hit, event) => this.pickPart(hit.vertex, event.shiftKey));
    this.paint();
    this.showTools();
  }

  hidden(): void {
    this.active = false;
    this.stopPicking();
    this.drop();
    this.showTools();
    this.paint();
  }

  /** Begin with a new shape: without regions, or with those of before a reload. */
  private startShape({ shape, n_vertices }: State): void {
    this.regions = new Regions(n_vertices);
    [this.pivots, this.labels] = [[], null];
    const kept = this.app.settings.get("regions", { shape: -1, text: "", tool: this.tool, region: 0 });
    if (kept.shape === shape) {
      this.regions.read(kept.text);
      [this.tool, this.region] = [kept.tool, kept.region];
      this.regionChoice.press(String(this.region));
    }
    // The first box holds what is above the middle, and nothing touches its other sides.
    const { box, extent } = this.app.viewer;
    const [low, high] = [box.min, box.max].map((corner) => corner.toArray()) as [Vec3, Vec3];
    const up = this.app.state.up.map(Math.abs).indexOf(1);
    for (let axis = 0; axis < 3; axis++) {
      low[axis] = axis === up ? (low[axis]! + high[axis]!) / 2 : low[axis]! - 0.02 * extent;
      high[axis]! += 0.02 * extent;
    }
    [this.box.low, this.box.high] = [low, high];
    this.writeBox();
  }

  private chooseRegion(region: number): void {
    this.region = region;
    this.regionChoice.press(String(region));
    this.remember();
    this.showTools();
  }

  private chooseTool(tool: Tool): void {
    this.tool = tool;
    this.remember();
    this.showTools();
    if (tool === "box" && !this.regions.vertices(this.region).length) this.boxMoved();
    if (tool === "box") this.bind();
  }

  /** Show what belongs to the tool: its options, its handles, the cursor. */
  private showTools(): void {
    const { tool, app } = this;
    const { viewer } = app;
    const selects = tool in SELECTORS;
    this.selectors.press(tool);
    this.motionChoice.press(tool);
    this.hint.textContent = HINTS[tool];
    this.boxOptions.hidden = tool !== "box";
    this.radius.element.hidden = tool !== "brush";
    this.nParts.element.hidden = tool !== "part" || !this.labels;
    this.apply.hidden = !this.several.input.checked;
    this.setRadius(this.radius.value);
    const on = this.active && this.app.state;
    viewer.setMode(on && (tool === "part" || tool === "brush") ? tool : "orbit");
    viewer.tool = !on ? null : tool === "brush" ? this.brush : tool === "box" ? this.box : this.mover;
    if (on && tool === "box") this.box.show(this.box.low, this.box.high);
    else this.box.hide();
    const row = this.rows.indexOf(this.region);
    const ready = this.root.dataset.ready === "true";
    if (on && !selects && ready && row >= 0) this.mover.show(this.pivotOf(this.region), tool as MotionKind);
    else this.mover.hide();
    if (on && tool === "part") this.loadParts();
    else if (viewer.labels === this.labels && this.labels) viewer.setLabels(null);
    this.ring.hidden = true;
  }

  /** Tint the regions, and say how many vertices the chosen one has. */
  private paint(): void {
    const { viewer } = this.app;
    COLORS.forEach((color, region) =>
      viewer.setMarks(this.active ? this.regions.vertices(region) : [], color, `region ${region}`),
    );
    const count = this.regions.vertices(this.region).length;
    this.count.textContent = `${count.toLocaleString("en")} vertices in ${this.region === FIXED ? "the fixed part" : `region ${this.region + 1}`}`;
  }

  private remember(): void {
    const { region, tool } = this;
    this.app.settings.set("regions", { shape: this.app.state.shape, text: this.regions.write(), tool, region });
    this.paint();
  }

  private clear(): void {
    this.regions.clear(this.region);
    this.pivots[this.region] = null;
    this.selected();
  }

  /** A selection has ended: keep it, and bind the regions. */
  private selected(): void {
    this.remember();
    this.bind();
  }

  private boxMoved(): void {
    this.regions.clear(this.region);
    // A box that passes over another region leaves that region as it is.
    const inside = selectBox(this.app.viewer.vertices, this.box.low, this.box.high);
    this.regions.add(this.region, inside.filter((vertex) => this.regions.of(vertex) === null));
    this.writeBox();
    this.remember();
    this.root.dataset.ready = "false";
  }

  private writeBox(): void {
    [this.box.low, this.box.high].forEach((corner, i) =>
      corner.forEach((value, axis) => (this.corners[i]![axis]!.value = String(Number(value.toPrecision(5))))),
    );
  }

  private readBox(): void {
    const [low, high] = this.corners.map((row) => row.map((input) => input.valueAsNumber)) as [Vec3, Vec3];
    if (!low.every((value, axis) => value <= high[axis]!)) return;
    this.box.show(low, high);
    this.boxMoved();
    this.bind();
  }

  private setRadius(share: number): void {
    this.radius.show(share, `${(100 * share).toFixed(1)} %`);
    this.app.settings.set("radius", share);
  }

  private moveRing(event: PointerEvent): void {
    const reach = this.app.viewer.pixelsOf(this.radius.value * this.app.viewer.extent);
    this.ring.hidden = !this.active || this.tool !== "brush";
    const { style } = this.ring;
    style.width = style.height = `${2 * reach}px`;
    style.left = `${event.offsetX - reach}px`;
    style.top = `${event.offsetY - reach}px`;
  }

  /** A stroke adds the disc along the surface around each vertex that it meets. */
  private readonly brush: PointerTool = {
    down: (event) => this.stroke(event),
    move: (event) => void this.stroke(event),
    up: () => this.selected(),
  };

  private stroke(event: PointerEvent): boolean {
    const { viewer } = this.app;
    const hit = viewer.pick(event.offsetX, event.offsetY);
    if (!hit) return false;
    this.surface ??= new Surface(viewer.vertices, viewer.faces);
    const disc = this.surface.disc(hit.vertex, this.radius.value * viewer.extent);
    if (event.shiftKey) this.regions.remove(this.region, disc);
    else this.regions.add(this.region, disc);
    this.root.dataset.ready = "false";
    this.paint();
    return true;
  }

  private async loadParts(): Promise<void> {
    const { app } = this;
    const { status, n_regions } = app.state.parts;
    if (status === "none") return this.change({ kind: "parts" }, "Finding the parts");
    if (status !== "ready") return;
    if (!this.labels) this.nParts.show(n_regions, String(n_regions));
    this.labels ??= new Int32Array();
    this.nParts.element.hidden = false;
    await this.showParts(this.nParts.value);
  }

  private async showParts(count: number): Promise<void> {
    const { backend, viewer } = this.app;
    this.nParts.show(count, String(count));
    const [finest, rows] = await Promise.all([backend.array("parts/labels"), backend.array("parts/merges")]);
    const labels = finest.data as Int32Array;
    const merges = { count: labels.reduce((one, other) => Math.max(one, other), 0) + 1, rows: rows.data as Float64Array };
    this.labels = relabel(labels, cutTree(merges, { count }).parts);
    if (this.active && this.tool === "part") viewer.setLabels(this.labels, partColors(merges.count));
  }

  private pickPart(vertex: number, remove: boolean): void {
    const part = this.labels?.[vertex];
    if (this.tool !== "part" || part === undefined) return;
    const vertices: number[] = [];
    this.labels!.forEach((label, each) => label === part && vertices.push(each));
    if (remove) this.regions.remove(this.region, vertices);
    else this.regions.add(this.region, vertices);
    this.selected();
  }

  /** Ask by how much each vertex follows each region; then the regions can be moved. */
  private async bind(): Promise<void> {
    const { app, regions } = this;
    const turn = ++this.bindings;
    const chosen = [0, 1, 2, 3].map((region) => regions.vertices(region));
    const fixed = regions.vertices(FIXED);
    this.root.dataset.ready = "false";
    this.bound.textContent = "";
    this.rows = [0, 1, 2, 3].filter((region) => chosen[region]!.length);
    if (this.rows.length && app.state.deformation.status === "ready") {
      const request = {
        n_modes: this.nModes.valueAsNumber || null,
        regions: this.rows.map((region) => chosen[region]!),
        fixed: fixed.length ? fixed : null,
      };
      const answer = await app.run("Binding the regions", app.backend.rig(request)).catch(() => null);
      if (turn !== this.bindings) return;
      if (answer) {
        app.viewer.setShares(answer.shares, this.rows.length);
        this.bound.textContent = `Ready: the motion is spread by ${answer.n_modes.join(", ")} modes.`;
        this.root.dataset.ready = "true";
      }
    }
    this.showTools();
  }

  private pivotOf(region: number): Vec3 {
    const { vertices, faces } = this.app.viewer;
    const rim = regionBoundary(faces, this.regions.mask(region));
    return this.pivots[region] ?? middleOf(vertices, rim.length ? rim : this.regions.vertices(region));
  }

  /** A drag may begin on any region that is bound; it becomes the chosen one. */
  private canDrag(vertex: number): boolean {
    const region = this.regions.of(vertex);
    if (region === null || region === FIXED || this.root.dataset.ready !== "true") return false;
    if (region !== this.region) this.chooseRegion(region);
    return true;
  }

  private rowHandles(): Handle[] {
    return this.rows.map((region) => this.handles[region] ?? null);
  }

  /** Show a motion by shares at once, and the exact result when the pointer rests. */
  private moved(handle: Handle): void {
    this.handles[this.region] = handle;
    this.app.viewer.setHandles(this.rowHandles());
    const turn = ++this.motions;
    clearTimeout(this.resting);
    this.resting = window.setTimeout(async () => {
      const change: Change = { kind: "preview", handles: this.rowHandles(), mode: this.deformMode };
      const done = await this.app.backend.finish(change).catch((error) => this.app.fail(error));
      if (done && turn === this.motions) this.app.viewer.setExact(done.arrays.vertices!.data as Float32Array);
    }, REST);
  }

  private get deformMode(): DeformMode {
    return this.mode.value as DeformMode;
  }

  private async commit(): Promise<void> {
    const handles = this.rowHandles();
    if (this.root.dataset.ready !== "true" || !handles.some((handle) => handle)) return;
    this.endMotion();
    this.root.dataset.ready = "false";
    this.rows.forEach((region, row) => {
      const [pivot, handle] = [this.pivots[region], handles[row]];
      if (pivot && handle?.type === "translation") this.pivots[region] = add(pivot, handle.vector);
    });
    const change: Change = { kind: "commit", handles, mode: this.deformMode };
    const done = await this.app.change(change, "Bending the shape").catch(() => null);
    if (!done) this.drop();
  }

  private endMotion(): void {
    this.motions++;
    clearTimeout(this.resting);
    this.mover.hide();
  }

  /** Forget the motion that was not committed. */
  private drop(): void {
    this.endMotion();
    this.handles = [];
    this.app.viewer.setHandles([]);
    this.showTools();
  }

  private async moveExactly(): Promise<void> {
    const [kind, amount] = [this.exactKind.selectedIndex, this.amount.valueAsNumber];
    if (!amount || !this.rows.includes(this.region)) return;
    const axis = AXES.map((_, i) => Number(i === kind % 3)) as Vec3;
    const pivot = this.pivotOf(this.region);
    if (kind < 3) this.moved({ type: "rotation", pivot, axis, angle: (amount * Math.PI) / 180 });
    else this.moved({ type: "translation", vector: axis.map((one) => one * amount) as Vec3 });
    if (!this.several.input.checked) await this.commit();
  }

  private async change(change: Change, text: string): Promise<void> {
    await this.app.change(change, text).catch(() => {}); // the status line has told the error
  }

  private async showSkeleton(): Promise<void> {
    const { backend, viewer } = this.app;
    const name = `skeleton/${this.skeletonModes.valueAsNumber}`;
    if (!this.skeleton.input.checked) return viewer.setSkeleton(null);
    const points = await this.app.run("Computing the skeleton", backend.array(name)).catch(() => null);
    if (points) viewer.setSkeleton(points.data as Float32Array);
  }

  private async showCrossings(): Promise<void> {
    const { backend, viewer } = this.app;
    if (!this.crossings.input.checked) return viewer.markFaces([]);
    const pairs = await this.app.run("Looking for crossing faces", backend.array("crossings")).catch(() => null);
    if (!pairs) return;
    const faces = [...new Set(pairs.data)];
    viewer.markFaces(faces);
    this.app.say(faces.length ? `${pairs.shape[0]} pairs of faces cross.` : "No faces cross.");
  }

  private async save(array: string, ending: string): Promise<void> {
    const name = this.app.state.name.replace(/\.\w+$/, "");
    const file = await this.app.run("Writing the file", this.app.backend.array(`file/${array}`)).catch(() => null);
    if (file) download(file.data as Uint8Array<ArrayBuffer>, `${name}.${ending}`);
  }

  private async replay(): Promise<void> {
    const files = await chooseFiles(`.json,${LOADABLE}`);
    const written = files.find(({ name }) => name.endsWith(".json"));
    const source = files.find((file) => file !== written);
    if (!written) return this.app.say("Choose a JSON file of edits.");
    const edits = JSON.parse(new TextDecoder().decode(written.bytes));
    const change: Change = { kind: "replay", edits, source: source?.name, sourceFile: source?.bytes };
    await this.change(change, "Applying the edits");
  }

  private async transfer(): Promise<void> {
    const { name, bytes } = await chooseFile(LOADABLE);
    await this.change({ kind: "transfer", name, file: bytes }, "Carrying the pose over");
  }
}

function numberInput(name: string, label: string, onChange: () => void): HTMLInputElement {
  const attributes = { type: "number", step: "any", title: label, "aria-label": label, "data-test": name };
  return h("input", { ...attributes, onchange: onChange });
}

function checkbox(name: string, label: string, onChange: () => void) {
  const input = h("input", { type: "checkbox", "data-test": name, onchange: onChange });
  return { input, element: h("label", {}, input, label) };
}

function choice(name: string, label: string, options: string[]): HTMLSelectElement {
  const entries = options.map((option) => h("option", {}, option));
  return h("select", { title: label, "aria-label": label, "data-test": name }, ...entries);
}
