/** The pointer over the picture: it tells clicks from drags, and lets a tool drag before the camera. */

import type { Hit } from "./picking";

/** Takes over the pointer: `down` returns false to leave it to the camera. */
export interface PointerTool {
  down(event: PointerEvent): boolean;
  move(event: PointerEvent): void;
  up(): void;
}
export type Click = (hit: Hit, event: PointerEvent) => void;

const CLICK = 4; // pixels that a click may move

export class Pointer {
  private tool: PointerTool | null = null;
  private click: Click | null = null;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly pick: (x: number, y: number) => Hit | null,
  ) {
    let from: [number, number] | null = null;
    let holder: PointerTool | null = null; // the tool that has the pointer
    const take = (event: PointerEvent) => {
      if (event.button !== 0 || !event.isPrimary) return;
      from = [event.offsetX, event.offsetY];
      holder = this.tool?.down(event) ? this.tool : null;
      if (!holder) return;
      canvas.setPointerCapture(event.pointerId);
      event.stopImmediatePropagation();
    };
    const release = (event: PointerEvent) => {
      const [x, y] = [event.offsetX, event.offsetY];
      const still = from && Math.hypot(x - from[0], y - from[1]) < CLICK;
      if (holder) holder.up();
      else if (this.click && still && event.type === "pointerup") {
        const hit = this.pick(x, y);
        if (hit) this.click(hit, event);
      }
      from = holder = null;
    };
    canvas.addEventListener("pointerdown", take, { capture: true });
    canvas.addEventListener("pointermove", (event) => holder?.move(event));
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
  }

  /** Give the pointer to a tool that drags, or to what a click does; else it turns the camera. */
  set(cursor: string, click: Click | null, tool: PointerTool | null): void {
    this.canvas.style.cursor = cursor;
    [this.click, this.tool] = [click, tool];
  }
}
