/** Deform: choose regions, move them, and let the shape follow (chapter 6 of the thesis). */

import type { Panel, Studio } from "../app";
import type { Change, Handle, State, Vec3 } from "../core/backend";
import { partColors, rgbOf } from "../core/colors";
import { Form, h, parseJson } from "../core/dom";
import { cutParts } from "../core/parts";
import { FIXED, Regions } from "../core/regions";
import { BoxTool, MotionTool, type MotionKind } from "../core/tools";
import type { Hit, PointerTool } from "../core/viewer";
import markup from "./deform.html?raw";

const REST = 80; // ms without motion, beside two frames, after which the exact result is requested
const COLORS = ["#e08a2e", "#3b8fd4", "#46a564", "#b468c8", "#4f6072"]; // of the regions, and fixed
const CROSSING = "#d8301f";
const TINT = 190; // of 255: how strongly a region covers the colors below
const AXES = [0, 1, 2];
const SELECTORS = ["box", "brush", "part"]; // the other tools move

type Tool = "box" | "brush" | "part" | MotionKind;
/** What of the panel survives a reload, for the shape of this number. */
interface Kept {
  shape: number;
  text: string; // of the regions
  tool: Tool;
  region: number;
}
const nextFrame = () => new Promise(requestAnimationFrame);

export class DeformPanel implements Panel {
  readonly id = "deform";
  readonly title = "Deform";
  readonly needs = ["rig", "finish"];
  private readonly form = new Form(markup);
  private readonly root = this.form.root;
  private readonly ring = h("div", { class: "ring", hidden: true });
  private app!: Studio;
  private box!: BoxTool;
  private mover!: MotionTool;
  private regions = new Regions(0);
  private kept = ""; // the regions after the last selection, as text
  private region = 0; // that the tools change
  private tool: Tool = "brush";
  private labels: Int32Array | null = null; // part of each vertex
  private crossing: number[] = []; // vertices of faces that cross
  private rows: number[] = []; // the region of each row of the shares
  private handles: Handle[] = []; // of each region
  private rims: Vec3[] = []; // middle of the rim of each region
  private pivots: (Vec3 | undefined)[] = []; // that the person chose instead
  private bindings = 0; // counts requests, so that only the last answer is used
  private motions = 0;
  private painting: Promise<void> = Promise.resolve(); // discs of the brush, one after the other
  private pose = "";
  private active = false;

  build(app: Studio): HTMLElement {
    const { form } = this;
    const { viewer } = app;
    this.app = app;
    this.box = new BoxTool(
      viewer,
      () => this.boxMoved(),
      () => this.selected(),
    );
    this.mover = new MotionTool(viewer, {
      canDrag: (vertex) => this.canDrag(vertex),
      moved: (handle) => this.moved(handle),
      released: () => this.several || this.commit(),
      pivoted: (pivot) => (this.pivots[this.region] = pivot),
    });
    viewer.stage.append(this.ring);
    viewer.canvas.addEventListener("pointermove", (event) => this.moveRing(event));
    COLORS.forEach((color, region) => {
      form.get(`region-${region}`).style.setProperty("--swatch", color);
    });
    for (const name of ["low", "high"])
      form.get("corners").append(name, ...AXES.map((axis) => this.buildCorner(name, axis)));
    form.get("brush-radius").valueAsNumber = app.settings.get("radius", 0.1);
    this.listen();
    return this.root;
  }

  /** Return the input for a coordinate of a corner of the box. */
  private buildCorner(name: string, axis: number): HTMLElement {
    const title = `${name} ${"xyz"[axis]}`;
    const labels = { "data-test": `box-${name}-${axis}`, title, "aria-label": title };
    return h("input", { type: "number", step: "any", ...labels, change: () => this.readBox() });
  }

