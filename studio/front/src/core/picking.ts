/** What lies under the pointer, and where all vertices are: read from the graphics card. */

import * as three from "three";
import type { Vec3 } from "./backend";
import { length, subtract, vertexOf } from "./motion";
import { PICK_FRAGMENT, PICK_VERTEX, POSITION_FRAGMENT, POSITION_VERTEX } from "./shaders";

export interface Hit {
  vertex: number; // the nearest corner of the face
  face: number;
  point: Vec3; // on the surface as it is shown
  rest: Vec3; // on the surface before the motion
}

// Width of the float picture that positions are drawn to; every WebGL2 allows 2048.
const GRID = 1024;

/**
 * The shape that is seen exists only in the vertex shader, so a ray against the mesh would find
 * the wrong face. Instead one pixel is drawn with the same shader, and tells the last vertex of its
 * face and its place at rest; the one or two faces that end with this vertex are then compared.
 */
export class Picker {
  private readonly surface: three.ShaderMaterial;
  private readonly dots: three.ShaderMaterial;
  private readonly pixel: three.WebGLRenderTarget;
  private readonly scene = new three.Scene();
  private readonly space = new three.Group();

  constructor(
    private readonly renderer: three.WebGLRenderer,
    private readonly geometry: three.BufferGeometry,
    motion: Record<string, three.IUniform>,
  ) {
    const glsl = { glslVersion: three.GLSL3, side: three.DoubleSide, blending: three.NoBlending };
    this.surface = new three.ShaderMaterial({
      ...glsl,
      uniforms: motion,
      vertexShader: PICK_VERTEX,
      fragmentShader: PICK_FRAGMENT,
    });
    this.dots = new three.ShaderMaterial({
      ...glsl,
      uniforms: { ...motion, grid: { value: new three.Vector2() } },
      vertexShader: POSITION_VERTEX,
      fragmentShader: POSITION_FRAGMENT,
      depthTest: false,
    });
    const exact = {
      type: three.FloatType,
      minFilter: three.NearestFilter,
      magFilter: three.NearestFilter,
    };
    this.pixel = new three.WebGLRenderTarget(1, 1, { ...exact, count: 2 });
    this.scene.matrixWorldAutoUpdate = false;
    this.scene.add(this.space);
  }

  /** Return what lies under a place of the picture, in pixels of the page. */
  pick(x: number, y: number, width: number, height: number, camera: three.PerspectiveCamera, world: three.Matrix4) {
    const mesh = this.addToScene(new three.Mesh(this.geometry, this.surface), world);
    camera.setViewOffset(width, height, x - 0.5, y - 0.5, 1, 1);
    this.draw(this.pixel, camera);
    camera.clearViewOffset();
    this.scene.remove(mesh);
    const [rest, place] = [0, 1].map((number) => {
      const values = new Float32Array(4);
      this.renderer.readRenderTargetPixels(this.pixel, 0, 0, 1, 1, values, undefined, number);
      return values;
    }) as [Float32Array, Float32Array];
    if (!rest[3]) return null;
    const face = this.findFace(Math.round(rest[3]) - 1, new three.Vector3().fromArray(rest));
    const corners = vertexOf(this.geometry.index!.array, face);
    const points = this.geometry.getAttribute("position").array;
    const away = (vertex: number) => length(subtract(vertexOf(points, vertex), vertexOf(rest, 0)));
    const vertex = corners.reduce((best, other) => (away(other) < away(best) ? other : best));
    return { vertex, face, point: vertexOf(place, 0), rest: vertexOf(rest, 0) };
  }

  /** Return the positions of all vertices as the shader computes them. */
  readPositions(): Float32Array {
    const count = this.geometry.getAttribute("position").count;
    const [width, height] = [GRID, Math.ceil(count / GRID)];
    const target = new three.WebGLRenderTarget(width, height, { type: three.FloatType });
    this.dots.uniforms.grid!.value.set(width, height);
    const bare = new three.BufferGeometry(); // the same buffers without faces: one point a vertex
    for (const [name, attribute] of Object.entries(this.geometry.attributes))
      bare.setAttribute(name, attribute);
    const points = this.addToScene(new three.Points(bare, this.dots), new three.Matrix4());
    this.draw(target, new three.Camera());
    this.scene.remove(points);
    const values = new Float32Array(4 * width * height);
    this.renderer.readRenderTargetPixels(target, 0, 0, width, height, values);
    target.dispose();
    const positions = new Float32Array(3 * count);
    for (let vertex = 0; vertex < count; vertex++)
      positions.set(values.subarray(4 * vertex, 4 * vertex + 3), 3 * vertex);
    return positions;
  }

  private addToScene<T extends three.Object3D>(object: T, world: three.Matrix4): T {
    object.frustumCulled = false;
    object.matrixWorld.copy(world);
    this.scene.add(object);
    return object;
  }

  private draw(target: three.WebGLRenderTarget, camera: three.Camera): void {
    const color = this.renderer.getClearColor(new three.Color());
    const opacity = this.renderer.getClearAlpha();
    this.renderer.setRenderTarget(target);
    this.renderer.setClearColor(0, 0);
    this.renderer.clear();
    this.renderer.render(this.scene, camera);
    this.renderer.setRenderTarget(null);
    this.renderer.setClearColor(color, opacity);
  }

  /** Return the face with this last corner that is nearest to a point. */
  private findFace(last: number, point: three.Vector3): number {
    const corners = this.geometry.index!.array;
    let [best, least] = [-1, Infinity];
    for (let face = 0; 3 * face < corners.length; face++) {
      if (corners[3 * face + 2] !== last) continue;
      const away = this.distanceToFace(face, point);
      if (away < least) [best, least] = [face, away];
    }
    return best;
  }

  private distanceToFace(face: number, point: three.Vector3): number {
    const points = this.geometry.getAttribute("position");
    const triangle = new three.Triangle();
    const [a, b, c] = vertexOf(this.geometry.index!.array, face);
    triangle.setFromAttributeAndIndices(points, a, b, c);
    return triangle.closestPointToPoint(point, new three.Vector3()).distanceTo(point);
  }
}
