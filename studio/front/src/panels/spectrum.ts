/** The spectrum: eigenvalues with their proof, and eigenfunctions with their nodal lines. */

import uPlot from "uplot";
import type { App, Panel } from "../app";
import type { State } from "../core/backend";
import { formatNumber } from "../core/colors";
import { button, h } from "../core/dom";
import { lowpass } from "../core/heat";
import { Store } from "../core/store";
import { buildChoice, buildPlot, drawRing, ProgressBar, readColor, Slider } from "./controls";

const BRACKET = "#f2b36b"; // as in es.plot.figure_spectrum

export class SpectrumPanel implements Panel {
  readonly id = "spectrum";
  readonly title = "Spectrum";
  readonly needs: string[] = [];
  private app!: App;
  private readonly store = new Store();
  private readonly progress = new ProgressBar("solve-progress");
  private readonly k = h("input", { type: "number", min: 2, value: 300, "data-test": "k", "aria-label": "Number of eigenpairs" });
  private readonly solver = h("div", { class: "row" });
  private readonly plotHost = h("div", { class: "plot", "data-test": "eigenvalues" });
  private readonly slider = new Slider("Number i", "mode", (i) => this.select(i));
  private readonly nodal = h("input", { type: "checkbox", checked: true, "data-test": "nodal" });
  private readonly view = buildChoice(
    "view", { function: "Eigenfunction", shape: "Shape out of modes 0 to i" }, (id) => this.choose(id),
  );
  private readonly proof = h("p", { class: "note", "data-test": "certificate" });
  private readonly results: HTMLElement;
  private plot: uPlot | null = null;
  private eigenvalues: Float64Array = new Float64Array();
  private brackets: Float64Array | null = null;
  private index = 1;
  private ticket = 0; // of the last request: earlier ones that arrive late are not shown
  private active = false;
  private smooth = false;

  constructor() {
    const legend = h(
      "p", { class: "keys-of-plot" },
      h("span", { class: "dot" }), "eigenvalues ", h("span", { class: "line" }), "Weyl’s law, 4π i / area ",
      h("span", { class: "bracket" }), "brackets",
    );
    const nodal = h("label", {}, this.nodal, "Nodal lines");
    this.results = h(
      "div", {}, h("h3", {}, "Eigenvalues"), this.plotHost, legend,
      this.slider.element, this.view.element, h("div", { class: "row" }, nodal), h("h3", {}, "Proof"), this.proof,
    );
  }

  build(app: App): HTMLElement {
    this.app = app;
    this.view.press("function");
    this.nodal.addEventListener("change", () => this.paint());
    const solve = () => app.change({ kind: "solve", k: this.k.valueAsNumber }, "Starting to solve").catch(() => {});
    this.solver.append(this.k, "eigenpairs", button("Solve", "solve", "Compute the lowest eigenpairs", solve));
    this.solver.hidden = !app.state.capabilities.includes("solve");
    return h("div", {}, this.solver, this.progress.element, this.results);
  }

  refresh(state: State): void {
    const { spectrum } = state;
    this.progress.show(spectrum);
    this.results.hidden = !spectrum.k;
    this.proof.textContent = spectrum.certificate;
    this.proof.classList.toggle("complete", spectrum.complete);
    this.k.max = String(state.n_vertices);
    if (this.store.renew(`${state.shape} ${spectrum.k}`) && this.active && spectrum.k) this.load();
  }

  shown(): void {
    this.active = true;
    if (this.app.state.spectrum.k) this.load();
  }

  hidden(): void {
    this.active = false;
    this.app.viewer.setScalars(null);
    this.restoreShape();
  }

