/** Edits and poses that come from files, or go into them. */

import type { App } from "../../contract";
import { parseJson } from "../../core/dom";

/** Apply the edits of a JSON file, which may have been made on another mesh of the shape. */
export async function replayFile(app: App): Promise<void> {
  const files = await app.choose(`.json,${app.state.suffixes}`, true);
  const written = files.find(({ name }) => name.endsWith(".json"));
  const source = files.find((file) => file !== written);
  if (files.length && !written) app.say("Choose a JSON file of edits.");
  if (!written) return;
  const edits = parseJson(written);
  if (!edits) return app.fail(new Error(`${written.name} is not a JSON file of edits.`));
  const change = { kind: "replay", edits, source: source?.name };
  await app.change(change, "Applying the edits", source && { source: source.bytes });
}

/** Carry the pose over to the shape of a file, which becomes the shape. */
export async function transferToFile(app: App): Promise<void> {
  const [file] = await app.choose();
  if (!file) return;
  const { name, bytes } = file;
  await app.change({ kind: "transfer", name }, "Carrying the pose over", { file: bytes });
}
