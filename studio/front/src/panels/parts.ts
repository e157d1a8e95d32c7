/** Parts: how many, applied at once, and the persistence of the maxima that they grow around. */

import uPlot from "uplot";
import type { App, Panel } from "../app";
import type { State } from "../core/backend";
import { formatNumber, partColors } from "../core/colors";
import { button, h } from "../core/dom";
import { cutTree, findLevels, relabel, type Merges, type Rule } from "../core/parts";
import { Store } from "../core/store";
import { buildPlot, drawRing, ProgressBar, readColor, Slider } from "./controls";

const STEPS = 1000; // of the slider of persistence
const POINT = "#d62728"; // as in es.plot.figure_segments
const PALE = 0.72; // how much of the other parts' color is taken away beside a chosen one

export class PartsPanel implements Panel {
  readonly id = "parts";
  readonly title = "Parts";
  readonly needs: string[] = [];
  private app!: App;
  private readonly store = new Store();
  private readonly progress = new ProgressBar("parts-progress");
  private readonly start = h("div");
  private readonly results: HTMLElement;
  private readonly number = new Slider("Number of parts", "n-parts", (count) => this.cut({ count }));
  private readonly level = new Slider("Least persistence", "persistence", (step) => this.cut({ persistence: this.levelAt(step) }));
  private readonly plotHost = h("div", { class: "plot", "data-test": "diagram" });
  private readonly maximum = new Slider("Maximum, by persistence", "maximum", (index) => this.select(index));
  private readonly chosen = h("p", { class: "note", "data-test": "chosen-part" });
  private plot: uPlot | null = null;
  private finest: Int32Array = new Int32Array(); // region of each vertex
  private labels: Int32Array = new Int32Array(); // part of each vertex, by the present cut
  private merges: Merges = { count: 0, rows: new Float64Array() };
  private levels: Float64Array = new Float64Array();
  private diagram: Float64Array = new Float64Array(); // (m, 4): birth, death, persistence, vertex
  private areas: Float32Array = new Float32Array();
  private part = -1;
  private index = -1; // of the chosen maximum
  private active = false;
  private forget = () => {};

  constructor() {
    const clear = button("Show all parts", "all-parts", "End the choice of a part", () => this.selectPart(-1));
    const explained =
      "A maximum of heat far from the diagonal is a limb or a tip; one near it is a mere bump. " +
      "Click one, or the shape.";
    this.results = h(
      "div", {}, this.number.element, this.level.element, this.chosen, h("div", { class: "row" }, clear),
      h("h3", {}, "Persistence diagram of heat"), this.plotHost, this.maximum.element, h("p", { class: "note" }, explained),
    );
  }

  build(app: App): HTMLElement {
    this.app = app;
    const find = () => app.change({ kind: "parts" }, "Starting to find parts").catch(() => {});
    const begin = button("Find the parts", "find-parts", "Compute the parts of this shape", find);
    begin.classList.add("primary");
    this.start.append(h("p", {}, "Limbs, head, torso: regions between which heat flows slowly."), begin);
    return h("div", {}, this.start, this.progress.element, this.results);
  }

  refresh(state: State): void {
    const { parts, capabilities } = state;
    this.progress.show(parts);
    this.results.hidden = parts.status !== "ready";
    this.start.hidden = !["none", "failed"].includes(parts.status) || !capabilities.includes("finish");
    const fresh = this.store.renew(`${state.shape} ${parts.status}`);
    if (fresh) [this.part, this.index] = [-1, -1];
    if (fresh && this.active) this.load();
  }

  shown(): void {
    this.active = true;
    this.app.viewer.setMode("part");
    this.forget = this.app.viewer.onPick((hit) => this.selectPart(this.labels[hit.vertex] ?? -1));
    this.load();
  }

  hidden(): void {
    this.active = false;
    this.forget();
    this.app.viewer.setMode("orbit");
    this.clear();
  }

  private clear(): void {
    this.app.viewer.setLabels(null, partColors(0));
    this.app.viewer.setPoints([], POINT);
  }

  private async load(): Promise<void> {
    const { backend, state } = this.app;
    if (state.parts.status !== "ready") return this.clear();
    const [finest, rows, diagram, areas] = await this.app.run("Loading the parts", Promise.all([
      this.store.get<Int32Array>(backend, "parts/labels"),
      this.store.get<Float64Array>(backend, "parts/merges"),
      this.store.get<Float64Array>(backend, "diagram"),
      this.store.get<Float32Array>(backend, "areas"),
    ]));
    if (!this.active) return;
    Object.assign(this, { finest, diagram, areas });
    this.merges = { count: state.parts.levels.length, rows };
    this.levels = findLevels(this.merges);
    this.number.setRange(this.merges.count - this.levels.length, this.merges.count, 1);
    this.level.setRange(0, STEPS, 1);
    this.maximum.setRange(0, diagram.length / 4 - 1, 1);
    this.maximum.show(0, "none chosen");
    const order = sortByBirth(diagram);
    const data: uPlot.AlignedData = [order.map((i) => diagram[4 * i]!), order.map((i) => diagram[4 * i + 1]!)];
    if (this.plot) this.plot.setData(data);
    else this.plot = this.buildPlot(data);
    this.cut({ count: state.parts.n_regions });
  }