  /** Let controls and keys do what they say. */
  private listen(): void {
    const { app, form } = this;
    form.onChoice("region", (id) => this.chooseRegion(Number(id)));
    form.onChoice("tool", (id) => this.chooseTool(id as Tool));
    form.on({
      "brush-radius": () => this.showRadius(),
      "region-parts": () => this.showParts(form.number("region-parts")),
      clear: () => this.clear(),
      "exact-go": () => this.moveExactly(),
      "n-modes": () => this.bind(),
      several: () => this.showTools(),
      apply: () => this.commit(),
      undo: () => app.step("undo"),
      redo: () => app.step("redo"),
      reset: () => app.change({ kind: "reset" }, "Undoing all"),
      "save-edits": () => app.save("edits", "json"),
      "load-edits": () => this.replay(),
      skeleton: () => this.showSkeleton(),
      "skeleton-modes": () => this.showSkeleton(),
      crossings: () => this.showCrossings(),
      transfer: () => this.transfer(),
    });
    app.addExports(form);
    form.get("exact-amount").addEventListener("keydown", ({ key }) => {
      if (key === "Enter") this.moveExactly();
    });
    for (const [tool, { dataset, textContent }] of form.choice("tool"))
      app.shortcut(dataset.key!, `Deform: ${textContent!.toLowerCase()}`, () => {
        app.open(this.id);
        this.chooseTool(tool as Tool);
      });
    app.shortcut("Enter", "Apply the motions", () => this.commit());
    app.shortcut("Escape", "Drop the motion", () => this.drop());
  }

  refresh(state: State): void {
    const { form } = this;
    const { deformation, parts } = state;
    form.progress("rig-progress", deformation);
    form.get("reset").disabled = !deformation.n_edits;
    this.showSteps();
    const pose = `${state.shape} ${state.pose} ${deformation.status}`;
    if (pose === this.pose) {
      if (this.tool === "part" && !this.labels && parts.status === "ready") this.loadParts();
      return;
    }
    if (!this.pose.startsWith(`${state.shape} `)) this.startShape(state);
    this.pose = pose;
    [this.handles, this.crossing] = [[], []];
    this.paint();
    this.bind();
    if (form.get("skeleton").checked) this.showSkeleton();
    if (form.get("crossings").checked) this.showCrossings();
  }

  shown(): void {
    this.active = true;
    this.paint();
    this.showTools();
  }

  hidden(): void {
    this.active = false;
    this.drop();
    this.paint();
  }

  /** Begin with a new shape: without regions, or with those of before a reload. */
  private startShape({ shape, n_vertices, up }: State): void {
    this.regions = new Regions(n_vertices);
    [this.pivots, this.labels] = [[], null];
    const kept = this.app.settings.get<Kept | null>("regions", null);
    if (kept?.shape === shape) {
      this.regions.read(kept.text);
      [this.tool, this.region] = [kept.tool, kept.region];
    }
    this.kept = this.regions.write();
    this.form.press("region", String(this.region));
    // The first box holds what is above the middle, and nothing touches its other sides.
    const { box, extent } = this.app.viewer;
    const around = box.clone().expandByScalar(0.02 * extent);
    const [low, high] = [around.min.toArray(), around.max.toArray()];
    const upward = up.map(Math.abs).indexOf(1);
    if (upward >= 0) low[upward] = (low[upward]! + high[upward]! - 0.02 * extent) / 2;
    this.box.set(low, high);
    this.writeBox();
  }

  private get several(): boolean {
    return this.form.get("several").checked;
  }

  private get ready(): boolean {
    return this.root.dataset.ready === "true";
  }

  private set ready(ready: boolean) {
    this.root.dataset.ready = String(ready);
  }

  private chooseRegion(region: number): void {
    this.region = region;
    this.form.press("region", String(region));
    this.remember();
    this.showTools();
  }

  private chooseTool(tool: Tool): void {
    this.tool = tool;
    this.remember();
    this.showTools();
    if (tool !== "box") return;
    if (!this.regions.vertices(this.region).length) this.boxMoved();
    this.selected();
  }

