/** One message format for every call and every host: header length, JSON header, arrays. */

export type TypedArray = Float32Array | Float64Array | Uint32Array | Int32Array | Uint8Array;
export interface WireArray<T extends TypedArray = TypedArray> {
  data: T;
  shape: number[];
}
export type Arrays = Record<string, WireArray>;
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
} as const;
type Dtype = keyof typeof TYPES;

// Typed arrays need aligned offsets; 8 bytes serve all types.
const ALIGNMENT = 8;
const align = (bytes: number) => Math.ceil(bytes / ALIGNMENT) * ALIGNMENT;

function dtypeOf(array: TypedArray): Dtype {
  for (const [name, type] of Object.entries(TYPES)) if (array instanceof type) return name as Dtype;
  throw new TypeError(`An array of a message cannot be a ${array.constructor.name}.`);
}

export function encode(meta: unknown, arrays: Record<string, WireArray | TypedArray> = {}) {
  const entries: Record<string, { dtype: Dtype; shape: number[]; offset: number }> = {};
  const parts: { offset: number; data: TypedArray }[] = [];
  let size = 0;
  for (const [name, value] of Object.entries(arrays)) {
    const array = "data" in value ? value : { data: value, shape: [value.length] };
    entries[name] = { dtype: dtypeOf(array.data), shape: array.shape, offset: size };
    parts.push({ offset: size, data: array.data });
    size = align(size + array.data.byteLength);
  }
  const header = new TextEncoder().encode(JSON.stringify({ meta, arrays: entries }));
  const begin = align(4 + header.length);
  const bytes = new Uint8Array(begin + size);
  bytes.fill(0x20, 4, begin);
  new DataView(bytes.buffer).setUint32(0, begin - 4, true);
  bytes.set(header, 4);
  for (const { offset, data } of parts)
    bytes.set(new Uint8Array(data.buffer, data.byteOffset, data.byteLength), begin + offset);
  return bytes;
}

export function decode(message: ArrayBuffer | ArrayBufferView): Message {
  const bytes = alignedBytes(message);
  if (bytes.length < 4) throw new RangeError(`A message has 4 bytes or more; it has ${bytes.length}.`);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const begin = 4 + view.getUint32(0, true);
  if (begin > bytes.length || begin % ALIGNMENT)
    throw new RangeError(`The header of a message ends at byte ${begin} of ${bytes.length}.`);
  const header = JSON.parse(new TextDecoder().decode(bytes.subarray(4, begin)));
  const arrays: Arrays = {};
  for (const [name, entry] of Object.entries<any>(header.arrays ?? {})) {
    const type = TYPES[entry.dtype as Dtype];
    if (!type) throw new TypeError(`Array ${name} has the unknown type ${entry.dtype}.`);
    const length = entry.shape.reduce((product: number, side: number) => product * side, 1);
    const end = begin + entry.offset + length * type.BYTES_PER_ELEMENT;
    if (entry.offset % ALIGNMENT || end > bytes.length)
      throw new RangeError(`Array ${name} ends at byte ${end} of ${bytes.length}.`);
    const data = new type(bytes.buffer as ArrayBuffer, bytes.byteOffset + begin + entry.offset, length);
    const numbers = data instanceof Uint16Array ? fromHalves(data, entry.scale ?? 1) : data;
    arrays[name] = { data: numbers, shape: entry.shape };
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
