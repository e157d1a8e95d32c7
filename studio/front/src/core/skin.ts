/** How the file says that the shape looks: images and colors, on vertices that are split for them. */

import * as three from "three";
import { orderFaces } from "./order";

/** What the surface hands on to the split vertices: how they move, and how they are lit. */
const SHARED = ["position", "normal", "crease", "exact", "exact_normal", "shares", "mark", "ambient"];
const COLUMNS = 7; // of the table: the vertex, two places in the image, three colors, the image
const MOST_TEXELS = 1 << 25; // of all images: 128 MB
const LARGEST = 2048; // texels along a side of an image

export class Skin extends three.Mesh<three.BufferGeometry, three.ShaderMaterial> {
  private readonly sources: Uint32Array;

  constructor(
    private readonly surface: three.Mesh<three.BufferGeometry, three.ShaderMaterial>,
    rows: Float32Array,
    corners: Uint32Array,
    readonly images: three.DataArrayTexture,
  ) {
    super(new three.BufferGeometry(), surface.material);
    this.frustumCulled = false;
    this.onBeforeRender = surface.onBeforeRender;
    const count = rows.length / COLUMNS;
    this.sources = Uint32Array.from({ length: count }, (_, i) => rows[COLUMNS * i]!);
    const places = new Float32Array(2 * count);
    const tints = new Uint8Array(4 * count);
    for (let i = 0; i < count; i++) {
      const row = rows.subarray(COLUMNS * i, COLUMNS * (i + 1));
      places.set(row.subarray(1, 3), 2 * i);
      tints.set(row.subarray(3), 4 * i); // the image takes the place of the opacity
    }
    this.geometry.setIndex(new three.BufferAttribute(orderFaces(corners, count), 1));
    this.geometry.setAttribute("place_in_image", new three.BufferAttribute(places, 2));
    this.geometry.setAttribute("tint", new three.BufferAttribute(tints, 4, true));
    for (const name of SHARED) {
      const { array, itemSize, normalized } = this.of(surface, name);
      const own = new (array.constructor as Float32ArrayConstructor)(itemSize * count);
      this.geometry.setAttribute(name, new three.BufferAttribute(own, itemSize, normalized));
      this.follow(name);
    }
  }

  private of(mesh: three.Mesh, name: string): three.BufferAttribute {
    return mesh.geometry.getAttribute(name) as three.BufferAttribute;
  }

  /** Take what the vertices of the surface have now. */
  follow(name: string): void {
    if (!SHARED.includes(name)) return;
    const [from, to] = [this.of(this.surface, name), this.of(this, name)];
    const size = from.itemSize;
    this.sources.forEach((vertex, i) => {
      for (let k = 0; k < size; k++) to.array[size * i + k] = from.array[size * vertex + k]!;
    });
    to.needsUpdate = true;
  }

  dispose(): void {
    this.geometry.dispose();
    this.images.dispose();
  }
}

/** Return files of images as layers of one size; a file that the browser cannot read becomes white. */
export async function stackImages(files: Uint8Array<ArrayBuffer>[]): Promise<three.DataArrayTexture> {
  const found = await Promise.all(
    files.map((bytes) => createImageBitmap(new Blob([bytes])).catch(() => null)),
  );
  const largest = Math.max(1, ...found.map((image) => Math.max(image?.width ?? 1, image?.height ?? 1)));
  const count = Math.max(1, found.length);
  let size = Math.min(largest, LARGEST);
  while (size * size * count > MOST_TEXELS) size = Math.floor(size / 2);
  const data = new Uint8Array(4 * size * size * count).fill(255);
  const pen = new OffscreenCanvas(size, size).getContext("2d", { willReadFrequently: true })!;
  found.forEach((image, layer) => {
    if (!image) return;
    pen.fillStyle = "#ffffff"; // an image may be transparent where nothing uses it
    pen.fillRect(0, 0, size, size);
    pen.drawImage(image, 0, 0, size, size);
    data.set(pen.getImageData(0, 0, size, size).data, 4 * size * size * layer);
    image.close();
  });
  const texture = new three.DataArrayTexture(data, size, size, count);
  texture.wrapS = texture.wrapT = three.RepeatWrapping;
  texture.minFilter = three.LinearMipmapLinearFilter;
  texture.magFilter = three.LinearFilter;
  texture.generateMipmaps = texture.needsUpdate = true;
  return texture;
}