  /** Show what belongs to the tool: its options, its handles, the cursor. */
  private showTools(): void {
    const { tool, active, form, labels } = this;
    const { viewer } = this.app;
    form.press("tool", tool);
    form.text("hint", form.get(`tool-${tool}`).dataset.hint!);
    form.get("corners").hidden = tool !== "box";
    form.get("radius").hidden = tool !== "brush";
    form.get("parts-slider").hidden = tool !== "part" || !labels;
    form.get("apply").hidden = !this.several;
    this.showRadius();
    this.ring.hidden = true;
    this.box.show(active && tool === "box");
    const moves = active && !SELECTORS.includes(tool) && this.ready;
    if (moves && this.rows.includes(this.region))
      this.mover.show(this.pivotOf(this.region), tool as MotionKind);
    else this.mover.hide();
    if (!active) viewer.setPointer();
    else if (tool === "box") viewer.setPointer("grab", null, this.box);
    else if (tool === "brush") viewer.setPointer("crosshair", null, this.brush);
    else if (tool === "part")
      viewer.setPointer("crosshair", (hit, event) => this.pickPart(hit, event));
    else viewer.setPointer("grab", null, this.mover);
    if (active && tool === "part") this.loadParts();
    else if (labels && viewer.labels === labels) viewer.setLabels(null);
  }

  /** Tint the regions and the faces that cross, and say how many vertices the region has. */
  private paint(): void {
    const { regions, region, app } = this;
    const tints = COLORS.map((color) => [...rgbOf(color), TINT]);
    const marks = new Uint8Array(4 * app.state.n_vertices);
    for (let vertex = 0; this.active && vertex < app.state.n_vertices; vertex++) {
      const owner = regions.of(vertex);
      if (owner !== null) marks.set(tints[owner]!, 4 * vertex);
    }
    for (const vertex of this.crossing) marks.set([...rgbOf(CROSSING), TINT], 4 * vertex);
    app.viewer.setMarks(marks);
    const count = regions.vertices(region).length.toLocaleString("en");
    const place = region === FIXED ? "the fixed part" : `region ${region + 1}`;
    this.form.text("region-count", `${count} vertices in ${place}`);
  }

  private remember(): void {
    const { region, tool } = this;
    const text = this.regions.write();
    const kept: Kept = { shape: this.app.state.shape, text, tool, region };
    this.app.settings.set("regions", kept);
    this.paint();
  }

  private clear(): void {
    this.regions.clear(this.region);
    this.pivots[this.region] = undefined;
    this.selected();
  }

  /** A selection has ended: keep it, and bind the regions. */
  private selected(): void {
    const [before, after] = [this.kept, this.regions.write()];
    if (after !== before)
      this.app.history.did({ undo: () => this.select(before), redo: () => this.select(after) });
    this.select(after);
  }

  private select(kept: string): void {
    this.kept = kept;
    this.regions.read(kept);
    this.showSteps();
    this.remember();
    this.bind();
  }

  private showSteps(): void {
    for (const kind of ["undo", "redo"] as const)
      this.form.get(kind).disabled = !this.app.can(kind);
  }

  private boxMoved(): void {
    const { app, box, regions, region } = this;
    regions.clear(region);
    // A box that passes over another region leaves that region as it is.
    const free = (vertex: number) => regions.of(vertex) === null;
    regions.add(region, box.select(app.viewer.vertices).filter(free));
    this.writeBox();
    this.paint();
    this.ready = false;
  }

  private writeBox(): void {
    for (const name of ["low", "high"] as const)
      this.box[name].forEach((value, i) => {
        this.form.get(`box-${name}-${i}`).value = String(Number(value.toPrecision(5)));
      });
  }

  private readBox(): void {
    const read = (name: string) =>
      AXES.map((axis) => this.form.number(`box-${name}-${axis}`)) as Vec3;
    const [low, high] = [read("low"), read("high")];
    if (!low.every((value, axis) => value <= high[axis]!)) return;
    this.box.set(low, high);
    this.boxMoved();
    this.selected();
  }

  private showRadius(): void {
    const share = this.form.number("brush-radius");
    this.form.slide("brush-radius", share, `${(100 * share).toFixed(1)} %`);
    this.app.settings.set("radius", share);
  }

  /** Return the radius of the brush, in length. */
  private get radius(): number {
    return this.form.number("brush-radius") * this.app.viewer.extent;
  }

