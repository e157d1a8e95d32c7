import { expect, test, vi } from "vitest";
import { backendOver } from "../src/core/backend";
import { decode, encode } from "../src/core/wire";
import { httpBackend } from "../src/hosts/http";
import { inlineBackend } from "../src/hosts/inline";
import { widgetBackend } from "../src/hosts/widget";

async function report(meta: unknown, arrays: Parameters<typeof encode>[1]) {
  const stream = new Blob([encode(meta, arrays)]).stream().pipeThrough(new CompressionStream("gzip"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const text = btoa(String.fromCharCode(...bytes));
  return inlineBackend({ textContent: `\n${text}\n` } as HTMLElement);
}

test("a report answers meta and arrays, whole and by rows", async () => {
  const modes = Float32Array.of(0, 1, 2, 3, 4, 5);
  const eigenvalues = Float64Array.of(0, 2, 6);
  const backend = await report({ name: "ball", n_vertices: 2 }, { modes, eigenvalues });
  expect((await backend.meta()).name).toBe("ball");
  expect(await backend.array("modes")).toEqual(modes);
  expect(await backend.array("modes", 1, 2)).toEqual(Float32Array.of(2, 3));
  expect(await backend.array("modes", 1, 3)).toEqual(Float32Array.of(2, 3, 4, 5));
  expect(await backend.array("eigenvalues")).toEqual(eigenvalues);
});

test("a report refuses what it cannot do", async () => {
  const backend = await report({}, {});
  await expect(backend.array("brackets")).rejects.toThrow("no array brackets");
  await expect(backend.finish({ kind: "undo" })).rejects.toThrow("cannot change");
  await expect(backend.query(1, null)).rejects.toThrow("cannot change");
});

/** A model as in a notebook: every view hears every answer. */
function notebook() {
  const listeners: ((content: { id?: string }, buffers: DataView[]) => void)[] = [];
  const sent: { content: any; message: Uint8Array }[] = [];
  const model = {
    get: () => undefined,
    send: (content: unknown, _: unknown, buffers: ArrayBufferView[] = []) =>
      void sent.push({ content, message: buffers[0] as Uint8Array }),
    on: (_: "msg:custom", listener: (typeof listeners)[0]) => void listeners.push(listener),
  };
  const answer = (id: string, meta: unknown) => {
    const bytes = encode(meta);
    for (const listener of listeners) listener({ id }, [new DataView(bytes.buffer)]);
  };
  return { model, sent, answer };
}

test("answers of a notebook reach their calls, in any order and in two views", async () => {
  const { model, sent, answer } = notebook();
  const [one, two] = [widgetBackend(model), widgetBackend(model)];
  const answers = [one.meta(), two.meta(), one.meta()];
  await Promise.resolve();
  expect(sent.map(({ content }) => content.call)).toEqual(["meta", "meta", "meta"]);
  expect(decode(sent[0]!.message).meta).toEqual({});
  for (const i of [2, 0, 1]) answer(sent[i]!.content.id, { name: `answer ${i}` });
  expect((await Promise.all(answers)).map(({ name }) => name)).toEqual(["answer 0", "answer 1", "answer 2"]);
});

test("errors of a notebook are told, and foreign messages ignored", async () => {
  const { model, sent, answer } = notebook();
  const wrong = widgetBackend(model).array("nothing");
  await Promise.resolve();
  answer("another view", {});
  answer(sent[0]!.content.id, { error: { kind: "RequestError", message: "there is none" } });
  await expect(wrong).rejects.toThrow("there is none");
});

test("calls wait for a server that has gone, or was started anew, and say so", async () => {
  const kind = { "Content-Type": "application/octet-stream" };
  const answers = [
    () => Promise.reject(new TypeError("no network")),
    async () => new Response("A request must bring the token.", { status: 403 }),
    async () => new Response(encode({ error: { message: "soon" } }), { status: 503, headers: kind }),
    async () => new Response(encode({ name: "ball" }), { headers: kind }),
    async () => new Response("The body is too long.", { status: 413 }),
  ];
  const sent: string[] = [];
  vi.stubGlobal("fetch", (address: string) => {
    sent.push(address);
    return answers.shift()!();
  });
  const backend = httpBackend("a-tab", 1);
  const heard: (string | null)[] = [];
  backend.trouble = (why) => heard.push(why);
  expect((await backend.meta()).name).toBe("ball");
  expect(heard.map((why) => why?.slice(0, 19) ?? null)).toEqual([
    "The studio does not",
    "The studio was star",
    null,
  ]);
  expect(sent).toEqual(Array(4).fill("api/meta"));
  await expect(backend.meta()).rejects.toThrow("413: The body is too long.");
  vi.unstubAllGlobals();
});

test("a change that is sent again keeps its name, and each change has another", async () => {
  const names: string[] = [];
  const backend = backendOver(async (_, message) => {
    names.push(decode(message).meta.id);
    return encode({});
  });
  await backend.finish({ kind: "undo" });
  await backend.finish({ kind: "undo" });
  expect(new Set(names).size).toBe(2);
});
