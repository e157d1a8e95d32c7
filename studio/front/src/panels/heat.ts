/** Heat on the shape: how much stays at each point, or how it spreads from a picked source. */

import type { App, Panel } from "../app";
import type { State } from "../core/backend";
import { findRange, formatNumber } from "../core/colors";
import { button, h } from "../core/dom";
import { findTimeRange, heatFromSource, heatKernelSignature } from "../core/heat";
import { Store } from "../core/store";
import { buildChoice, ProgressBar, Slider } from "./controls";

const STEPS = 400; // of the slider, equal in the logarithm of time
const SOURCE = "#18a058";
type View = "signature" | "source";

export class HeatPanel implements Panel {
  readonly id = "heat";
  readonly title = "Heat";
  readonly needs: string[] = [];
  private app!: App;
  private readonly store = new Store();
  private readonly progress = new ProgressBar("heat-progress");
  private readonly time = new Slider("Time t", "time", () => this.paint());
  private readonly explained = h("p", { class: "note", "data-test": "heat-explained" });
  private readonly play = button("Play", "play", "Let the time run (P)", () => this.startOrStop());
  private readonly results = h("div");
  private readonly choice = buildChoice(
    "heat", { signature: "Heat that stays", source: "Heat from a source" }, (id) => this.choose(id as View),
  );
  private modes: Float32Array = new Float32Array();
  private eigenvalues: Float64Array = new Float64Array();
  private view: View = "signature";
  private source = -1;
  private active = false;
  private playing = 0;
  private forget = () => {};

  build(app: App): HTMLElement {
    this.app = app;
    this.choice.press(this.view);
    this.time.setRange(0, STEPS, 1);
    this.time.show(STEPS / 2, "");
    this.results.append(this.choice.element, this.explained, this.time.element, h("div", { class: "row" }, this.play));
    return h("div", {}, this.progress.element, this.results);
  }

  refresh(state: State): void {
    this.progress.show(state.spectrum);
    this.results.hidden = !state.spectrum.k;
    if (!this.store.renew(`${state.shape} ${state.spectrum.k}`)) return;
    if (this.source >= state.n_vertices) this.source = -1;
    if (this.active && state.spectrum.k) this.load();
  }

  shown(): void {
    this.active = true;
    this.forget = this.app.viewer.onPick((hit) => this.setSource(hit.vertex));
    this.choose(this.view);
    if (this.app.state.spectrum.k) this.load();
  }

  hidden(): void {
    this.active = false;
    this.stop();
    this.forget();
    const { viewer } = this.app;
    viewer.setMode("orbit");
    viewer.setScalars(null);
    viewer.setPoints([], SOURCE);
  }

  private async load(): Promise<void> {
    const { backend, state } = this.app;
    this.eigenvalues = await this.store.get<Float64Array>(backend, "eigenvalues");
    const all = this.store.get<Float32Array>(backend, "modes", 0, state.spectrum.k);
    this.modes = await this.app.run("Loading the eigenfunctions", all);
    this.paint();
  }

  private choose(view: View): void {
    this.view = view;
    const picking = view === "source";
    this.app.viewer.setMode(picking ? "source" : "orbit");
    this.app.viewer.setPoints(picking && this.source >= 0 ? [this.source] : [], SOURCE);
    this.paint();
  }

  private setSource(vertex: number): void {
    if (this.view !== "source") return;
    this.source = vertex;
    this.choose("source");
  }

  /** Compute the heat in the browser and show it. */
  private paint(): void {
    const times = findTimeRange(this.eigenvalues);
    if (!this.active || !this.modes.length || !times) return;
    const share = this.time.value / STEPS;
    const time = times[0] ** (1 - share) * times[1] ** share;
    this.time.show(this.time.value, `${formatNumber(time)} length²`);
    const spread = `Until then heat spreads about ${formatNumber(2 * Math.sqrt(time))} (length) along the surface.`;
    const { viewer } = this.app;
    if (this.view === "signature") {
      const heat = heatKernelSignature(this.modes, this.eigenvalues, time);
      this.explained.textContent = `The heat kernel signature: of a unit of heat at a point, what is still there after time t. High at tips, low on flat parts. ${spread}`;
      viewer.setScalars(heat, { map: "viridis", range: findRange(heat), title: "heat that stays, 1/length²" });
    } else if (this.source >= 0) {
      const heat = heatFromSource(this.modes, this.eigenvalues, time, this.source);
      const range: [number, number] = [Math.min(0, ...findRange(heat)), findRange(heat)[1]];
      this.explained.textContent = `A unit of heat was put at vertex ${this.source} at time 0. ${spread} Click for another source.`;
      viewer.setScalars(heat, { map: "inferno", range, title: "heat, 1/length²" });
    } else {
      this.explained.textContent = "Click a point of the shape: a unit of heat is put there.";
      viewer.setScalars(null);
    }
  }

  private startOrStop(): void {
    if (this.playing) return this.stop();
    this.play.textContent = "Stop";
    const step = () => {
      this.time.input.valueAsNumber = (this.time.value + 2) % (STEPS + 1);
      this.paint();
      this.playing = requestAnimationFrame(step);
    };
    this.playing = requestAnimationFrame(step);
  }

  private stop(): void {
    cancelAnimationFrame(this.playing);
    this.playing = 0;
    this.play.textContent = "Play";
  }
}
