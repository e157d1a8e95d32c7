/** Compare: a second shape beside this one, and which points of both correspond. */

import type { App, Panel } from "../contract";
import type { Change, Second, State } from "../core/backend";
import { Beside } from "../core/beside";
import { coverWith } from "../core/carry";
import { partColors, rgbOf, type Scale } from "../core/colors";
import { Form, h, nextFrame, type NamedFile } from "../core/dom";
import type { Viewer } from "../core/viewer";
import type { Arrays as WireArrays } from "../core/wire";
import markup from "./compare.html?raw";

const SURE: Scale = { map: "viridis", range: [0, 1], title: "Confidence" };
const HOVER = "#d62728";
const HINT = "The map follows two points that you choose. Ctrl+Z takes them back.";

type Both<T> = [T, T]; // of this shape, and of the second one
interface Arrays {
  partners: Both<Int32Array>; // the vertex of the other shape, or -1
  confidence: Both<Float32Array>;
  colors: Both<Uint8Array>;
}

export class ComparePanel implements Panel {
  readonly id = "compare";
  readonly title = "Compare";
  readonly needs = ["beside"];
  private app!: App;
  private readonly form = new Form(markup);
  private key = ""; // tells the two shapes that are shown from others
  private map: Arrays | null = null;
  private version = ""; // of the map
  private pose = -1;
  private active = false;
  private hovered: Both<number> = [-1, -1];
  private picking = false; // under the pointer
  private chosen: Both<number> | null = null; // points of a correction, -1 until chosen

  build(app: App): HTMLElement {
    const { form } = this;
    this.app = app;
    form.on({
      "second-file": async () => (await app.choose()).forEach((file) => this.openFile(file)),
      "second-sample": () => this.openChosen("second-sample", (sample) => ({ sample })),
      "second-listed": () =>
        this.openChosen("second-listed", (number) => ({ shape: Number(number) })),
      "find-map": () => app.change({ kind: "map" }, "Starting to find corresponding points"),
      correct: () => this.choose(this.chosen ? null : [-1, -1]),
      "correct-none": () => this.correct([]),
      "take-pose": () => app.change({ kind: "pose" }, "Bending the shape into the other pose"),
    });
    form.onChoice("mapcolor", () => this.paint());
    app.acceptDrops(form.root, (file) => this.openFile(file));
    app.shortcut("C", "Compare: choose two points that correspond", () => {
      if (this.map) {
        app.open(this.id);
        this.choose([-1, -1]);
      }
    });
    this.listen(app.viewer, 0);
    return form.root;
  }

  refresh(state: State): void {
    const { form } = this;
    const { beside, shape } = state;
    const key = beside ? `${shape} ${beside.number}` : "";
    if (key !== this.key) this.show(beside, key);
    form.get("second-part").hidden = !beside;
    this.listShapes(state);
    if (beside) {
      const { status } = beside.map;
      if (this.map && (status === "none" || status === "failed")) this.forget();
      form.progress("map-progress", beside.map);
      form.get("pose-part").hidden = !beside.can_pose;
      form.get("correct-part").hidden = !beside.can_correct && status !== "running";
      form.get("find-map").hidden = status === "running" || status === "ready";
      form.get("map-results").hidden = !this.map && status !== "ready";
      form
        .get("map-lines")
        .replaceChildren(...beside.lines.map((line) => h("li", { class: "fair" }, line)));
      this.listPairs(beside.pairs);
      const version = JSON.stringify([key, beside.pairs]);
      if (status === "ready" && version !== this.version) this.load(version);
    }
    if (this.active && state.pose !== this.pose) this.paint();
    this.pose = state.pose;
  }

  shown(): void {
    this.active = true;
    this.paint();
  }

  hidden(): void {
    this.choose(null);
    this.clear();
    this.active = false;
  }

  private openFile({ name, bytes }: NamedFile): Promise<void> {
    return this.open({ name }, `Reading ${name}`, { file: bytes });
  }

  private async openChosen(name: string, change: (value: string) => Partial<Change>): Promise<void> {
    const select = this.form.get<HTMLSelectElement>(name);
    const { value } = select;
    select.value = "";
    if (value) await this.open(change(value), "Opening the second shape");
  }

