/** Bend: drag a limb, or choose and move regions, and the shape follows (chapter 6 of the thesis). */

import type { App, Panel } from "../../contract";
import type { State } from "../../core/backend";
import { Form, h } from "../../core/dom";
import type { MotionKind } from "../../core/tools";
import markup from "./deform.html?raw";
import { replayFile, transferToFile } from "./files";
import { Grab, GRABS } from "./grab";
import { Limbs } from "./limbs";
import { Motion } from "./motion";
import { Selection, type Selector } from "./selection";

const SELECTORS = ["box", "brush", "part"]; // the other tools move

// Keys by which limbs turn about an axis of the view
const SWINGS = [
  ["Left", "above", -1],
  ["Right", "above", 1],
  ["Up", "right", -1],
  ["Down", "right", 1],
] as const;

type Tool = "limb" | Selector | MotionKind;

export class DeformPanel implements Panel {
  readonly id = "deform";
  readonly title = "Bend";
  readonly needs = ["rig", "finish"];
  private readonly form = new Form(markup);
  private app!: App;
  private selection!: Selection;
  private motion!: Motion;
  limbs!: Limbs;
  private grab!: Grab;
  private tool: Tool = "limb";
  private pose = "";
  private active = false;

  build(app: App): HTMLElement {
    const { form } = this;
    this.app = app;
    this.tool = app.settings.get<Tool>("tool", "limb");
    this.selection = new Selection(app, form, {
      changing: () => (this.motion.ready = false),
      selected: () => {
        this.showSteps();
        this.motion.bind();
      },
    });
    this.motion = new Motion(app, form, this.selection, {
      bound: () => this.showTools(),
      chooseRegion: (region) => this.chooseRegion(region),
    });
    this.limbs = new Limbs(app, form, this.motion, this.selection);
    this.grab = new Grab(app);
    const more = form.get<HTMLDetailsElement>("more");
    more.open = app.settings.get("more", false);
    more.addEventListener("toggle", () => app.settings.set("more", more.open));
    form.onChoice("region", (id) => this.chooseRegion(Number(id)));
    form.onChoice("tool", (id) => this.chooseTool(id as Tool));
    form.on({
      clear: () => this.clear(),
      several: () => this.showTools(),
      undo: () => app.step("undo"),
      redo: () => app.step("redo"),
      reset: () => app.change({ kind: "reset" }, "Undoing all"),
      "save-edits": () => app.save("edits", "json"),
      "load-edits": () => replayFile(app),
      skeleton: () => this.showSkeleton(),
      "skeleton-modes": () => this.showSkeleton(),
      crossings: () => this.showCrossings(),
      transfer: () => transferToFile(app),
    });
    app.addExports(form, "export");
    for (const [tool, { dataset, textContent }] of form.choice("tool"))
      if (dataset.key)
        app.shortcut(dataset.key, `Bend: ${textContent!.toLowerCase()}`, () => {
          app.open(this.id);
          this.chooseTool(tool as Tool);
        });
    for (const [key, kind] of GRABS)
      app.shortcut(key, `Bend: ${kind} it with the pointer, X Y Z along an axis`, () => {
        app.open(this.id);
        this.grab.begin(kind, this.tool === "limb" ? this.limbs : this.motion);
      });
    app.shortcut("N", "Bend: light the next limb", () => this.useLimbs(() => this.limbs.next()));
    for (const [key, axis, sign] of SWINGS)
      app.shortcut(`Shift+Arrow${key}`, `Bend: turn the limb that is lit, ${key.toLowerCase()}`, () =>
        this.useLimbs(() => this.limbs.swing(axis, sign)),
      );
    app.shortcut("Enter", "Apply the motions", () => this.motion.commit());
    app.shortcut("Escape", "Drop the motion, let the limbs go", () => {
      this.motion.drop();
      this.limbs.letGo();
    });
    return form.root;
  }