  /** Persistence on the slider: squared, because most levels are small. */
  private levelAt(step: number): number {
    return 1.02 * (this.levels[0] ?? 1) * (step / STEPS) ** 2;
  }

  /** Unite the finest regions by a rule, and show the parts; both sliders say the same. */
  private cut(rule: Rule): void {
    const { parts, kept } = cutTree(this.merges, rule);
    this.labels = relabel(this.finest, parts);
    const roots = this.merges.count - this.levels.length;
    // With so many parts, the next to merge has the level after the last that is kept.
    const persistence = "persistence" in rule ? rule.persistence : (this.levels[kept.length - roots - 1] ?? this.levelAt(STEPS));
    this.number.show(kept.length, `${kept.length}`);
    this.level.show(STEPS * Math.sqrt(persistence / this.levelAt(STEPS)), formatNumber(persistence, 1));
    this.part = -1;
    this.paint();
  }

  private paint(): void {
    const count = this.labels.reduce((largest, label) => Math.max(largest, label), -1) + 1;
    const colors = partColors(count);
    const { viewer } = this.app;
    if (this.part >= 0)
      colors.forEach((value, i) => {
        if (Math.floor(i / 3) !== this.part) colors[i] = value + PALE * (215 - value);
      });
    viewer.setLabels(this.labels, colors);
    viewer.setPoints(this.index < 0 ? [] : [this.diagram[4 * this.index + 3]!], POINT);
    this.chosen.textContent = this.part < 0 ? "Click a part of the shape to see it alone." : this.describePart();
    this.plot?.redraw(false);
  }

  private describePart(): string {
    let [inside, all] = [0, 0];
    this.labels.forEach((label, vertex) => {
      all += this.areas[vertex]!;
      if (label === this.part) inside += this.areas[vertex]!;
    });
    return `Part ${this.part}: ${((100 * inside) / all).toFixed(1)} % of the area.`;
  }

  private selectPart(part: number): void {
    this.part = part === this.part ? -1 : part;
    this.index = -1;
    this.maximum.show(0, "none chosen");
    this.paint();
  }

  private select(index: number): void {
    const [, , persistence, vertex] = this.diagram.subarray(4 * index, 4 * index + 4);
    this.index = index;
    this.part = this.labels[vertex!]!;
    this.maximum.show(index, `${index}: ${formatNumber(persistence!)}`);
    this.paint();
  }

  private buildPlot(data: uPlot.AlignedData): uPlot {
    const dots = { size: 6, width: 0, show: true, fill: () => readColor(this.plotHost, "--accent") };
    return buildPlot(this.plotHost, data, {
      labels: ["birth: heat at the maximum", "death"],
      series: [{ paths: () => null, points: dots }],
      draw: (plot, pixel) => {
        const { ctx } = plot;
        const [low, high] = [plot.scales.x!.min!, plot.scales.x!.max!];
        ctx.save();
        ctx.rect(plot.bbox.left, plot.bbox.top, plot.bbox.width, plot.bbox.height);
        ctx.clip();
        ctx.beginPath();
        ctx.moveTo(...pixel(low, low));
        ctx.lineTo(...pixel(high, high));
        ctx.strokeStyle = readColor(this.plotHost, "--faint");
        ctx.lineWidth = devicePixelRatio;
        ctx.stroke();
        ctx.restore();
        const at = 4 * this.index;
        if (this.index >= 0) drawRing(plot, pixel(this.diagram[at]!, this.diagram[at + 1]!), POINT);
      },
      choose: (plot, left, top) => this.select(this.findNearest(plot, left, top)),
    });
  }

  private findNearest(plot: uPlot, left: number, top: number): number {
    let [best, least] = [0, Infinity];
    for (let i = 0; i < this.diagram.length / 4; i++) {
      const x = plot.valToPos(this.diagram[4 * i]!, "x") - left;
      const y = plot.valToPos(this.diagram[4 * i + 1]!, "y") - top;
      if (x * x + y * y < least) [best, least] = [i, x * x + y * y];
    }
    return best;
  }
}

/** uPlot wants rising numbers along x. */
function sortByBirth(diagram: Float64Array): number[] {
  const order = Array.from({ length: diagram.length / 4 }, (_, i) => i);
  return order.sort((a, b) => diagram[4 * a]! - diagram[4 * b]!);
}