  private async open(change: Partial<Change>, text: string, files?: WireArrays): Promise<void> {
    if (!(await this.app.change({ kind: "beside", ...change }, text, files))) return;
    await this.app.change({ kind: "map" }, "Starting to find corresponding points");
  }

  /** Offer the other shapes of the list. */
  private listShapes({ shapes, shape }: State): void {
    const others = shapes.filter(([number]) => number !== shape);
    const select = this.form.get<HTMLSelectElement>("second-listed");
    select.hidden = !others.length;
    const names = others.join();
    if (select.dataset.names === names) return;
    select.dataset.names = names;
    select.replaceChildren(
      h("option", { value: "" }, "or one of the list"),
      ...others.map(([value, name]) => h("option", { value }, name)),
    );
  }

  /** Open the second picture, or close it. */
  private async show(beside: Second | null, key: string): Promise<void> {
    const { app } = this;
    this.key = key;
    this.choose(null);
    this.clear();
    app.second?.close();
    [app.second, this.map, this.version] = [null, null, ""];
    if (!beside) return;
    const close = () => app.change({ kind: "beside", close: true }, "Closing the second shape");
    const stands = (): Both<State | Second> => [app.state, app.state.beside ?? beside];
    const second = new Beside(app.viewer, stands, beside.name, close);
    app.second = second;
    app.acceptDrops(second.stage, (file) => this.openFile(file));
    this.listen(second.viewer, 1);
    const loading = Promise.all([
      app.backend.array<Float32Array>("beside/vertices"),
      app.backend.array<Uint32Array>("beside/faces"),
    ]);
    const loaded = await app.run("Loading the second shape", loading);
    if (!loaded || app.second !== second) return;
    second.show(...loaded);
    for (const hear of app.secondShown) hear(second);
    this.paint();
  }

  /** Load a map that is ready. */
  private async load(version: string): Promise<void> {
    this.version = version;
    const both = <T extends Int32Array | Float32Array | Uint8Array>(name: string) =>
      Promise.all([0, 1].map((side) => this.app.backend.array<T>(`beside/${name}/${side}`)));
    const loading = Promise.all([
      both<Int32Array>("partners"),
      both<Float32Array>("confidence"),
      both<Uint8Array>("colors"),
    ]);
    const loaded = await this.app.run("Loading the map", loading);
    if (!loaded || version !== this.version) return;
    const [partners, confidence, colors] = loaded;
    this.map = { partners, confidence, colors } as Arrays;
    this.form.get("map-results").hidden = false;
    const { similarity } = this.app.state.beside ?? {};
    if (similarity) this.app.second?.layOn(similarity);
    this.paint();
  }

  /** Show no longer what belongs to a map that is gone. */
  private forget(): void {
    [this.map, this.version] = [null, ""];
    this.choose(null);
    this.paint();
  }

  /** Color both shapes by the map; other panels color this one, and the second takes it over. */
  private paint(): void {
    const { app, map } = this;
    const { second } = app;
    if (!second?.viewer.vertices.length) return;
    second.carryBy(map?.partners ?? null);
    if (!this.active) return;
    const pressed = this.form.choice("mapcolor").find(([, each]) => each.ariaPressed === "true");
    const views = [app.viewer, second.viewer];
    app.viewer.setScalars(null);
    app.viewer.setMarks(new Uint8Array(4 * app.state.n_vertices));
    if (map && pressed?.[0] === "sure")
      views.forEach((view, side) => {
        view.setScalars(map.confidence[side]!, SURE);
        view.setMarks(new Uint8Array(4 * map.confidence[side]!.length));
      });
    else if (map) views.forEach((view, side) => view.setMarks(coverWith(map.colors[side]!)));
    this.drawPoints();
  }

  /** Leave this shape as it was, without colors and points. */
  private clear(): void {
    const { app } = this;
    const { second } = app;
    this.hovered = [-1, -1];
    if (!second) return;
    if (this.active) {
      app.viewer.setScalars(null);
      app.viewer.setMarks(new Uint8Array(4 * app.state.n_vertices));
    }
    for (const view of [app.viewer, second.viewer]) if (view.vertices.length) view.setPoints([], HOVER);
  }

