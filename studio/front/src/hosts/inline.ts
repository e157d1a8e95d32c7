/** A report: one page without a server, which has all arrays in itself. */

import type { Backend } from "../core/backend";
import { decode } from "../core/wire";

const refuse = async () => {
  throw new Error(
    "A report shows a shape and cannot change it. Open the shape in the studio instead.",
  );
};

/** Return the backend of a page that has a message, base64 of gzip, as the text of a script. */
export async function inlineBackend(script: HTMLElement): Promise<Backend> {
  const text = atob(script.textContent!.trim());
  const packed = Uint8Array.from(text, (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const { meta, arrays } = decode(await new Response(stream).arrayBuffer());
  return {
    trouble: () => {},
    meta: async () => meta,
    async array(name, start, stop) {
      const whole = arrays[name];
      if (!whole) throw new Error(`The report has no array ${name}.`);
      if (start === undefined) return whole as any;
      const width = meta.n_vertices; // only modes are read by rows
      return whole.subarray(start * width, stop! * width);
    },
    rig: refuse,
    finish: refuse,
    query: refuse,
  };
}