  /** Load the eigenvalues and plot them; eigenfunctions are loaded one at a time. */
  private async load(): Promise<void> {
    const { backend, state } = this.app;
    this.eigenvalues = await this.store.get<Float64Array>(backend, "eigenvalues");
    this.brackets = await this.store.get<Float64Array>(backend, "brackets").catch(() => null);
    if (!this.active) return;
    const last = this.eigenvalues.length - 1;
    this.results.classList.toggle("bracketed", this.brackets !== null);
    this.slider.setRange(0, last, 1);
    const numbers = Array.from(this.eigenvalues.keys());
    const weyl = numbers.map((i) => (4 * Math.PI * i) / state.health.area);
    const data: uPlot.AlignedData = [numbers, weyl, this.eigenvalues as unknown as number[]];
    if (this.plot) this.plot.setData(data);
    else this.plot = this.buildPlot(data);
    this.select(Math.min(this.index, last));
  }

  private buildPlot(data: uPlot.AlignedData): uPlot {
    const dots = { size: 4, width: 0, show: true, fill: () => readColor(this.plotHost, "--accent") };
    return buildPlot(this.plotHost, data, {
      labels: ["number i", "eigenvalue λ, 1/length²"],
      series: [
        { stroke: () => readColor(this.plotHost, "--faint"), width: 1, points: { show: false } },
        { paths: () => null, points: dots },
      ],
      draw: (plot, pixel) => {
        const { ctx } = plot;
        ctx.strokeStyle = BRACKET;
        ctx.lineWidth = 2 * devicePixelRatio;
        ctx.beginPath();
        for (let i = 0; this.brackets && 2 * i < this.brackets.length; i++) {
          ctx.moveTo(...pixel(i, this.brackets[2 * i]!));
          ctx.lineTo(...pixel(i, this.brackets[2 * i + 1]!));
        }
        ctx.stroke();
        if (this.index < this.eigenvalues.length)
          drawRing(plot, pixel(this.index, this.eigenvalues[this.index]!), readColor(this.plotHost, "--text"));
      },
      choose: (plot, left) => this.select(plot.posToIdx(left)),
    });
  }

  private select(index: number): void {
    this.index = index;
    this.slider.show(index, `${index}: λ = ${formatNumber(this.eigenvalues[index]!, this.eigenvalues.at(-1))}`);
    this.plot?.redraw(false);
    this.paint();
  }

  private choose(view: string): void {
    this.smooth = view === "shape";
    if (!this.smooth) this.restoreShape();
    this.paint();
  }

  private async paint(): Promise<void> {
    const { app, index, smooth } = this;
    const ticket = ++this.ticket;
    try {
      const values = await this.store.get<Float32Array>(app.backend, "modes", index, index + 1);
      const shape = smooth ? await this.smoothShape(index + 1) : null;
      if (ticket !== this.ticket || !this.active) return;
      if (shape) app.viewer.setVertices(shape);
      const size = values.reduce((largest, value) => Math.max(largest, Math.abs(value)), 0);
      const title = `eigenfunction ${index}, 1/length`;
      // The library's pictures divide by the largest value; here the numbers are the values themselves.
      const options = { map: "RdBu_r", range: [-size, size] as [number, number], title };
      // The constant has no nodal line, but rounding would draw some.
      const constant = size - Math.min(...[values[0]!, values.at(-1)!].map(Math.abs)) < 1e-5 * size;
      app.viewer.setScalars(values, { ...options, nodal: this.nodal.checked && !(index === 0 && constant) });
    } catch (error) {
      app.fail(error);
    }
  }

  private async smoothShape(count: number): Promise<Float32Array> {
    const get = (name: string, stop?: number) =>
      this.store.get<Float32Array>(this.app.backend, name, stop && 0, stop);
    const [vertices, areas] = await Promise.all([get("vertices"), get("areas")]);
    const modes = await get("modes", this.eigenvalues.length);
    return lowpass(vertices, modes, areas, count);
  }

  private async restoreShape(): Promise<void> {
    if (!this.smooth && this.active) this.app.viewer.setVertices((await this.app.backend.array("vertices")).data as Float32Array);
  }
}
