/** How the regions move: by the pointer or by numbers, shown at once, and committed as an edit. */

import type { App } from "../../contract";
import type { Change, Handle, Vec3 } from "../../core/backend";
import { buildCoordinate, h, nextFrame, writeCoordinate, type Form } from "../../core/dom";
import { FIXED, MAX_REGIONS } from "../../core/regions";
import { MotionTool, type MotionKind } from "../../core/tools";
import type { Selection } from "./selection";

const REST = 80; // ms without motion, beside two frames, after which the exact result is requested
const AXES = [0, 1, 2];
const ROWS = [...Array(MAX_REGIONS).keys()];

export class Motion {
  readonly mover: MotionTool;
  private rows: number[] = []; // the region of each row of the shares
  private byLimbs = false; // whether limbs are bound instead of the regions
  private handles: Handle[] = []; // of each region
  private rims: Vec3[] = []; // middle of the rim of each region
  private pivots: (Vec3 | undefined)[] = []; // that the person chose instead
  private bindings = 0; // counts requests, so that only the last answer is used
  private motions = 0;

  constructor(
    private readonly app: App,
    private readonly form: Form,
    private readonly selection: Selection,
    private readonly events: { bound(): void; chooseRegion(region: number): void },
  ) {
    this.mover = new MotionTool(app.viewer, {
      canDrag: (vertex) => this.canDrag(vertex),
      moved: (handle) => this.moved(handle),
      released: () => this.release(),
      pivoted: (pivot) => {
        this.pivots[this.selection.region] = pivot;
        this.writePivot();
      },
    });
    form
      .get("pivot-place")
      .append("pivot", ...AXES.map((axis) => buildCoordinate("pivot", axis, () => this.readPivot())));
    const kinds = ["x", "y", "z"].map((axis) => `Rotate about ${axis}, °`);
    kinds.push(...["x", "y", "z"].map((axis) => `Move along ${axis}`));
    form.get("exact-kind").append(...kinds.map((kind) => h("option", {}, kind)));
    form.on({
      "exact-go": () => this.moveExactly(),
      "n-modes": () => this.bind(),
      apply: () => this.commit(),
    });
    form.get("exact-amount").addEventListener("keydown", ({ key }) => {
      if (key === "Enter") this.moveExactly();
    });
  }

  startShape(): void {
    this.pivots = [];
  }

  startPose(): void {
    this.handles = [];
    this.byLimbs = false;
  }

  /** The number of the region that moves. */
  private get region(): number {
    return this.byLimbs ? 0 : this.selection.region;
  }

  forgetPivot(): void {
    this.pivots[this.selection.region] = undefined;
  }

  private get several(): boolean {
    return this.form.get("several").checked;
  }

  /** What has to come before a motion, as a sentence. */
  get missing(): string | null {
    const { status } = this.app.state.deformation;
    if (!this.selection.regions.vertices(this.selection.region).length)
      return "Choose a region first: paint on the shape, draw a box, or click a part.";
    if (status === "running") return "The shape is still being prepared; then the region can move.";
    return null;
  }

  get ready(): boolean {
    return this.form.root.dataset.ready === "true";
  }

  set ready(ready: boolean) {
    this.form.root.dataset.ready = String(ready);
  }

  /** Show the handles of a motion, and give it the pointer if the panel is seen. */
  show(kind: MotionKind | null, visible: boolean): void {
    this.form.get("apply").hidden = !this.several;
    const { region } = this.selection;
    const moves = kind !== null && visible && this.ready && this.rows.includes(region);
    if (moves) this.mover.show(this.pivotOf(region), kind);
    else this.mover.hide();
    this.form.get("pivot-place").hidden = !moves || kind !== "pivot";
    if (moves) this.writePivot();
    if (kind && visible) this.app.viewer.setPointer("grab", null, this.mover);
  }

