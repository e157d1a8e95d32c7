/** One message format for every call and every host: header length, JSON header, arrays. */

export type TypedArray = Float32Array | Float64Array | Uint32Array | Int32Array | Uint8Array;
export type Arrays = Record<string, TypedArray>;
export interface Message {
  meta: any;
  arrays: Arrays;
}

const TYPES = {
  "<f2": Uint16Array, // only received: decoded into single precision
  "<f4": Float32Array,
  "<f8": Float64Array,
  "<u4": Uint32Array,
  "<i4": Int32Array,
  "|u1": Uint8Array,
};
type Dtype = keyof typeof TYPES;
interface Entry {
  dtype: Dtype;
  shape: number[];
  offset: number;
  scale?: number;
}

// Typed arrays need aligned offsets; 8 bytes serve all types.
const ALIGNMENT = 8;
const align = (bytes: number) => Math.ceil(bytes / ALIGNMENT) * ALIGNMENT;

export function encode(meta: unknown, arrays: Arrays = {}): Uint8Array<ArrayBuffer> {
  const entries: Record<string, Entry> = {};
  let size = 0;
  for (const [name, data] of Object.entries(arrays)) {
    const dtype = (Object.keys(TYPES) as Dtype[]).find((key) => data instanceof TYPES[key])!;
    entries[name] = { dtype, shape: [data.length], offset: size };
    size = align(size + data.byteLength);
  }
  const header = new TextEncoder().encode(JSON.stringify({ meta, arrays: entries }));
  const begin = align(4 + header.length);
  const bytes = new Uint8Array(begin + size);
  bytes.fill(0x20, 4, begin); // spaces after the header
  new DataView(bytes.buffer).setUint32(0, begin - 4, true);
  bytes.set(header, 4);
  for (const [name, { buffer, byteOffset, byteLength }] of Object.entries(arrays))
    bytes.set(new Uint8Array(buffer, byteOffset, byteLength), begin + entries[name]!.offset);
  return bytes;
}

/** Return the meta and the arrays of a message; a damaged message raises a RangeError. */
export function decode(message: ArrayBuffer | ArrayBufferView): Message {
  const bytes = alignedBytes(message);
  const buffer = bytes.buffer as ArrayBuffer;
  const begin = 4 + new DataView(buffer, bytes.byteOffset, bytes.length).getUint32(0, true);
  if (begin > bytes.length)
    throw new RangeError(`The header of a message ends at byte ${begin} of ${bytes.length}.`);
  const header = JSON.parse(new TextDecoder().decode(bytes.subarray(4, begin)));
  const arrays: Arrays = {};
  for (const [name, entry] of Object.entries<Entry>(header.arrays)) {
    const length = entry.shape.reduce((product, side) => product * side, 1);
    const start = bytes.byteOffset + begin + entry.offset;
    const data = new TYPES[entry.dtype](buffer, start, length);
    arrays[name] = data instanceof Uint16Array ? fromHalves(data, entry.scale ?? 1) : data;
  }
  return { meta: header.meta, arrays };
}

/** Return half precision in single; only the newest browsers have arrays of it. */
function fromHalves(halves: Uint16Array, scale: number): Float32Array {
  return Float32Array.from(halves, (half) => {
    const exponent = (half >> 10) & 31;
    const fraction = (half & 1023) / 1024;
    const size = exponent ? 2 ** (exponent - 15) * (1 + fraction) : 2 ** -14 * fraction;
    return scale * (half >> 15 ? -size : size);
  });
}

/** Return the bytes, copied only if they start at an address that typed arrays cannot view. */
function alignedBytes(message: ArrayBuffer | ArrayBufferView): Uint8Array {
  if (message instanceof ArrayBuffer) return new Uint8Array(message);
  const bytes = new Uint8Array(message.buffer, message.byteOffset, message.byteLength);
  return bytes.byteOffset % ALIGNMENT ? bytes.slice() : bytes;
}
