/** Parts: how many, applied at once, and the persistence diagram of heat. */

import type uPlot from "uplot";
import type { App } from "../contract";
import type { State } from "../core/backend";
import { formatNumber, partColors } from "../core/colors";
import { download, Form } from "../core/dom";
import { cutParts } from "../core/parts";
import { ColoringPanel } from "./coloring";
import markup from "./parts.html?raw";
import { buildPlot, dots, pageColor } from "./plot";

const STEPS = 1000; // of the slider of persistence in parts.html
const POINT = "#d62728"; // as in es.plot.figure_segments
const PALE = 0.72; // how much of the color of other parts is taken away beside a chosen one

export class PartsPanel extends ColoringPanel {
  readonly id = "parts";
  readonly title = "Parts";
  private readonly form = new Form(markup);
  private plot: uPlot | null = null;
  private finest = new Int32Array(); // fine part of each vertex
  private labels = new Int32Array(); // part of each vertex, by the present cut
  private cuts = new Int32Array();
  private levels: number[] = []; // persistence of each fine part, falling
  private diagram = new Float64Array(); // birth, death, persistence, vertex in turn
  private areas = new Float32Array();
  private nParts = 0;
  private part = -1; // that is shown alone
  private index = -1; // of the chosen maximum

  build(app: App): HTMLElement {
    const { form } = this;
    this.app = app;
    form.on({
      "find-parts": () => app.change({ kind: "parts" }, "Starting to find parts"),
      "n-parts": () => this.cut(form.number("n-parts")),
      persistence: () => this.cutAt(this.levelAt(form.number("persistence"))),
      "all-parts": () => this.selectPart(-1),
      maximum: () => this.select(form.number("maximum")),
      "part-name": () => this.namePart(form.get("part-name").value.trim()),
      "save-parts": () => this.save(),
    });
    return form.root;
  }

  protected versionOf(state: State): string {
    return `${state.shape} ${state.parts.status}`;
  }

  override refresh(state: State): void {
    const { status } = state.parts;
    const startable = status === "none" || status === "failed";
    this.form.progress("parts-progress", state.parts);
    this.form.get("parts-results").hidden = status !== "ready";
    this.form.get("parts-begin").hidden = !startable || !state.capabilities.includes("finish");
    super.refresh(state);
  }

  protected async show(): Promise<void> {
    const { viewer, state, settings } = this.app;
    if (state.parts.status !== "ready") return viewer.setScalars(null);
    viewer.setPointer("crosshair", ({ vertex }) => {
      const part = this.labels[vertex]!;
      this.selectPart(part === this.part ? -1 : part);
    });
    const finest = await this.get<Int32Array>("parts/labels");
    const fresh = finest !== this.finest;
    const names = ["parts/cuts", "diagram", "areas"];
    const wanted = Promise.all(names.map((name) => this.get(name)));
    const [cuts, diagram, areas] = await this.latest(wanted);
    viewer.partNames = settings.get(this.namesKey, {});
    if (!fresh) return this.paint();
    Object.assign(this, { finest, cuts, diagram, areas });
    this.levels = state.parts.levels.map((level) => level ?? Infinity);
    const fewest = this.levels.filter((level) => level === Infinity).length;
    this.form.setRange("n-parts", fewest, this.levels.length);
    this.form.setRange("maximum", 0, this.diagram.length / 4 - 1);
    this.plotDiagram();
    const count = settings.get(`parts of ${state.name}`, state.parts.n_regions);
    this.cut(Math.min(count, this.levels.length));
  }

  /** Return the persistence of a step; steps are finer below, where most levels are. */
  private levelAt(step: number): number {
    return 1.02 * (this.levels.find(Number.isFinite) ?? 1) * (step / STEPS) ** 2;
  }

  /** Keep the parts of at least some persistence. */
  private cutAt(persistence: number): void {
    this.cut(this.levels.filter((level) => level >= persistence).length, persistence);
  }

  /** Unite fine parts to a number of parts, and show them; both sliders say the same. */
  private cut(count: number, persistence = this.levels[count - 1]!): void {
    const { form, levels } = this;
    this.nParts = count;
    this.labels = cutParts(this.finest, this.cuts, levels.length, count);
    this.app.settings.set(`parts of ${this.app.state.name}`, count);
    const highest = this.levelAt(STEPS);
    const level = Math.min(persistence, highest);
    form.slide("n-parts", count, String(count));
    form.slide("persistence", STEPS * Math.sqrt(level / highest), formatNumber(level));
    this.selectPart(-1);
  }

