/** What panels are built of: arrays that are kept, sliders, choices, progress, plots, drops. */

import uPlot from "uplot";
import type { App, Panel } from "../app";
import type { Progress, State } from "../core/backend";
import { h } from "../core/dom";
import type { TypedArray } from "../core/wire";

/** A panel that colors the shape while it is shown, by arrays that it loads once. */
export abstract class ColoringPanel implements Panel {
  abstract readonly id: string;
  abstract readonly title: string;
  readonly needs: string[] = [];
  protected app!: App;
  protected active = false;
  private version = "";
  private ticket = 0;
  private readonly kept = new Map<string, Promise<TypedArray>>();

  abstract build(app: App): HTMLElement;
  /** What the arrays belong to: when it changes they are loaded again. */
  protected abstract versionOf(state: State): string;
  /** Load what is missing, and color the shape. */
  protected abstract show(): Promise<void>;

  refresh(state: State): void {
    const version = this.versionOf(state);
    if (version === this.version) return;
    this.version = version;
    this.kept.clear();
    if (this.active) this.start();
  }

  shown(): void {
    this.active = true;
    this.start();
  }

  hidden(): void {
    this.active = false;
    const { viewer } = this.app;
    viewer.setMode("orbit");
    viewer.setScalars(null);
    viewer.setPoints([], []);
  }

  protected start(): void {
    this.show().catch((error) => this.app.fail(error));
  }

  protected get<T extends TypedArray>(name: string, start?: number, stop?: number): Promise<T> {
    const key = `${name} ${start} ${stop}`;
    let array = this.kept.get(key);
    if (!array) {
      array = this.app.backend.array(name, start, stop).then(({ data }) => data);
      array.catch(() => this.kept.delete(key)); // the next request tries again
      this.kept.set(key, array);
    }
    return array as Promise<T>;
  }

  /** Wait for work; for ever if the panel is left, or waits for something newer, before it ends. */
  protected async latest<T>(work: Promise<T>): Promise<T> {
    const ticket = ++this.ticket;
    const result = await work;
    return this.active && ticket === this.ticket ? result : new Promise<T>(() => {});
  }
}

/** A slider with its name, and its value in words. */
export class Slider {
  readonly input: HTMLInputElement;
  readonly element: HTMLElement;
  private readonly output: HTMLElement;

  constructor(label: string, name: string, onInput: (value: number) => void) {
    this.input = h("input", { type: "range", "data-test": name, oninput: () => onInput(this.value) });
    this.output = h("output", { "data-test": `${name}-value` });
    this.element = h("label", { class: "slider" }, h("span", {}, label), this.output, this.input);
  }

  get value(): number {
    return this.input.valueAsNumber;
  }

  setRange(min: number, max: number, step = 1): void {
    Object.assign(this.input, { min, max, step });
  }

  show(value: number, text: string): void {
    this.input.valueAsNumber = value;
    this.input.setAttribute("aria-valuetext", text);
    this.output.textContent = text;
  }
}

/** Return a row of buttons of which one is pressed, and a function that presses one. */
export function buildChoice(name: string, options: Record<string, string>, onChoose: (id: string) => void) {
  const element = h("div", { class: "row choice", role: "group" });
  const press = (id: string) => {
    for (const each of element.querySelectorAll("button"))
      each.setAttribute("aria-pressed", String(each.dataset.test === `${name}-${id}`));
  };
  for (const [id, label] of Object.entries(options)) {
    const choose = () => (press(id), onChoose(id));
    element.append(h("button", { type: "button", "data-test": `${name}-${id}`, onclick: choose }, label));
  }
  return { element, press };
}

/** The progress of work on the server; hidden unless it runs or has failed. */
export class ProgressBar {
  private readonly bar = h("progress", { max: 1 });
  private readonly text = h("span");
  readonly element: HTMLElement;

  constructor(name: string) {
    this.element = h("div", { class: "progress", "data-test": name }, this.bar, this.text);
  }

