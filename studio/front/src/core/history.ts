/** What the hand did last: strokes, boxes, bends and opened files, to be undone one by one. */

export interface Step {
  undo(): unknown;
  redo(): unknown;
}

export class History {
  private past: Step[] = [];
  private future: Step[] = [];

  /** Note something that was done; what was undone before it cannot be done again. */
  did(step: Step): void {
    this.past.push(step);
    this.future = [];
  }

  forget(): void {
    [this.past, this.future] = [[], []];
  }

  can(kind: keyof Step): boolean {
    return (kind === "undo" ? this.past : this.future).length > 0;
  }

  /** Undo or redo one step; where nothing is noted, `otherwise`, which is then noted as done. */
  async go(kind: keyof Step, otherwise: Step | null): Promise<void> {
    const [from, to] = kind === "undo" ? [this.past, this.future] : [this.future, this.past];
    const step = from.pop() ?? otherwise;
    if (!step) return;
    to.push(step);
    await step[kind]();
  }
}