  private paint(): void {
    const { viewer } = this.app;
    const colors = partColors(this.nParts);
    const pale = colors.map((value, i) =>
      Math.floor(i / 3) === this.part ? value : value + PALE * (215 - value),
    );
    viewer.setLabels(this.labels, this.part < 0 ? colors : pale);
    viewer.setPoints(this.index < 0 ? [] : [this.diagram[4 * this.index + 3]!], POINT);
    this.form.text("chosen-part", this.describePart());
    this.form.get("name-row").hidden = this.part < 0;
    this.form.get("part-name").value = viewer.partNames[this.part] ?? "";
    this.plot?.redraw(false);
  }

  private describePart(): string {
    if (this.part < 0) return "Click a part, and it is shown alone.";
    let [inside, all] = [0, 0];
    this.areas.forEach((area, vertex) => {
      all += area;
      if (this.labels[vertex] === this.part) inside += area;
    });
    const name = this.app.viewer.partNames[this.part] ?? `Part ${this.part}`;
    return `${name}: ${((100 * inside) / all).toFixed(1)} % of the area.`;
  }

  private get namesKey(): string {
    return `names of parts of ${this.app.state.digest}`;
  }

  /** Give the chosen part a name, or take it away; it keeps the name when there are more or fewer parts. */
  private namePart(name: string): void {
    const { viewer, settings } = this.app;
    const { [this.part]: _, ...others } = viewer.partNames;
    viewer.partNames = name ? { ...others, [this.part]: name } : others;
    settings.set(this.namesKey, viewer.partNames);
    this.paint();
  }

  /** Save the part of each vertex, and its name, as a table. */
  private save(): void {
    const { app } = this;
    const rows = Array.from(this.labels, (part, vertex) => {
      const name = (app.viewer.partNames[part] ?? `part ${part}`).replaceAll('"', '""');
      return `${vertex},${part},"${name}"`;
    });
    download(["vertex,part,name", ...rows, ""].join("\n"), app.fileName("parts.csv"), "text/csv");
  }

  private selectPart(part: number): void {
    [this.part, this.index] = [part, -1];
    this.form.slide("maximum", 0, "none chosen");
    this.paint();
  }

  /** Mark a maximum of the diagram and the part around it. */
  private select(index: number): void {
    const [persistence, vertex] = this.diagram.subarray(4 * index + 2, 4 * index + 4);
    [this.part, this.index] = [this.labels[vertex!]!, index];
    this.form.slide("maximum", index, `${index}: ${formatNumber(persistence!)}`);
    this.paint();
  }

  private plotDiagram(): void {
    const host = this.form.get("diagram");
    const indices = Array.from({ length: this.diagram.length / 4 }, (_, i) => i);
    const placeOf = (index: number): [number, number] => [
      this.diagram[4 * index]!, // birth
      this.diagram[4 * index + 1]!, // death
    ];
    const places = indices.map(placeOf).sort((a, b) => a[0] - b[0]); // as uPlot wants them
    const data: uPlot.AlignedData = [
      places.map(([birth]) => birth),
      places.map(([, death]) => death),
    ];
    this.plot?.destroy();
    this.plot = buildPlot(host, data, {
      labels: ["birth: heat at the maximum, 1/length²", "death: at the saddle"],
      series: [dots(host, 6)],
      draw: (pen) => {
        const { x, y } = pen.plot.scales;
        const [low, high] = [Math.max(x!.min!, y!.min!), Math.min(x!.max!, y!.max!)];
        pen.line([low, low], [high, high], pageColor(host, "--faint"));
        if (this.index >= 0) pen.ring(placeOf(this.index), POINT);
      },
      choose: (plot, left, top) => {
        const away = (index: number) => {
          const [birth, death] = placeOf(index);
          return Math.hypot(plot.valToPos(birth, "x") - left, plot.valToPos(death, "y") - top);
        };
        this.select(indices.reduce((best, i) => (away(i) < away(best) ? i : best)));
      },
    });
  }
}
