/** A notebook: the five calls are custom messages of an anywidget model. */

import { backendOver, type Backend } from "../core/backend";

export interface WidgetModel {
  get(trait: "height"): number | undefined;
  send(content: unknown, callbacks?: unknown, buffers?: ArrayBufferView[]): void;
  on(event: "msg:custom", callback: (content: { id?: string }, buffers: DataView[]) => void): void;
}

/** Several views of one model receive every answer, so each call has a number of its own. */
export function widgetBackend(model: WidgetModel): Backend {
  const waiting = new Map<string, (answer: DataView) => void>();
  model.on("msg:custom", ({ id }, buffers) => {
    const answered = id === undefined ? undefined : waiting.get(id);
    if (!answered || !buffers[0]) return;
    waiting.delete(id!);
    answered(buffers[0]);
  });
  const view = Math.random().toString(36).slice(2);
  let number = 0;
  return backendOver((call, message) => {
    const id = `${view}-${number++}`;
    const answer = new Promise<DataView>((resolve) => waiting.set(id, resolve));
    model.send({ id, call }, undefined, [message]);
    return answer;
  });
}