  show({ status, progress, message }: Progress): void {
    this.element.hidden = status !== "running" && status !== "failed";
    this.bar.hidden = status === "failed";
    this.bar.value = progress;
    this.text.textContent = status === "failed" ? message : `${Math.round(100 * progress)} % ${message}`;
  }
}

/** Let files be dropped on an element. */
export function acceptDrops(element: HTMLElement, onFile: (name: string, file: Uint8Array) => void): void {
  const mark = (event: DragEvent) => {
    event.preventDefault(); // otherwise the browser leaves the page for the file
    element.classList.toggle("dropping", event.type === "dragover");
  };
  for (const type of ["dragover", "dragleave", "drop"] as const) element.addEventListener(type, mark);
  element.addEventListener("drop", async (event) => {
    const file = event.dataTransfer?.files[0];
    if (file) onFile(file.name, new Uint8Array(await file.arrayBuffer()));
  });
}

const MARGIN = 0.04; // of the range along x, so that points at its ends are seen whole
type Place = [number, number];
export interface PlotOptions {
  labels: [string, string];
  series: uPlot.Series[];
  draw(plot: uPlot, pixel: (x: number, y: number) => Place): void;
  choose(plot: uPlot, left: number, top: number): void; // a click
}

/** Return a plot in the colors of the page, dark or light, that answers to clicks. */
export function buildPlot(host: HTMLElement, data: uPlot.AlignedData, options: PlotOptions): uPlot {
  const stroke = () => pageColor(host, "--text");
  const grid = { stroke: () => pageColor(host, "--line"), width: 1 };
  const font = "12px system-ui, sans-serif";
  const [x, y] = options.labels.map((label) => ({ label, labelFont: font, labelSize: 18, font, gap: 3, stroke, grid, ticks: grid }));
  const draw = (plot: uPlot) => options.draw(plot, (x, y) => [plot.valToPos(x, "x", true), plot.valToPos(y, "y", true)]);
  const settings: uPlot.Options = {
    width: host.clientWidth,
    height: 200,
    padding: [8, 10, 0, 0],
    legend: { show: false },
    scales: { x: { time: false, range: (_, low, high) => [low - MARGIN * (high - low), high + MARGIN * (high - low)] } },
    cursor: { drag: { x: false, y: false }, points: { show: false } },
    axes: [{ ...x, size: 28 }, { ...y, size: 44 }],
    series: [{}, ...options.series],
    hooks: { draw: [draw] },
  };
  const plot = new uPlot(settings, data, host);
  plot.over.addEventListener("click", () => options.choose(plot, plot.cursor.left!, plot.cursor.top!));
  const page = host.closest("[data-theme]");
  if (page) new MutationObserver(() => plot.redraw(false)).observe(page, { attributeFilter: ["data-theme"] });
  return plot;
}

/** A series of dots in the color of the page. */
export function dots(host: HTMLElement, size: number): uPlot.Series {
  return { paths: () => null, points: { show: true, size, width: 0, fill: () => pageColor(host, "--accent") } };
}

export function pageColor(element: Element, name: string): string {
  return getComputedStyle(element).getPropertyValue(name).trim();
}

export function drawLine(plot: uPlot, from: Place, to: Place, color: string, width = 1): void {
  plot.ctx.beginPath();
  plot.ctx.moveTo(...from);
  plot.ctx.lineTo(...to);
  drawPath(plot, color, width);
}

export function drawRing(plot: uPlot, place: Place, color: string): void {
  plot.ctx.beginPath();
  plot.ctx.arc(...place, 5 * devicePixelRatio, 0, 2 * Math.PI);
  drawPath(plot, color, 2);
}

function drawPath({ ctx }: uPlot, color: string, width: number): void {
  ctx.strokeStyle = color;
  ctx.lineWidth = width * devicePixelRatio;
  ctx.stroke();
}
