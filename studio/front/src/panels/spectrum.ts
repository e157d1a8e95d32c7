/** The spectrum: eigenvalues with their proof, and eigenfunctions with their nodal lines. */

import type uPlot from "uplot";
import type { App } from "../app";
import type { State } from "../core/backend";
import { findRange, formatNumber } from "../core/colors";
import { button, h } from "../core/dom";
import { lowpass } from "../core/heat";
import { buildChoice, buildPlot, ColoringPanel, dots, drawLine, drawRing, pageColor, ProgressBar, Slider } from "./controls";

const BRACKET = "#f2b36b"; // as in es.plot.figure_spectrum
const N_BRACKETS = 20; // a solve with three times as many unknowns, so only the lowest
const FLAT = 1e-5; // relative range below which a mode is constant, and has no nodal line

export class SpectrumPanel extends ColoringPanel {
  readonly id = "spectrum";
  readonly title = "Spectrum";
  private readonly progress = new ProgressBar("solve-progress");
  private readonly k = h("input", { type: "number", min: 2, value: 300, "data-test": "k", "aria-label": "Number of eigenpairs" });
  private readonly solver = h("div", { class: "row" }, this.k, "eigenpairs");
  private readonly plotHost = h("div", { class: "plot", "data-test": "eigenvalues" });
  private readonly slider = new Slider("Number i", "eigenfunction", (i) => this.select(i));
  private readonly nodal = h("input", { type: "checkbox", checked: true, "data-test": "nodal", onchange: () => this.start() });
  private readonly proof = h("p", { class: "note", "data-test": "certificate" });
  private readonly bracket = button("Bracket the lowest 20", "bracket", "Compute bounds of the shape's own eigenvalues", () => this.loadBrackets().catch(() => {}));
  private readonly bounds = h("p", { class: "note", "data-test": "bounds" });
  private readonly results: HTMLElement;
  private plot: uPlot | null = null;
  private eigenvalues: Float64Array = new Float64Array();
  private brackets: Float64Array = new Float64Array(); // lower and upper bound in turn
  private index = 1;
  private view = "eigenfunction";
  private bent = false; // whether the shape is shown out of few modes

  constructor() {
    super();
    const key = (name: string, text: string) => h("span", { class: name }, text);
    const keys = [key("dot", "eigenvalues"), key("line", "Weyl’s law, 4π i / area"), key("bracket", "brackets")];
    const views = { eigenfunction: "Eigenfunction", lowpass: "Shape of 0 … i" };
    const choice = buildChoice("view", views, (view) => {
      this.view = view;
      this.start();
    });
    choice.press(this.view);
    const plot = [this.plotHost, h("p", { class: "keys-of-plot" }, ...keys)];
    const nodal = h("div", { class: "row" }, h("label", {}, this.nodal, "Nodal lines"));
    const mode = [this.slider.element, this.bounds, choice.element, nodal];
    this.results = h("div", {}, ...plot, ...mode, h("h3", {}, "Proof"), this.proof, this.bracket);
  }

  build(app: App): HTMLElement {
    this.app = app;
    this.index = app.settings.get("eigenfunction", 1);
    const solve = () => app.change({ kind: "solve", k: this.k.valueAsNumber }, "Starting to solve").catch(() => {});
    this.solver.append(button("Solve", "solve", "Compute the lowest eigenpairs", solve));
    this.solver.hidden = this.bracket.hidden = !app.state.capabilities.includes("solve");
    return h("div", {}, this.solver, this.progress.element, this.results);
  }

  protected versionOf(state: State): string {
    return `${state.shape} ${state.spectrum.k}`;
  }

  override refresh(state: State): void {
    const { spectrum } = state;
    this.progress.show(spectrum);
    this.results.hidden = !spectrum.k;
    this.proof.textContent = spectrum.certificate;
    this.proof.classList.toggle("complete", spectrum.complete);
    this.k.max = String(state.n_vertices);
    this.k.valueAsNumber = Math.min(this.k.valueAsNumber, state.n_vertices);
    super.refresh(state);
  }

  override hidden(): void {
    super.hidden();
    const restored = this.unbend().then((points) => points && this.app.viewer.setVertices(points));
    restored.catch((error) => this.app.fail(error));
  }

