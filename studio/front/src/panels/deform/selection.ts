/** Which vertices belong to which region: chosen by a box, a brush or parts. */

import type { App } from "../../contract";
import type { State, Vec3 } from "../../core/backend";
import type { Beside } from "../../core/beside";
import { partColors, rgbOf } from "../../core/colors";
import { buildCoordinate, h, writeCoordinate, type Form } from "../../core/dom";
import { cutParts } from "../../core/parts";
import { FIXED, Regions } from "../../core/regions";
import { BoxTool } from "../../core/tools";
import type { Hit, PointerTool, Viewer } from "../../core/viewer";

const COLORS = ["#e08a2e", "#3b8fd4", "#46a564", "#b468c8", "#4f6072"]; // of the regions, and fixed
const CROSSING = "#d8301f";
const TINT = 190; // of 255: how strongly a region covers the colors below
const GLOW = 0.6; // the same, as a share, of a limb under the pointer
const AXES = [0, 1, 2];
const UNMAPPED = "Nothing on the first shape corresponds to this point. Find the map in Compare.";

const NOTHING = { status: "none", progress: 0, message: "" } as const; // that is awaited

export type Selector = "box" | "brush" | "part";

export interface SelectionEvents {
  changing(): void; // the regions are no longer those that are bound
  selected(): void; // a selection has ended
}

export class Selection {
  regions = new Regions(0);
  region = 0; // that the tools change
  crossing: number[] = []; // vertices of faces that cross
  seen = false; // whether the panel is
  lit: Uint8Array | null = null; // of each vertex: how much it belongs to the limb under the pointer
  readonly box: BoxTool;
  private readonly ring = h("div", { class: "ring", hidden: true });
  private tool: Selector | null = null; // that has the pointer
  private visible = false;
  private known = 0; // the number by which the server knows the regions
  private sending = 0; // selections of which the server has not heard yet
  private labels: Int32Array | null = null; // part of each vertex
  private awaited: [Hit, PointerEvent] | null = null; // a click before the parts were found
  private painting: Promise<void> = Promise.resolve(); // discs of the brush, one after the other

  constructor(
    private readonly app: App,
    private readonly form: Form,
    private readonly events: SelectionEvents,
  ) {
    const { viewer, settings } = app;
    this.box = new BoxTool(
      viewer,
      () => this.boxMoved(),
      () => this.selected("Box"),
    );
    viewer.canvas.addEventListener("pointermove", (event) => this.moveRing(event, viewer));
    app.secondShown.push((second) => {
      const { viewer } = second;
      viewer.canvas.addEventListener("pointermove", (event) => this.moveRing(event, viewer));
      this.takePointerOf(second);
    });
    const swatches = COLORS.map((color, region) => {
      const swatch = { type: "button", class: "swatch", "data-test": `region-${region}` };
      const button = h("button", swatch, region === FIXED ? "Fixed" : String(region + 1));
      button.style.setProperty("--swatch", color);
      return button;
    });
    form.get("regions").append(...swatches);
    for (const name of ["low", "high"])
      form
        .get("corners")
        .append(name, ...AXES.map((axis) => buildCoordinate(`box-${name}`, axis, () => this.readBox())));
    form.get("brush-radius").valueAsNumber = settings.get("radius", 0.1);
    form.on({
      "brush-radius": () => this.showRadius(),
      "region-parts": () => this.showParts(form.number("region-parts")),
    });
  }