  /** Ask by how much each vertex follows each region; then the regions can be moved. */
  async bind(limbs: Uint32Array[] | null = null): Promise<void> {
    const { app, form } = this;
    const { regions } = this.selection;
    const turn = ++this.bindings;
    const chosen = limbs ?? ROWS.map((region) => regions.vertices(region));
    const fixed = limbs ? new Uint32Array(0) : regions.vertices(FIXED);
    this.byLimbs = limbs !== null;
    this.ready = false;
    form.text("bound", "");
    this.rows = ROWS.filter((region) => chosen[region]?.length);
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
        const ready = `Ready: the motion is spread by ${answer.n_modes.join(", ")} modes.`;
        form.text("bound", [ready, ...answer.warnings].join(" "));
        this.ready = true;
      }
    }
    this.events.bound();
  }

  pivotOf(region: number): Vec3 {
    return (!this.byLimbs && this.pivots[region]) || this.rims[region]!;
  }

  private writePivot(): void {
    this.pivotOf(this.selection.region).forEach((value, axis) => {
      this.form.get(`pivot-${axis}`).value = writeCoordinate(value);
    });
  }

  /** Take the pivot that was written. */
  private readPivot(): void {
    const pivot = AXES.map((axis) => this.form.number(`pivot-${axis}`)) as Vec3;
    if (!pivot.every(Number.isFinite)) return;
    this.pivots[this.selection.region] = pivot;
    this.mover.show(pivot, "pivot");
  }

  /** A drag may begin on any region that is bound; it becomes the chosen one. */
  private canDrag(vertex: number): boolean {
    const region = this.selection.regions.of(vertex);
    if (region === null || region === FIXED || !this.ready) return false;
    if (region !== this.selection.region) this.events.chooseRegion(region);
    return true;
  }

  rowHandles(): Handle[] {
    return this.rows.map((region) => this.handles[region] ?? null);
  }

  private change(kind: "preview" | "commit"): Change {
    const n_modes = this.form.number("n-modes") || null;
    return { kind, handles: this.rowHandles(), mode: this.form.get("mode").value, n_modes };
  }

  moved(handle: Handle): Promise<void> {
    this.handles[this.region] = handle;
    return this.moveAll(this.handles);
  }

  /** Show motions by shares at once, and the exact result when the pointer rests. */
  async moveAll(handles: Handle[]): Promise<void> {
    const { app } = this;
    this.handles = handles;
    app.viewer.setHandles(this.rowHandles());
    const turn = ++this.motions;
    // A slow frame is no rest: a pointer that moves is heard of at the latest before the next one.
    await nextFrame();
    await nextFrame();
    await new Promise((done) => setTimeout(done, REST));
    if (turn !== this.motions) return;
    const done = await app.backend.finish(this.change("preview")).catch((error) => app.fail(error));
    if (done && turn === this.motions) app.viewer.setExact(done.vertices!);
  }

  async commit(): Promise<void> {
    const handles = this.rowHandles();
    if (!this.ready || !handles.some((handle) => handle)) return;
    this.endMotion();
    this.ready = false;
    this.rows.forEach((region, row) => {
      const [pivot, handle] = [this.pivots[region], handles[row]];
      if (pivot && handle?.type === "translation")
        this.pivots[region] = pivot.map((value, axis) => value + handle.vector[axis]!) as Vec3;
    });
    if (!(await this.app.change(this.change("commit"), "Bending the shape"))) this.drop();
  }

  /** Return the pivot of the chosen region, if it can be moved. */
  async grab(): Promise<Vec3 | null> {
    const { missing, region } = this;
    if (missing) this.app.say(missing);
    else if (!this.ready) await this.bind();
    return this.ready && this.rows.includes(region) ? this.pivotOf(region) : null;
  }

  /** What the pointer has moved is an edit, unless other regions shall move with it. */
  release(): void {
    if (!this.several) this.commit();
  }

  private endMotion(): void {
    this.motions++;
    this.mover.hide();
  }

  /** Forget the motion that was not committed. */
  drop(): void {
    this.endMotion();
    this.handles = [];
    this.app.viewer.setHandles([]);
    this.events.bound();
  }

  private async moveExactly(): Promise<void> {
    const kind = this.form.get<HTMLSelectElement>("exact-kind").selectedIndex;
    const amount = this.form.number("exact-amount");
    const { region } = this.selection;
    if (this.missing) return this.app.say(this.missing);
    if (!this.ready || !this.rows.includes(region)) return;
    if (!amount) return this.app.say("Write by how much it should move.");
    const axis = AXES.map((each) => Number(each === kind % 3)) as Vec3;
    const pivot = this.pivotOf(region);
    if (kind < 3) this.moved({ type: "rotation", pivot, axis, angle: (amount * Math.PI) / 180 });
    else this.moved({ type: "translation", vector: axis.map((one) => one * amount) as Vec3 });
    if (!this.several) await this.commit();
  }
}
