/** The spectrum: eigenvalues with their proof, and eigenfunctions with their nodal lines. */

import type uPlot from "uplot";
import type { App } from "../contract";
import type { State } from "../core/backend";
import { findRange, formatNumber } from "../core/colors";
import type { Film } from "../core/film";
import { Form } from "../core/dom";
import { lowpass } from "../core/heat";
import { ColoringPanel } from "./coloring";
import { buildPlot, dots, pageColor } from "./plot";
import markup from "./spectrum.html?raw";

const BRACKET = "#f2b36b"; // as in es.plot.figure_spectrum
const N_BRACKETS = 20; // a solve with three times as many unknowns, so only the lowest
const FLAT = 1e-5; // relative range below which a mode is constant, and has no nodal line

export class SpectrumPanel extends ColoringPanel {
  readonly id = "spectrum";
  readonly title = "Spectrum";
  private readonly form = new Form(markup);
  private plot: uPlot | null = null;
  private eigenvalues = new Float64Array();
  private brackets = new Float64Array(); // lower and upper bound in turn
  private index = 1;
  private view = "eigenfunction";
  private bent = false; // whether the shape is shown out of few modes

  build(app: App): HTMLElement {
    const { form } = this;
    this.app = app;
    this.index = app.settings.get("eigenfunction", 1);
    form.onChoice("view", (view) => {
      this.view = view;
      this.start();
    });
    form.on({
      solve: () => app.change({ kind: "solve", k: form.number("k") }, "Starting to solve"),
      eigenfunction: () => this.select(form.number("eigenfunction")),
      nodal: () => this.start(),
      bracket: () => this.loadBrackets(),
    });
    const solvable = app.state.capabilities.includes("solve");
    form.get("solver").hidden = form.get("bracket").hidden = !solvable;
    return form.root;
  }

  protected versionOf(state: State): string {
    return `${state.shape} ${state.spectrum.k}`;
  }

  override refresh(state: State): void {
    const { form } = this;
    const { spectrum, n_vertices } = state;
    form.progress("solve-progress", spectrum);
    form.get("spectrum-results").hidden = !spectrum.k;
    form.text("certificate", spectrum.certificate);
    form.get("certificate").classList.toggle("complete", spectrum.complete);
    form.get("k").max = String(n_vertices);
    form.get("k").valueAsNumber = Math.min(form.number("k"), n_vertices);
    super.refresh(state);
  }

  override hidden(): void {
    super.hidden();
    this.unbend()
      .then((points) => points && this.app.viewer.setVertices(points))
      .catch((error) => this.app.fail(error));
  }

  films(): Film[] {
    const { viewer, state } = this.app;
    if (!state.spectrum.k || this.view !== "eigenfunction") return [];
    const show = (share: number) => viewer.vibrate(Math.cos(2 * Math.PI * share));
    return [{ title: "Vibration", seconds: 2, show, end: () => viewer.vibrate(1, true) }];
  }

  protected async show(): Promise<void> {
    const { viewer, state } = this.app;
    if (!state.spectrum.k) return viewer.setScalars(null);
    const eigenvalues = await this.get<Float64Array<ArrayBuffer>>("eigenvalues");
    if (eigenvalues !== this.eigenvalues) this.plotValues(eigenvalues);
    const i = this.index;
    const mode = this.get<Float32Array>("modes", i, i + 1);
    const shape = this.view === "lowpass" ? this.smoothShape(i + 1) : this.unbend();
    const [values, points] = await this.latest(Promise.all([mode, shape]));
    if (points) viewer.setVertices(points, this.view === "lowpass");
    const [low, high] = findRange(values);
    const size = Math.max(-low, high);
    const nodal = this.form.get("nodal").checked && high - low > FLAT * size;
    const title = `eigenfunction ${i}`;
    const range: [number, number] = [-size, size];
    viewer.setScalars(values, { map: "RdBu_r", range, nodal, title, unit: "1/length" });
  }

  /** Return the shape that the first modes express, in its present pose. */
  private async smoothShape(count: number): Promise<Float32Array<ArrayBuffer>> {
    this.bent = true;
    const modes = this.get<Float32Array>("modes");
    const coefficients = this.app.backend.array<Float32Array>("coefficients");
    return lowpass(await modes, await coefficients, count);
  }

  private async unbend(): Promise<Float32Array<ArrayBuffer> | null> {
    if (!this.bent) return null;
    this.bent = false;
    return this.app.backend.array("vertices");
  }

  private plotValues(eigenvalues: Float64Array<ArrayBuffer>): void {
    this.eigenvalues = eigenvalues;
    this.brackets = new Float64Array();
    const host = this.form.get("eigenvalues");
    const numbers = Array.from(eigenvalues.keys());
    const weyl = numbers.map((i) => (4 * Math.PI * i) / this.app.state.health.area);
    this.plot?.destroy();
    this.plot = buildPlot(host, [numbers, weyl, Array.from(eigenvalues)], {
      labels: ["number i", "eigenvalue λ, 1/length²"],
      series: [
        { stroke: () => pageColor(host, "--faint"), width: 1, points: { show: false } },
        dots(host, 4),
      ],
      draw: (pen) => {
        const { brackets, index } = this;
        for (let i = 0; 2 * i < brackets.length; i++)
          pen.line([i, brackets[2 * i]!], [i, brackets[2 * i + 1]!], BRACKET, 3);
        pen.ring([index, eigenvalues[index]!], pageColor(host, "--text"));
      },
      choose: (plot, left) => this.select(plot.posToIdx(left)),
    });
    this.form.setRange("eigenfunction", 0, eigenvalues.length - 1);
    this.showIndex(Math.min(this.index, eigenvalues.length - 1));
  }

  private async loadBrackets(): Promise<void> {
    const { app, form } = this;
    const request = app.backend.array<Float64Array<ArrayBuffer>>("brackets", 0, N_BRACKETS);
    const brackets = await app.run("Computing brackets", request);
    if (!brackets) return;
    this.brackets = brackets;
    // Show the lowest alone: beside all the others the bars are too short to be seen.
    this.plot?.setScale("x", { min: 0, max: this.brackets.length / 2 });
    this.plot?.setScale("y", { min: 0, max: 1.05 * this.brackets.at(-1)! });
    form.get("spectrum-results").classList.add("bracketed");
    this.showIndex(this.index);
  }

  private select(index: number): void {
    this.app.settings.set("eigenfunction", index);
    this.showIndex(index);
    this.start();
  }

  private showIndex(index: number): void {
    const { eigenvalues, brackets, form } = this;
    this.index = index;
    const value = formatNumber(eigenvalues[index]!, eigenvalues.at(-1));
    form.slide("eigenfunction", index, `${index}: λ = ${value}`);
    const pair = [...brackets.subarray(2 * index, 2 * index + 2)];
    const [low, high] = pair.map((bound) => bound.toPrecision(6));
    form.text("bounds", low ? `That of the surface itself lies between ${low} and ${high}.` : "");
    this.plot?.redraw(false);
  }
}
