/** The surface in the graphics card: its buffers, and how the shader colors it. */

import * as three from "three";
import { softenBorders } from "./borders";
import { colorMap, findRange, rgbOf, type Scale } from "./colors";
import { markCreases } from "./creases";
import { define, type Motion } from "./motion";
import { orderFaces } from "./order";
import { MAX_REGIONS } from "./regions";
import type { Skin } from "./skin";
import surfaceFragment from "../shaders/surface.frag.glsl?raw";
import surfaceVertex from "../shaders/surface.vert.glsl?raw";

const PLAIN = "#cdc8c0";
const [UNCOLORED, BY_VALUE, BY_PAINT, BY_IMAGE] = [0, 1, 2, 3]; // COLORING of the shader
const [SEEN, UNSEEN] = [0, 1]; // layers; the camera sees the first one

export class Surface extends three.Mesh<three.BufferGeometry, three.ShaderMaterial> {
  vertices = new Float32Array(0);
  faces = new Uint32Array(0);
  labels: Int32Array | null = null;
  skin: Skin | null = null;
  private coloring = UNCOLORED;
  private textured = true; // whether the skin is shown where no result colors the surface

  constructor(motion: Motion, plain = PLAIN) {
    const material = motion.material(surfaceVertex, surfaceFragment, {
      table: { value: null },
      range: { value: new three.Vector2(0, 1) },
      nodal: { value: false },
      line: { value: 1 },
      swing: { value: 0 },
      phase: { value: 1 },
      plain: { value: new three.Vector3(...rgbOf(plain)).divideScalar(255) },
      opacity: { value: 1 },
      picture: { value: new three.Vector2() },
      images: { value: null },
    });
    material.side = three.DoubleSide;
    material.defines = { COLORING: UNCOLORED };
    super(new three.BufferGeometry(), material);
    this.frustumCulled = false; // the shader moves vertices out of the box of the geometry
    this.onBeforeRender = (renderer) =>
      renderer.getDrawingBufferSize(material.uniforms.picture!.value);
  }

  setMesh(vertices: Float32Array, faces: Uint32Array): void {
    const count = vertices.length / 3;
    Object.assign(this, { vertices, faces });
    this.setSkin(null);
    const creased = markCreases(vertices, faces);
    define(this.material, "CREASED", creased.some((mark) => mark > 0) ? 1 : undefined);
    const attributes = {
      position: [vertices, 3],
      normal: [vertexNormals(vertices, faces), 3],
      crease: [creased, 1],
      exact: [vertices.slice(), 3],
      exact_normal: [new Float32Array(3 * count), 3],
      shares: [new Float32Array(MAX_REGIONS * count), MAX_REGIONS],
      value: [new Float32Array(count), 1],
      paint: [new Uint8Array(3 * count), 3],
      soft: [new Uint8Array(3 * count), 3],
      beyond: [new Uint8Array(3 * count), 3],
      mark: [new Uint8Array(4 * count), 4],
      ambient: [new Uint8Array(count).fill(255), 1],
    } as const;
    this.geometry.dispose();
    this.geometry.setIndex(new three.BufferAttribute(orderFaces(faces, count), 1));
    for (const [name, [array, size]] of Object.entries(attributes)) {
      const normalized = array instanceof Uint8Array;
      this.geometry.setAttribute(name, new three.BufferAttribute(array, size, normalized));
    }
  }

  setVertices(vertices: Float32Array<ArrayBuffer>): void {
    this.vertices = vertices;
    this.replace("position", vertices);
    this.replace("normal", vertexNormals(vertices, this.faces));
  }

  setExact(vertices: Float32Array): void {
    this.replace("exact", vertices);
    this.replace("exact_normal", vertexNormals(vertices, this.faces));
  }

  /** Show how the file says that the surface looks, while no result colors it. */
  setSkin(skin: Skin | null): void {
    this.skin?.removeFromParent();
    this.skin?.dispose();
    this.skin = skin;
    if (skin) this.add(skin);
    this.material.uniforms.images!.value = skin?.images ?? null;
    this.colorBy(this.coloring);
  }

  showTexture(textured: boolean): void {
    this.textured = textured;
    this.colorBy(this.coloring);
  }