  /** Mark what was chosen by hand, and what is under the pointer. */
  private drawPoints(): void {
    const { app, hovered, chosen } = this;
    const { second } = app;
    if (!this.active || !second?.viewer.vertices.length) return;
    const pairs = app.state.beside?.pairs ?? [];
    const palette = [...partColors(pairs.length)];
    [app.viewer, second.viewer].forEach((view, side) => {
      const free = [chosen?.[side] ?? -1, hovered[side]!].filter((vertex) => vertex >= 0);
      const vertices = [...pairs.map((pair) => pair[side]!), ...free];
      const colors = [...palette, ...free.flatMap(() => rgbOf(HOVER))];
      view.setPoints(vertices, Uint8Array.from(colors));
    });
  }

  /** Show under the pointer which point corresponds; clicks choose points of a correction. */
  private listen(view: Viewer, side: 0 | 1): void {
    view.canvas.addEventListener("pointermove", (event) => this.hover(view, side, event));
    view.canvas.addEventListener("pointerleave", () => this.setHovered([-1, -1]));
  }

  private async hover(view: Viewer, side: 0 | 1, event: PointerEvent): Promise<void> {
    const { map } = this;
    if (!this.active || !map || this.picking || event.buttons) return;
    this.picking = true; // one look at the picture a frame
    await nextFrame();
    this.picking = false;
    if (map !== this.map) return;
    const vertex = view.pick(event.offsetX, event.offsetY)?.vertex ?? -1;
    const partner = vertex < 0 ? -1 : map.partners[side][vertex]!;
    this.setHovered(side === 0 ? [vertex, partner] : [partner, vertex]);
    if (vertex < 0) return;
    const sure = Math.round(100 * map.confidence[side][vertex]!);
    const text = partner < 0 ? "Nothing corresponds to this point." : `Right by ${sure} %.`;
    this.form.text("under-pointer", text);
  }

  private setHovered(both: Both<number>): void {
    if (both.every((vertex, side) => vertex === this.hovered[side])) return;
    this.hovered = both;
    this.form.text("under-pointer", "");
    this.drawPoints();
  }

  /** Begin, continue or end to choose two points that correspond. */
  private choose(chosen: Both<number> | null): void {
    const { app, form } = this;
    const { second } = app;
    if (!second || (!chosen && !this.chosen)) return;
    this.chosen = chosen;
    form.get("correct").setAttribute("aria-pressed", String(!!chosen));
    const where = ["this shape", "the second shape"];
    const open = chosen?.map((vertex, side) => (vertex < 0 ? where[side] : "")).filter(Boolean);
    form.text("correct-hint", open ? `Click a point of ${open.join(" and of ")}.` : HINT);
    [app.viewer, second.viewer].forEach((view, side) =>
      view.setPointer(
        chosen ? "crosshair" : "grab",
        chosen && (({ vertex }) => this.take(side as 0 | 1, vertex)),
      ),
    );
    this.drawPoints();
  }

  private take(side: 0 | 1, vertex: number): void {
    if (!this.chosen) return;
    const chosen: Both<number> = [...this.chosen];
    chosen[side] = vertex;
    if (chosen.includes(-1)) return this.choose(chosen);
    this.choose(null);
    this.correct([...this.app.state.beside!.pairs, chosen]);
  }

  /** Let the map follow other pairs. */
  private async correct(pairs: Both<number>[]): Promise<void> {
    const { app } = this;
    const change = { pairs: Uint32Array.from(pairs.flat()) };
    await app.change({ kind: "correct" }, "Correcting the map", change);
  }

  private listPairs(pairs: Both<number>[]): void {
    const colors = partColors(pairs.length);
    const rows = pairs.map((_, i) => {
      const click = () => this.correct(pairs.filter((_, other) => other !== i));
      const title = `Remove pair ${i + 1}`;
      const remove = h("button", { type: "button", title, "aria-label": title, click }, "×");
      const swatch = h("span", { class: "dot" });
      swatch.style.background = `rgb(${colors.subarray(3 * i, 3 * i + 3).join()})`;
      return h("li", {}, swatch, `Pair ${i + 1}`, remove);
    });
    this.form.get("pairs").replaceChildren(...rows);
    this.form.get("correct-none").hidden = !pairs.length;
    if (!this.chosen) this.form.text("correct-hint", HINT);
  }
}
