/** Parts: how many, applied at once, and the persistence diagram of heat. */

import type uPlot from "uplot";
import type { App } from "../app";
import type { State } from "../core/backend";
import { formatNumber, partColors } from "../core/colors";
import { button, h } from "../core/dom";
import { cutTree, findLevels, relabel, type Merges, type Rule } from "../core/parts";
import { buildPlot, ColoringPanel, dots, drawLine, drawRing, pageColor, ProgressBar, Slider } from "./controls";

const STEPS = 1000; // of the slider of persistence
const POINT = "#d62728"; // as in es.plot.figure_segments
const PALE = 0.72; // how much of the color of other parts is taken away beside a chosen one

export class PartsPanel extends ColoringPanel {
  readonly id = "parts";
  readonly title = "Parts";
  private readonly progress = new ProgressBar("parts-progress");
  private readonly begin = h("div", {}, h("p", {}, "Limbs, head, torso: regions between which heat flows slowly."));
  private readonly number = new Slider("Number of parts", "n-parts", (count) => this.cut({ count }));
  private readonly level = new Slider("Least persistence", "persistence", (step) => this.cut({ persistence: this.levelAt(step) }));
  private readonly chosen = h("p", { class: "note", "data-test": "chosen-part" });
  private readonly plotHost = h("div", { class: "plot", "data-test": "diagram" });
  private readonly maximum = new Slider("Maximum and its persistence", "maximum", (index) => this.select(index));
  private readonly results: HTMLElement;
  private plot: uPlot | null = null;
  private finest: Int32Array = new Int32Array(); // region of each vertex
  private labels: Int32Array = new Int32Array(); // part of each vertex, by the present cut
  private merges: Merges = { count: 0, rows: new Float64Array() };
  private levels: Float64Array = new Float64Array();
  private diagram: Float64Array = new Float64Array(); // birth, death, persistence, vertex in turn
  private areas: Float32Array = new Float32Array();
  private nParts = 0;
  private part = -1; // that is shown alone
  private index = -1; // of the chosen maximum

  constructor() {
    super();
    const all = button("Show all parts", "all-parts", "End the choice of a part", () => this.selectPart(-1));
    const note = "A maximum of heat far from the diagonal is a limb or a tip; one near it is a bump.";
    const cuts = [this.number.element, this.level.element, this.chosen, all];
    const diagram = [h("h3", {}, "Persistence diagram of heat"), this.plotHost, this.maximum.element];
    this.results = h("div", {}, ...cuts, ...diagram, h("p", { class: "note" }, note));
  }

  build(app: App): HTMLElement {
    this.app = app;
    const find = () => app.change({ kind: "parts" }, "Starting to find parts").catch(() => {});
    const start = button("Find the parts", "find-parts", "Compute the parts of this shape", find);
    start.classList.add("primary");
    this.begin.append(start);
    app.viewer.onPick(({ vertex }) => {
      const part = this.labels[vertex] ?? -1;
      if (this.active) this.selectPart(part === this.part ? -1 : part);
    });
    return h("div", {}, this.begin, this.progress.element, this.results);
  }

  protected versionOf(state: State): string {
    return `${state.shape} ${state.parts.status}`;
  }

  override refresh(state: State): void {
    const { parts, capabilities } = state;
    this.progress.show(parts);
    this.results.hidden = parts.status !== "ready";
    this.begin.hidden = !["none", "failed"].includes(parts.status) || !capabilities.includes("finish");
    super.refresh(state);
  }

  protected async show(): Promise<void> {
    const { viewer, state } = this.app;
    viewer.setMode("part");
    if (state.parts.status !== "ready") return viewer.setScalars(null);
    const finest = await this.get<Int32Array>("parts/labels");
    const fresh = finest !== this.finest;
    const names = ["parts/merges", "diagram", "areas"];
    const [rows, diagram, areas] = await this.latest(Promise.all(names.map((name) => this.get(name))));
    if (fresh) {
      Object.assign(this, { finest, diagram, areas });
      this.merges = { count: state.parts.levels.length, rows: rows as Float64Array };
      this.levels = findLevels(this.merges);
      this.number.setRange(this.merges.count - this.levels.length, this.merges.count);
      this.level.setRange(0, STEPS);
      this.maximum.setRange(0, this.diagram.length / 4 - 1);
      this.plotDiagram();
      this.cut({ count: this.app.settings.get(`parts of ${state.name}`, state.parts.n_regions) });
    }
    this.paint();
  }

