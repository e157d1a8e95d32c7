/** What one shape shows, carried to another one by the vertex that each of its vertices corresponds to. */

/** Return, for each partner, its entries of a list with `width` numbers a vertex; `none` for -1. */
export function carry<T extends Float32Array | Int32Array | Uint8Array>(
  values: T,
  partners: Int32Array,
  width = 1,
  none = 0,
): T {
  const carried = new (values.constructor as new (length: number) => T)(width * partners.length);
  partners.forEach((partner, vertex) => {
    for (let i = 0; i < width; i++)
      carried[width * vertex + i] = partner < 0 ? none : values[width * partner + i]!;
  });
  return carried;
}

/** Return colors, three bytes each, as marks of full strength. */
export function coverWith(colors: Uint8Array): Uint8Array<ArrayBuffer> {
  const marks = new Uint8Array((4 * colors.length) / 3).fill(255);
  for (let i = 0; 3 * i < colors.length; i++) marks.set(colors.subarray(3 * i, 3 * i + 3), 4 * i);
  return marks;
}