  private moveRing(event: PointerEvent): void {
    const reach = this.app.viewer.pixelsOf(this.radius);
    const { style } = this.ring;
    this.ring.hidden = !this.active || this.tool !== "brush";
    style.width = style.height = `${2 * reach}px`;
    style.left = `${event.offsetX - reach}px`;
    style.top = `${event.offsetY - reach}px`;
  }

  /** A stroke adds the disc along the surface around each vertex that it meets. */
  private readonly brush: PointerTool = {
    down: (event) => this.stroke(event),
    move: (event) => void this.stroke(event),
    up: () => this.painting.then(() => this.selected()),
  };

  private stroke(event: PointerEvent): boolean {
    const { app, region, regions } = this;
    const hit = app.viewer.pick(event.offsetX, event.offsetY);
    if (!hit) return false;
    this.ready = false;
    const name = `disc/${hit.vertex}/${this.radius}`;
    // One request at a time: a quick stroke sends more than the server takes at once.
    const add = async () => {
      const disc = await app.backend.array<Uint32Array>(name);
      if (event.shiftKey) regions.remove(region, disc);
      else regions.add(region, disc);
      this.paint();
    };
    this.painting = this.painting.then(add).catch((error) => app.fail(error));
    return true;
  }

  private async loadParts(): Promise<void> {
    const { status, n_regions } = this.app.state.parts;
    if (status === "none") await this.app.change({ kind: "parts" }, "Finding the parts");
    else if (status === "ready")
      await this.showParts(this.labels ? this.form.number("region-parts") : n_regions);
  }

  private async showParts(count: number): Promise<void> {
    const { backend, state, viewer } = this.app;
    const { levels } = state.parts;
    const names = ["parts/labels", "parts/cuts"];
    const arrays = await Promise.all(names.map((name) => backend.array<Int32Array>(name)));
    this.labels = cutParts(arrays[0]!, arrays[1]!, levels.length, count);
    this.form.slide("region-parts", count, String(count));
    if (!this.active || this.tool !== "part") return;
    this.form.get("parts-slider").hidden = false;
    viewer.setLabels(this.labels, partColors(levels.length));
  }

  private pickPart({ vertex }: Hit, { shiftKey }: PointerEvent): void {
    if (!this.labels) return this.app.say("The parts are still being found …");
    const part = this.labels[vertex];
    const vertices = [...this.labels.keys()].filter((each) => this.labels![each] === part);
    if (shiftKey) this.regions.remove(this.region, vertices);
    else this.regions.add(this.region, vertices);
    this.selected();
  }

  /** Ask by how much each vertex follows each region; then the regions can be moved. */
  private async bind(): Promise<void> {
    const { app, form, regions } = this;
    const turn = ++this.bindings;
    const chosen = [0, 1, 2, 3].map((region) => regions.vertices(region));
    const fixed = regions.vertices(FIXED);
    this.ready = false;
    form.text("bound", "");
    this.rows = [0, 1, 2, 3].filter((region) => chosen[region]!.length);
    if (this.rows.length && app.state.deformation.status === "ready") {
      const request = {
        n_modes: form.number("n-modes") || null,
        regions: this.rows.map((region) => chosen[region]!),
        fixed: fixed.length ? fixed : null,
      };
      const answer = await app.run("Binding the regions", app.backend.rig(request));
      if (turn !== this.bindings) return;
      if (answer) {
        app.viewer.setShares(answer.shares);
        this.rows.forEach((region, row) => (this.rims[region] = answer.pivots[row]!));
        form.text("bound", `Ready: the motion is spread by ${answer.n_modes.join(", ")} modes.`);
        this.ready = true;
      }
    }
    this.showTools();
  }

  private pivotOf(region: number): Vec3 {
    return this.pivots[region] ?? this.rims[region]!;
  }

  /** A drag may begin on any region that is bound; it becomes the chosen one. */
  private canDrag(vertex: number): boolean {
    const region = this.regions.of(vertex);
    if (region === null || region === FIXED || !this.ready) return false;
    if (region !== this.region) this.chooseRegion(region);
    return true;
  }