  /** Return the persistence of a step; steps are finer below, where most levels are. */
  private levelAt(step: number): number {
    return 1.02 * (this.levels[0] ?? 1) * (step / STEPS) ** 2;
  }

  /** Unite the finest regions by a rule, and show the parts; both sliders say the same. */
  private cut(rule: Rule): void {
    const { parts, kept } = cutTree(this.merges, rule);
    this.labels = relabel(this.finest, parts);
    this.nParts = kept.length;
    this.app.settings.set(`parts of ${this.app.state.name}`, kept.length);
    // The level of a number: the persistence of the last part that has not merged.
    const merged = this.merges.count - kept.length;
    const last = this.levels[this.levels.length - merged - 1] ?? this.levelAt(STEPS);
    const persistence = "count" in rule ? last : rule.persistence;
    this.number.show(kept.length, `${kept.length}`);
    this.level.show(STEPS * Math.sqrt(persistence / this.levelAt(STEPS)), formatNumber(persistence));
    this.selectPart(-1);
  }

  private paint(): void {
    const { viewer } = this.app;
    const colors = partColors(this.nParts);
    const pale = (value: number, i: number) => (Math.floor(i / 3) === this.part ? value : value + PALE * (215 - value));
    viewer.setLabels(this.labels, this.part < 0 ? colors : colors.map(pale));
    viewer.setPoints(this.index < 0 ? [] : [this.diagram[4 * this.index + 3]!], POINT);
    this.chosen.textContent = this.part < 0 ? "Click a part, and it is shown alone." : this.describePart();
    this.plot?.redraw(false);
  }

  private describePart(): string {
    const all = this.areas.reduce((sum, area) => sum + area, 0);
    const inside = this.areas.reduce((sum, area, i) => sum + (this.labels[i] === this.part ? area : 0), 0);
    return `Part ${this.part}: ${((100 * inside) / all).toFixed(1)} % of the area.`;
  }

  private selectPart(part: number): void {
    [this.part, this.index] = [part, -1];
    this.maximum.show(0, "none chosen");
    this.paint();
  }

  /** Mark a maximum of the diagram and the part around it. */
  private select(index: number): void {
    const [, , persistence, vertex] = this.diagram.subarray(4 * index, 4 * index + 4);
    [this.part, this.index] = [this.labels[vertex!]!, index];
    this.maximum.show(index, `${index}: ${formatNumber(persistence!)}`);
    this.paint();
  }

  private plotDiagram(): void {
    const places = Array.from({ length: this.diagram.length / 4 }, (_, i) => this.placeOf(i));
    const sorted = [...places].sort((a, b) => a[0] - b[0]); // uPlot wants rising numbers along x
    const data: uPlot.AlignedData = [sorted.map(([birth]) => birth), sorted.map(([, death]) => death)];
    if (this.plot) return this.plot.setData(data);
    this.plot = buildPlot(this.plotHost, data, {
      labels: ["birth: heat at the maximum, 1/length²", "death: at the saddle"],
      series: [dots(this.plotHost, 6)],
      draw: (plot, pixel) => {
        const { x, y } = plot.scales;
        const [low, high] = [Math.max(x!.min!, y!.min!), Math.min(x!.max!, y!.max!)];
        drawLine(plot, pixel(low, low), pixel(high, high), pageColor(this.plotHost, "--faint"));
        if (this.index >= 0) drawRing(plot, pixel(...this.placeOf(this.index)), POINT);
      },
      choose: (plot, left, top) => {
        const away = (i: number) => {
          const [birth, death] = this.placeOf(i);
          return Math.hypot(plot.valToPos(birth, "x") - left, plot.valToPos(death, "y") - top);
        };
        const indices = Array.from({ length: this.diagram.length / 4 }, (_, i) => i);
        this.select(indices.reduce((best, i) => (away(i) < away(best) ? i : best)));
      },
    });
  }

  /** Return birth and death of a maximum. */
  private placeOf(index: number): [number, number] {
    return [this.diagram[4 * index]!, this.diagram[4 * index + 1]!];
  }
}
