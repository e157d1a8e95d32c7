/** The five calls behind every host, and the values that they take and give. */

import { decode, encode, type Arrays, type TypedArray, type WireArray } from "./wire";

export type Vec3 = [number, number, number];
export type Capability = "rig" | "finish" | "query" | "open" | "repair" | "solve";
export type Status = "none" | "running" | "ready" | "failed";
export type DeformMode = "graded" | "uncrossed" | "thesis";
export type Handle =
  | { type: "rotation"; pivot: Vec3; axis: Vec3; angle: number }
  | { type: "translation"; vector: Vec3 }
  | null;

/** Work of the server that the page waits for. */
export interface Progress {
  status: Status;
  progress: number; // 0 to 1
  message: string;
}

export interface State {
  name: string;
  n_vertices: number;
  n_faces: number;
  center: Vec3;
  extent: number;
  up: Vec3;
  front: Vec3;
  capabilities: Capability[];
  health: {
    status: Status; // all else is null until it is ready
    components: number;
    boundary_loops: number;
    closed: boolean;
    manifold: boolean;
    area: number;
    volume: number | null;
    findings: { name: string; why: string }[];
  };
  values: { name: string; title: string; unit: string; min: number; max: number }[];
  spectrum: Progress & { k: number; certificate: string; complete: boolean };
  parts: Progress & { n_regions: number; levels: number[] };
  deformation: Progress & { mode: DeformMode; n_edits: number; n_redoable: number };
  index: { path: string; n_shapes: number } | null;
  pose: number;
  shape: number;
}

export type Change =
  | { kind: "preview" | "commit"; handles: Handle[]; mode: DeformMode }
  | { kind: "undo" | "redo" | "reset" | "cancel" | "parts" }
  | { kind: "replay"; edits: unknown; source?: string; sourceFile?: Uint8Array }
  | { kind: "repair"; names: string[] }
  | { kind: "solve"; k: number }
  | { kind: "open" | "transfer"; name: string; file: Uint8Array };
export interface Finished {
  state: State;
  seconds: number;
  warnings: string[];
  arrays: Arrays;
}
export interface RigRequest {
  n_modes: number | null;
  regions: Uint32Array[];
  fixed: Uint32Array | null;
}
export interface RigAnswer {
  n_modes: number[];
  seconds: number;
  shares: Float32Array; // (regions, vertices), one row after the other
}
export interface Query {
  n_matches: number;
  name?: string;
  file?: Uint8Array;
}
export interface Match {
  name: string;
  label: string | null;
  score: number;
  path?: string;
  up?: Vec3; // how to look at it
  front?: Vec3;
}
export interface Matches {
  matches: Match[];
  arrays: Arrays; // thumbnail0.., pairs0..
}

export interface Backend {
  meta(): Promise<State>;
  array(name: string, start?: number, stop?: number): Promise<WireArray>;
  rig(request: RigRequest): Promise<RigAnswer>;
  finish(change: Change): Promise<Finished>;
  query(query: Query): Promise<Matches>;
}

/** An error that the library raised: its kind, and its message for people. */
export class StudioError extends Error {
  constructor(
    readonly kind: string,
    message: string,
  ) {
    super(message);
  }
}

export type Call = "meta" | "array" | "rig" | "finish" | "query";
export type Send = (call: Call, message: Uint8Array<ArrayBuffer>) => Promise<ArrayBuffer | ArrayBufferView>;

/** Return the five calls over any way to send a message and receive its answer. */
export function backendOver(send: Send): Backend {
  async function ask(call: Call, meta: unknown, arrays: Record<string, TypedArray> = {}) {
    const answer = decode(await send(call, encode(meta, arrays)));
    if (answer.meta?.error) throw new StudioError(answer.meta.error.kind, answer.meta.error.message);
    return answer;
  }
  return {
    meta: async () => (await ask("meta", {})).meta,
    async array(name, start, stop) {
      const { arrays } = await ask("array", { name, start, stop });
      const array = arrays[name];
      if (!array) throw new StudioError("MissingArray", `The answer has no array ${name}.`);
      return array;
    },
    async rig({ n_modes, regions, fixed }) {
      const named: Record<string, TypedArray> = {};
      regions.forEach((region, number) => (named[`region${number}`] = region));
      if (fixed) named.fixed = fixed;
      const request = { n_modes, n_regions: regions.length, fixed: fixed !== null };
      const { meta, arrays } = await ask("rig", request, named);
      return { ...meta, shares: arrays.shares!.data as Float32Array };
    },
    async finish(change) {
      const { file, sourceFile, ...meta } = change as { file?: Uint8Array; sourceFile?: Uint8Array };
      const files = { ...(file && { file }), ...(sourceFile && { source: sourceFile }) };
      const answer = await ask("finish", meta, files);
      return { ...answer.meta, arrays: answer.arrays };
    },
    async query({ file, ...meta }) {
      const answer = await ask("query", meta, file ? { file } : {});
      return { matches: answer.meta.matches, arrays: answer.arrays };
    },
  };
}