  private colorBy(coloring: number): void {
    this.coloring = coloring;
    const bare = coloring === UNCOLORED && this.textured && this.skin !== null;
    define(this.material, "COLORING", bare ? BY_IMAGE : coloring);
    // One of both is drawn. What is made invisible would hide what belongs to it, too.
    this.layers.set(bare ? UNSEEN : SEEN);
    if (this.skin) this.skin.visible = bare;
  }

  /** Color by a function; nodal lines mark where it is zero. */
  setScalars(values: Float32Array | null, scale?: Scale): void {
    const { table, range, nodal } = this.material.uniforms;
    this.labels = null;
    this.colorBy(values ? BY_VALUE : UNCOLORED);
    if (!values || !scale) return;
    this.replace("value", values);
    table!.value?.dispose();
    table!.value = new three.DataTexture(colorMap(scale.map), 256, 1);
    table!.value.needsUpdate = true;
    range!.value.set(...scale.range);
    nodal!.value = scale.nodal ?? false;
  }

  /** Color by parts; `palette` has three bytes a label. Labels below 0 stay plain. */
  setLabels(labels: Int32Array, palette: Uint8Array): void {
    this.labels = labels;
    const paint = new Uint8Array(3 * labels.length).fill(209);
    labels.forEach((label, vertex) => {
      if (label >= 0) paint.set(palette.subarray(3 * label, 3 * label + 3), 3 * vertex);
    });
    this.replace("paint", paint);
    const { soft, beyond } = softenBorders(this.faces, labels, paint);
    this.replace("soft", soft);
    this.replace("beyond", beyond);
    this.turnCorners(labels);
    this.colorBy(BY_PAINT);
  }

  /** Let each face end with a corner of its most frequent label: the shader takes that color. */
  private turnCorners(labels: Int32Array): void {
    const drawn = this.geometry.index!;
    const corners = drawn.array as Uint32Array;
    for (let place = 0; place < corners.length; place += 3) {
      const [a, b, c] = corners.subarray(place, place + 3) as unknown as [number, number, number];
      if (labels[a] === labels[b] && labels[b] !== labels[c]) corners.set([c, a, b], place);
    }
    drawn.needsUpdate = true;
  }

  /** Tint vertices: red, green, blue and strength of each, in bytes. */
  setMarks(marks: Uint8Array): void {
    define(this.material, "MARKED", marks.some((byte) => byte > 0) ? 1 : undefined);
    this.replace("mark", marks);
  }

  /** Let the values swing along the normals: by `reach` at most, in a phase from -1 to 1. */
  vibrate(reach: number, phase: number): void {
    const { swing, phase: colors } = this.material.uniforms;
    const values = this.geometry.getAttribute("value").array as Float32Array;
    const [low, high] = findRange(values);
    swing!.value = (reach * phase) / (Math.max(-low, high) || 1);
    colors!.value = phase;
  }

  /** Let what lies behind be seen, or not. */
  setVeil(veil: boolean): void {
    this.material.transparent = veil;
    this.material.depthWrite = !veil;
    this.material.uniforms.opacity!.value = veil ? 0.28 : 1;
  }

  replace(name: string, values: ArrayLike<number>): void {
    const attribute = this.geometry.getAttribute(name) as three.BufferAttribute;
    attribute.array.set(values);
    attribute.needsUpdate = true;
    this.skin?.follow(name);
  }

  /** Return a geometry that uses the buffers of this one with corners of its own. */
  shareBuffers(geometry: three.BufferGeometry, corners: Uint32Array): void {
    geometry.setIndex(new three.BufferAttribute(corners, 1));
    for (const [name, attribute] of Object.entries(this.geometry.attributes))
      geometry.setAttribute(name, attribute);
  }
}

/** Return unit normals at the vertices, weighted by the areas of the faces. */
export function vertexNormals(points: Float32Array, faces: Uint32Array): Float32Array {
  const surface = new three.BufferGeometry();
  surface.setAttribute("position", new three.BufferAttribute(points, 3));
  surface.setIndex(new three.BufferAttribute(faces, 1)).computeVertexNormals();
  return surface.getAttribute("normal").array as Float32Array;
}
