/** What panels have in common that color the shape while they are shown. */

import type { App, Panel } from "../contract";
import type { State } from "../core/backend";
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
    viewer.setPointer();
    viewer.setScalars(null);
    viewer.setPoints([], "#000000");
  }

  protected start(): void {
    this.show().catch((error) => this.app.fail(error));
  }

  protected get<T extends TypedArray>(name: string, start?: number, stop?: number): Promise<T> {
    const key = `${name} ${start} ${stop}`;
    let array = this.kept.get(key);
    if (!array) {
      array = this.app.backend.array(name, start, stop);
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
