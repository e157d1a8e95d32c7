/** What lies under the pointer, and where all vertices are: read from the graphics card. */

import * as three from "three";
import type { Vec3 } from "./backend";

export interface Hit {
  corners: Vec3; // the vertices of the face
  vertex: number; // the nearest of them
  point: Vec3; // on the surface as it is shown
}

const GRID = 1024; // pixels: width of the picture of all vertices; every WebGL2 allows 2048

/**
 * The shape that is seen exists only in the vertex shader, so a ray against the mesh would find
 * the wrong face. Instead one pixel is drawn with the same shader, and tells the last vertex of its
 * face and its place at rest; the one or two faces that end with this vertex are then compared.
 */
export class Picker {
  private readonly scene = new three.Scene();

  constructor(
    private readonly renderer: three.WebGLRenderer,
    private readonly geometry: three.BufferGeometry,
    readonly material: three.ShaderMaterial, // of pick.vert.glsl
  ) {
    material.side = three.DoubleSide;
    material.blending = three.NoBlending;
    this.scene.matrixWorldAutoUpdate = false;
  }

  /** Return what lies under a place of the picture, in pixels of the page. */
  pick(x: number, y: number, camera: three.PerspectiveCamera, world: three.Matrix4): Hit | null {
    const mesh = new three.Mesh(this.geometry, this.material);
    mesh.matrixWorld.copy(world);
    const seen = { ...camera.view! };
    camera.setViewOffset(seen.fullWidth, seen.fullHeight, x - 0.5, y - 0.5, 1, 1);
    const [rest, place] = this.draw(mesh, camera, 1, 1);
    camera.setViewOffset(seen.fullWidth, seen.fullHeight, 0, 0, seen.width, seen.height);
    if (!rest![3]) return null;
    const point = new three.Vector3().fromArray(rest!);
    const found = this.findFace(rest![3] - 1, point);
    return { ...found, point: [...place!.subarray(0, 3)] as Vec3 };
  }

  /** Return the positions of all vertices as the shader computes them. */
  readPositions(): Float32Array {
    const count = this.geometry.getAttribute("position").count;
    const height = Math.ceil(count / GRID);
    const bare = this.geometry.clone().setIndex(null); // without faces: one point a vertex
    this.material.uniforms.grid!.value.set(GRID, height);
    const [, places] = this.draw(
      new three.Points(bare, this.material),
      new three.Camera(),
      GRID,
      height,
    );
    this.material.uniforms.grid!.value.set(0, 0);
    bare.dispose();
    return places!.filter((_, i) => i % 4 < 3 && i < 4 * count);
  }

  /** Draw an object, and return the two numbers-as-colors of all pixels. */
  private draw(object: three.Object3D, camera: three.Camera, width: number, height: number) {
    const exact = { type: three.FloatType, magFilter: three.NearestFilter, count: 2 };
    const target = new three.WebGLRenderTarget(width, height, exact);
    object.frustumCulled = false;
    this.scene.add(object);
    this.renderer.setRenderTarget(target);
    this.renderer.render(this.scene, camera);
    const pictures = [0, 1].map((number) => {
      const values = new Float32Array(4 * width * height);
      this.renderer.readRenderTargetPixels(target, 0, 0, width, height, values, undefined, number);
      return values;
    });
    this.renderer.setRenderTarget(null);
    this.scene.remove(object);
    target.dispose();
    return pictures;
  }

  /** Return the nearest face to a point that has this last corner, and its nearest corner. */
  private findFace(last: number, point: three.Vector3): Pick<Hit, "corners" | "vertex"> {
    const drawn = this.geometry.index!.array;
    const points = this.geometry.getAttribute("position");
    const [triangle, nearest] = [new three.Triangle(), new three.Vector3()];
    let corners: Vec3 = [last, last, last];
    let least = Infinity;
    for (let end = 2; end < drawn.length; end += 3) {
      if (drawn[end] !== last) continue;
      const [a, b] = [drawn[end - 2]!, drawn[end - 1]!];
      triangle.setFromAttributeAndIndices(points, a, b, last);
      const away = triangle.closestPointToPoint(point, nearest).distanceTo(point);
      if (away < least) [corners, least] = [[a, b, last], away];
    }
    const away = (vertex: number) => nearest.fromBufferAttribute(points, vertex).distanceTo(point);
    const vertex = corners.reduce((best, other) => (away(other) < away(best) ? other : best));
    return { corners, vertex };
  }
}