  /** Begin with a new shape, without regions. */
  startShape({ n_vertices, up }: State): void {
    this.regions = new Regions(n_vertices);
    this.labels = this.awaited = null;
    this.known = 0;
    this.region = this.app.settings.get("region", 0);
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

  /** Take the regions of the server if they are others: after undo, or when the page is loaded. */
  async takeRegions({ selected, shape }: State): Promise<void> {
    if (this.sending || selected === this.known) return;
    this.known = selected;
    const owners = await this.app.backend.array<Uint8Array>("regions");
    if (this.sending || this.app.state.shape !== shape) return;
    this.regions.read(owners);
    this.paint();
    this.events.selected();
  }

  /** Show the parts if they were awaited, and are ready now. */
  showFoundParts(): void {
    this.showFinding();
    const { status } = this.app.state.parts;
    if (this.tool === "part" && !this.labels && (status === "ready" || status === "none"))
      this.loadParts();
  }

  /** Show how far the parts are, if they are awaited. */
  private showFinding(): void {
    this.form.progress("finding", this.tool === "part" ? this.app.state.parts : NOTHING);
  }

  chooseRegion(region: number): void {
    this.region = region;
    this.form.press("region", String(region));
    this.app.settings.set("region", region);
    this.paint();
  }

  /** A box that has just been chosen selects what is in it. */
  startBox(): void {
    if (this.regions.vertices(this.region).length) return this.events.selected();
    this.boxMoved();
    this.selected("Box");
  }

  /** Show the options of a selector, and give it the pointer if the panel is seen. */
  show(tool: Selector | null, visible: boolean): void {
    const { form, labels } = this;
    const { viewer } = this.app;
    [this.tool, this.visible] = [visible ? tool : null, visible];
    form.get("corners").hidden = tool !== "box";
    form.get("radius").hidden = tool !== "brush";
    form.get("parts-slider").hidden = tool !== "part" || !labels;
    this.showRadius();
    this.showFinding();
    this.ring.hidden = true;
    this.box.show(this.tool === "box");
    if (this.app.second) this.takePointerOf(this.app.second);
    if (this.tool === "box") viewer.setPointer("grab", null, this.box);
    else if (this.tool === "brush") viewer.setPointer("crosshair", null, this.brushOn(null));
    else if (this.tool === "part")
      viewer.setPointer("crosshair", (hit, event) => this.pickPart(hit, event));
    if (this.tool === "part") this.loadParts();
    else if (labels && viewer.labels === labels) viewer.setLabels(null);
  }

  /** What is painted or clicked on the second shape is chosen where it corresponds to this one. */
  private takePointerOf(second: Beside): void {
    const { viewer } = second;
    if (this.tool === "brush") viewer.setPointer("crosshair", null, this.brushOn(second));
    else if (this.tool === "part")
      viewer.setPointer("crosshair", (hit, event) => {
        const vertex = second.partnerOf(hit.vertex);
        if (vertex < 0) this.app.say(UNMAPPED);
        else this.pickPart({ ...hit, vertex }, event);
      });
    else if (this.visible) viewer.setPointer();
  }

  /** Tint the regions and the faces that cross, and say how many vertices the region has. */
  paint(): void {
    const { regions, region, app } = this;
    const tints = COLORS.map((color) => [...rgbOf(color), TINT]);
    const marks = new Uint8Array(4 * app.state.n_vertices);
    for (let vertex = 0; this.visible && vertex < app.state.n_vertices; vertex++) {
      const owner = regions.of(vertex);
      if (owner !== null) marks.set(tints[owner]!, 4 * vertex);
    }
    this.lit?.forEach((strength, vertex) => {
      if (strength) marks.set([...rgbOf(COLORS[0]!), GLOW * strength], 4 * vertex);
    });
    for (const vertex of this.crossing) marks.set([...rgbOf(CROSSING), TINT], 4 * vertex);
    if (this.seen) app.viewer.setMarks(marks); // otherwise the colors are those of another panel
    const count = regions.vertices(region).length.toLocaleString("en");
    const place = region === FIXED ? "the fixed part" : `region ${region + 1}`;
    this.form.text("region-count", `${count} vertices in ${place}`);
  }

  clear(): void {
    this.regions.clear(this.region);
    this.selected("Clear");
  }

  /** A selection has ended: the server keeps it, and then the regions can be bound. */
  private selected(text: string): void {
    const { app, region } = this;
    const place = region === FIXED ? "fixed" : `region ${region + 1}`;
    this.paint();
    this.sending += 1;
    app
      .change({ kind: "select", text: `${text}: ${place}` }, "", { regions: this.regions.owners })
      .then((done) => {
        this.sending -= 1;
        this.known = done ? app.state.selected : -1; // if refused, those of the server are shown again
        return this.takeRegions(app.state);
      })
      .catch((error) => app.fail(error));
    this.events.selected();
  }

  private boxMoved(): void {
    const { app, box, regions, region } = this;
    regions.clear(region);
    // A box that passes over another region leaves that region as it is.
    const free = (vertex: number) => regions.of(vertex) === null;
    regions.add(region, box.select(app.viewer.vertices).filter(free));
    this.writeBox();
    this.paint();
    this.events.changing();
  }

  private writeBox(): void {
    for (const name of ["low", "high"] as const)
      this.box[name].forEach((value, i) => {
        this.form.get(`box-${name}-${i}`).value = writeCoordinate(value);
      });
  }

  private readBox(): void {
    const read = (name: string) =>
      AXES.map((axis) => this.form.number(`box-${name}-${axis}`)) as Vec3;
    const [low, high] = [read("low"), read("high")];
    if (!low.every((value, axis) => value <= high[axis]!)) return;
    this.box.set(low, high);
    this.boxMoved();
    this.selected("Box");
  }

  private showRadius(): void {
    const share = this.form.number("brush-radius");
    this.form.slide("brush-radius", share, `${(100 * share).toFixed(1)} %`);
    this.app.settings.set("radius", share);
  }

  /** Return the radius of the brush on a shape, in its length. */
  private radiusOn({ extent }: Viewer): number {
    return this.form.number("brush-radius") * extent;
  }

  private moveRing(event: PointerEvent, viewer: Viewer): void {
    const reach = viewer.pixelsOf(this.radiusOn(viewer));
    const { style } = this.ring;
    viewer.stage.append(this.ring);
    this.ring.hidden = this.tool !== "brush";
    style.width = style.height = `${2 * reach}px`;
    style.left = `${event.offsetX - reach}px`;
    style.top = `${event.offsetY - reach}px`;
  }

  /**
   * Return the brush of this shape, or that of the second one. A stroke adds the disc along the
   * surface around each vertex that it meets.
   */
  private brushOn(second: Beside | null): PointerTool {
    return {
      down: (event) => this.stroke(event, second),
      move: (event) => void this.stroke(event, second),
      up: () => this.painting.then(() => this.selected("Brush")),
    };
  }

  private stroke(event: PointerEvent, second: Beside | null): boolean {
    const { app, region, regions } = this;
    const viewer = second?.viewer ?? app.viewer;
    const hit = viewer.pick(event.offsetX, event.offsetY);
    if (!hit) return false;
    if (second && second.partnerOf(hit.vertex) < 0) {
      app.say(UNMAPPED);
      return false;
    }
    this.events.changing();
    const name = `disc/${hit.vertex}/${this.radiusOn(viewer)}`;
    // One request at a time: a quick stroke sends more than the server takes at once.
    const add = async () => {
      const disc = await app.backend.array<Uint32Array>(second ? `beside/${name}` : name);
      const ours = second ? second.bringBack(disc) : disc;
      if (event.shiftKey) regions.remove(region, ours);
      else regions.add(region, ours);
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
    if (this.tool !== "part") return;
    this.form.get("parts-slider").hidden = false;
    viewer.setLabels(this.labels, partColors(levels.length));
    if (this.awaited) this.pickPart(...this.awaited);
    this.awaited = null;
  }

  private pickPart(hit: Hit, event: PointerEvent): void {
    if (!this.labels) {
      this.awaited = [hit, event];
      return this.app.say("The parts are being found; then the part that you clicked is chosen.");
    }
    const part = this.labels[hit.vertex];
    const vertices = [...this.labels.keys()].filter((each) => this.labels![each] === part);
    if (event.shiftKey) this.regions.remove(this.region, vertices);
    else this.regions.add(this.region, vertices);
    this.selected("Part");
  }
}