  refresh(state: State): void {
    const { form, selection, motion } = this;
    const { deformation } = state;
    form.progress("rig-progress", deformation);
    form.get("reset").disabled = !deformation.n_edits;
    this.showSteps();
    this.showHistory(state);
    this.limbs.load().then(() => this.showHint());
    const pose = `${state.shape} ${state.pose} ${deformation.status}`;
    if (pose === this.pose) {
      selection.takeRegions(state).catch((error) => this.app.fail(error));
      return selection.showFoundParts();
    }
    if (!this.pose.startsWith(`${state.shape} `)) {
      selection.startShape(state);
      motion.startShape();
      this.limbs.startShape();
    }
    this.pose = pose;
    selection.crossing = [];
    motion.startPose();
    this.limbs.startPose();
    selection.paint();
    selection.takeRegions(state).catch((error) => this.app.fail(error));
    if (this.tool !== "limb") motion.bind();
    if (form.get("skeleton").checked) this.showSkeleton();
    if (form.get("crossings").checked) this.showCrossings();
  }

  shown(): void {
    this.active = this.selection.seen = true;
    this.showTools();
    this.selection.paint();
  }

  hidden(): void {
    this.active = false;
    this.grab.finish(false);
    this.limbs.letGo();
    this.app.viewer.setPointer();
    this.app.second?.viewer.setPointer();
    this.motion.drop();
    this.selection.paint();
    this.selection.seen = false;
  }

  /** The vertices of the chosen region. */
  get painted(): Uint32Array {
    return this.selection.regions.vertices(this.selection.region);
  }

  /** Do something with limbs by the keyboard. */
  private async useLimbs(act: () => Promise<void>): Promise<void> {
    this.app.open(this.id);
    if (this.tool !== "limb") this.chooseTool("limb");
    await this.limbs.load();
    await act();
  }

  private chooseRegion(region: number): void {
    this.selection.chooseRegion(region);
    this.showTools();
  }

  private chooseTool(tool: Tool): void {
    const fromLimbs = this.tool === "limb";
    this.tool = tool;
    this.app.settings.set("tool", tool);
    this.limbs.letGo();
    if (tool !== "limb") this.form.get<HTMLDetailsElement>("more").open = true;
    this.showTools();
    this.selection.paint();
    if (fromLimbs && tool !== "limb") this.motion.bind(); // the regions that were chosen before
    if (tool === "box") this.selection.startBox();
  }

  /** Show what belongs to the tool: its options, its handles, the cursor. */
  private showTools(): void {
    const { active, form, tool } = this;
    form.press("tool", tool);
    this.showHint();
    const selects = SELECTORS.includes(tool);
    const bends = tool === "limb";
    this.motion.show(selects || bends ? null : (tool as MotionKind), active);
    this.selection.show(selects ? (tool as Selector) : null, active && !bends);
    if (active && bends) this.app.viewer.setPointer("grab", null, this.limbs);
  }

  private showHint(): void {
    const { form, limbs, tool } = this;
    const missing = SELECTORS.includes(tool) ? null : this.motion.missing;
    const hint = missing ?? form.get(`tool-${tool}`).dataset.hint!;
    form.text("hint", tool === "limb" ? limbs.hint : hint);
  }

  private showSteps(): void {
    for (const kind of ["undo", "redo"] as const)
      this.form.get(kind).disabled = !this.app.can(kind);
  }

  /** List what the hand did, to return to by a click. */
  private showHistory({ history, place }: State): void {
    const list = this.form.get("history");
    const version = [place, history.length, history.at(-1)].join(" ");
    if (version === list.dataset.version) return;
    list.dataset.version = version;
    const buttons = ["Start", ...history].map((text, number) => {
      const click = () => this.app.change({ kind: "go", place: number }, "Returning");
      const present = number === place ? "step" : "false";
      const attributes = { type: "button", click, "aria-current": present };
      return h("button", { ...attributes, class: number > place ? "undone" : "" }, text);
    });
    list.replaceChildren(...buttons.map((button) => h("li", {}, button)));
    list.scrollTop = buttons[place]!.offsetTop - list.clientHeight / 2;
  }

  private clear(): void {
    this.motion.forgetPivot();
    this.selection.clear();
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
    const corners = crossing.flatMap((face) => [...faces.subarray(3 * face, 3 * face + 3)]);
    this.selection.crossing = corners;
    this.selection.paint();
    const found = crossing.length
      ? `${pairs!.length / 2} pairs of faces cross.`
      : "No faces cross.";
    if (pairs) this.app.say(found);
  }
}