  protected async show(): Promise<void> {
    const { viewer, state } = this.app;
    if (!state.spectrum.k) return viewer.setScalars(null);
    const eigenvalues = await this.get<Float64Array>("eigenvalues");
    if (eigenvalues !== this.eigenvalues) this.plotValues(eigenvalues);
    const i = this.index;
    const shape = this.view === "lowpass" ? this.smoothShape(i + 1) : this.unbend();
    const [values, points] = await this.latest(Promise.all([this.get<Float32Array>("modes", i, i + 1), shape]));
    if (points) viewer.setVertices(points);
    const [low, high] = findRange(values);
    const size = Math.max(-low, high);
    const nodal = this.nodal.checked && high - low > FLAT * size;
    viewer.setScalars(values, { map: "RdBu_r", range: [-size, size], nodal, title: `eigenfunction ${i}`, unit: "1/length" });
  }

  /** Return the shape that the first modes express; Σ φ_i ⟨φ_i, x⟩. */
  private async smoothShape(count: number): Promise<Float32Array> {
    this.bent = true;
    const kept = ["modes", "areas"].map((name) => this.get<Float32Array>(name));
    const [modes, areas] = await Promise.all(kept);
    const { data } = await this.app.backend.array("vertices"); // of the present pose
    return lowpass(data as Float32Array, modes!, areas!, count);
  }

  private async unbend(): Promise<Float32Array | null> {
    if (!this.bent) return null;
    this.bent = false;
    return (await this.app.backend.array("vertices")).data as Float32Array;
  }

  private plotValues(eigenvalues: Float64Array): void {
    this.eigenvalues = eigenvalues;
    this.brackets = new Float64Array();
    const numbers = Array.from(eigenvalues.keys());
    const weyl = numbers.map((i) => (4 * Math.PI * i) / this.app.state.health.area);
    const data: uPlot.AlignedData = [numbers, weyl, Array.from(eigenvalues)];
    if (this.plot) this.plot.setData(data);
    else this.plot = this.buildPlot(data);
    this.slider.setRange(0, eigenvalues.length - 1);
    this.showIndex(Math.min(this.index, eigenvalues.length - 1));
  }

  private buildPlot(data: uPlot.AlignedData): uPlot {
    const host = this.plotHost;
    const weyl = { stroke: () => pageColor(host, "--faint"), width: 1, points: { show: false } };
    return buildPlot(host, data, {
      labels: ["number i", "eigenvalue λ, 1/length²"],
      series: [weyl, dots(host, 4)],
      draw: (plot, pixel) => {
        const { brackets, index, eigenvalues } = this;
        for (let i = 0; 2 * i < brackets.length; i++)
          drawLine(plot, pixel(i, brackets[2 * i]!), pixel(i, brackets[2 * i + 1]!), BRACKET, 3);
        drawRing(plot, pixel(index, eigenvalues[index]!), pageColor(host, "--text"));
      },
      choose: (plot, left) => this.select(plot.posToIdx(left)),
    });
  }

  private async loadBrackets(): Promise<void> {
    const request = this.app.backend.array("brackets", 0, N_BRACKETS);
    this.brackets = (await this.app.run("Computing brackets", request)).data as Float64Array;
    // Show the lowest alone: beside all the others the bars are too short to be seen.
    this.plot?.setScale("x", { min: 0, max: this.brackets.length / 2 });
    this.plot?.setScale("y", { min: 0, max: 1.05 * this.brackets.at(-1)! });
    this.results.classList.add("bracketed");
    this.showIndex(this.index);
  }

  private select(index: number): void {
    this.app.settings.set("eigenfunction", index);
    this.showIndex(index);
    this.start();
  }

  private showIndex(index: number): void {
    this.index = index;
    this.slider.show(index, `${index}: λ = ${formatNumber(this.eigenvalues[index]!, this.eigenvalues.at(-1))}`);
    const [low, high] = Array.from(this.brackets.subarray(2 * index, 2 * index + 2), (bound) => bound.toPrecision(6));
    this.bounds.textContent = low ? `That of the surface itself lies between ${low} and ${high}.` : "";
    this.plot?.redraw(false);
  }
}