  private rowHandles(): Handle[] {
    return this.rows.map((region) => this.handles[region] ?? null);
  }

  private motion(kind: "preview" | "commit"): Change {
    return { kind, handles: this.rowHandles(), mode: this.form.get("mode").value };
  }

  /** Show a motion by shares at once, and the exact result when the pointer rests. */
  private async moved(handle: Handle): Promise<void> {
    const { app } = this;
    this.handles[this.region] = handle;
    app.viewer.setHandles(this.rowHandles());
    const turn = ++this.motions;
    // A slow frame is no rest: a pointer that moves is heard of at the latest before the next one.
    await nextFrame();
    await nextFrame();
    await new Promise((done) => setTimeout(done, REST));
    if (turn !== this.motions) return;
    const done = await app.backend.finish(this.motion("preview")).catch((error) => app.fail(error));
    if (done && turn === this.motions) app.viewer.setExact(done.vertices!);
  }

  private async commit(): Promise<void> {
    const handles = this.rowHandles();
    if (!this.ready || !handles.some((handle) => handle)) return;
    this.endMotion();
    this.ready = false;
    this.rows.forEach((region, row) => {
      const [pivot, handle] = [this.pivots[region], handles[row]];
      if (pivot && handle?.type === "translation")
        this.pivots[region] = pivot.map((value, axis) => value + handle.vector[axis]!) as Vec3;
    });
    if (!(await this.app.change(this.motion("commit"), "Bending the shape"))) this.drop();
  }

  private endMotion(): void {
    this.motions++;
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
    const kind = this.form.get<HTMLSelectElement>("exact-kind").selectedIndex;
    const amount = this.form.number("exact-amount");
    if (!this.ready || !this.rows.includes(this.region))
      return this.app.say("Choose a region first: paint on the shape, or draw a box around it.");
    if (!amount) return this.app.say("Write by how much it should move.");
    const axis = AXES.map((each) => Number(each === kind % 3)) as Vec3;
    const pivot = this.pivotOf(this.region);
    if (kind < 3) this.moved({ type: "rotation", pivot, axis, angle: (amount * Math.PI) / 180 });
    else this.moved({ type: "translation", vector: axis.map((one) => one * amount) as Vec3 });
    if (!this.several) await this.commit();
  }

  private async showSkeleton(): Promise<void> {
    const name = `skeleton/${this.form.number("skeleton-modes")}`;
    const checked = this.form.get("skeleton").checked;
    const loading = checked ? this.app.load<Float32Array>(name, "Computing the skeleton") : null;
    this.app.viewer.setSkeleton(await loading);
  }

  private async showCrossings(): Promise<void> {
    const checked = this.form.get("crossings").checked;
    const pairs = checked ? await this.app.load("crossings", "Looking for crossing faces") : null;
    const { faces } = this.app.viewer;
    const crossing = [...new Set<number>(pairs ?? [])];
    this.crossing = crossing.flatMap((face) => [...faces.subarray(3 * face, 3 * face + 3)]);
    this.paint();
    const found = crossing.length
      ? `${pairs!.length / 2} pairs of faces cross.`
      : "No faces cross.";
    if (pairs) this.app.say(found);
  }

  private async replay(): Promise<void> {
    const files = await this.app.choose(`.json,${this.app.state.suffixes}`, true);
    const written = files.find(({ name }) => name.endsWith(".json"));
    const source = files.find((file) => file !== written);
    if (files.length && !written) this.app.say("Choose a JSON file of edits.");
    if (!written) return;
    const edits = parseJson(written);
    if (!edits) return this.app.fail(new Error(`${written.name} is not a JSON file of edits.`));
    const change = { kind: "replay", edits, source: source?.name };
    await this.app.change(change, "Applying the edits", source && { source: source.bytes });
  }

  private async transfer(): Promise<void> {
    const [file] = await this.app.choose();
    if (!file) return;
    const { name, bytes } = file;
    await this.app.change({ kind: "transfer", name }, "Carrying the pose over", { file: bytes });
  }
}
