/** Soft daylight: how much of the sky each vertex sees, and the shadow of the shape on the ground. */

import * as three from "three";
import type { Vec3 } from "./backend";
import type { Surface } from "./surface";
import ambientFragment from "../shaders/ambient.frag.glsl?raw";
import ambientVertex from "../shaders/ambient.vert.glsl?raw";
import groundFragment from "../shaders/ground.frag.glsl?raw";
import groundVertex from "../shaders/ground.vert.glsl?raw";

const [COLUMNS, ROWS] = [8, 6]; // of the atlas: a tile for each direction of light
const TILE = 192; // pixels of a side
const TILES_A_FRAME = 4; // so that no frame takes long
const GRID = 1024; // pixels: width of the picture that has a pixel for each vertex
const GROUND = 96; // points of a side of the ground
const DARKEST = 0.9;
const FAINT = 0.035; // darkness that is not seen; a large faint shadow would double the time of a frame
const REACH = 2.2; // side of the ground, in radii of the shape
const MOST_FACES = 400_000; // beyond, drawing the shape 48 times would take seconds
const ROUNDS = 8; // in which neighbors are averaged: 48 directions leave steps
const GROUND_ROUNDS = 60; // the same, on the ground, where shadows fall far

/**
 * The shape is drawn from 48 directions, depth only, into the tiles of one texture. Then one pixel
 * for each vertex counts the directions from which it is seen; so does one for each point of the
 * ground. Frames only read the result, so that daylight costs nothing while the shape is turned.
 */
export class Ambient {
  readonly ground: three.Mesh<three.PlaneGeometry, three.ShaderMaterial>;
  private readonly atlas: three.WebGLRenderTarget;
  private readonly grid: Uint32Array; // corners of all faces of the ground
  private readonly counter = new three.ShaderMaterial({
    glslVersion: three.GLSL3,
    vertexShader: ambientVertex,
    fragmentShader: ambientFragment,
    blending: three.NoBlending,
    depthTest: false,
    defines: { COLUMNS, ROWS, TILE },
    uniforms: {
      lights: { value: Array.from({ length: COLUMNS * ROWS }, () => new three.Matrix4()) },
      depths: { value: null },
      grid: { value: new three.Vector2() },
      up: { value: new three.Vector3() },
    },
  });
  private readonly caster = new three.MeshBasicMaterial({
    colorWrite: false,
    side: three.DoubleSide,
  });
  private readonly lamp = new three.OrthographicCamera();
  private frame = 0;

  constructor(
    private readonly renderer: three.WebGLRenderer,
    private readonly surface: Surface,
    private readonly onDone: () => void,
  ) {
    const depthTexture = new three.DepthTexture(COLUMNS * TILE, ROWS * TILE);
    this.atlas = new three.WebGLRenderTarget(COLUMNS * TILE, ROWS * TILE, { depthTexture });
    this.atlas.scissorTest = true; // a tile is cleared alone
    this.counter.uniforms.depths!.value = depthTexture;
    const plane = new three.PlaneGeometry(1, 1, GROUND - 1, GROUND - 1);
    const material = new three.ShaderMaterial({
      glslVersion: three.GLSL3,
      vertexShader: groundVertex,
      fragmentShader: groundFragment,
      transparent: true,
      depthWrite: false,
    });
    this.grid = Uint32Array.from(plane.index!.array);
    this.ground = new three.Mesh(plane, material);
    this.ground.visible = false;
    this.ground.renderOrder = -1;
  }

  /** Begin anew, after the shape or its pose has changed. */
  start(up: Vec3): void {
    this.stop();
    const { geometry, faces, matrixWorld } = this.surface;
    if (!faces.length || faces.length > 3 * MOST_FACES) return this.clear();
    geometry.computeBoundingSphere();
    const ball = geometry.boundingSphere!.clone().applyMatrix4(matrixWorld);
    const upward = new three.Vector3(...up);
    this.placeGround(ball, upward);
    let tile = 0;
    const step = () => {
      const last = Math.min(tile + TILES_A_FRAME, COLUMNS * ROWS);
      for (; tile < last; tile++) this.drawTile(tile, ball, upward);
      this.renderer.setRenderTarget(null);
      if (tile < COLUMNS * ROWS) this.frame = requestAnimationFrame(step);
      else this.finish();
    };
    this.frame = requestAnimationFrame(step);
  }

  stop(): void {
    cancelAnimationFrame(this.frame);
  }

  dispose(): void {
    this.stop();
    for (const each of [this.atlas, this.counter, this.caster]) each.dispose();
  }

  private clear(): void {
    this.ground.visible = false;
    (this.surface.geometry.getAttribute("ambient")?.array as Uint8Array | undefined)?.fill(255);
  }

  /** Lay the ground below the lowest vertex. */
  private placeGround(ball: three.Sphere, up: three.Vector3): void {
    const { vertices, matrixWorld } = this.surface;
    const point = new three.Vector3();
    let lowest = Infinity;
    for (let place = 0; place < vertices.length; place += 3)
      lowest = Math.min(lowest, point.fromArray(vertices, place).applyMatrix4(matrixWorld).dot(up));
    this.ground.position.copy(ball.center).addScaledVector(up, lowest - ball.center.dot(up));
    this.ground.quaternion.setFromUnitVectors(new three.Vector3(0, 0, 1), up);
    this.ground.scale.setScalar(REACH * 2 * ball.radius);
    this.ground.updateMatrixWorld(true);
  }

  /** Draw the depths of the shape as seen from one of the directions, which lie on a spiral. */
  private drawTile(tile: number, ball: three.Sphere, up: three.Vector3): void {
    const height = 1 - (2 * tile + 1) / (COLUMNS * ROWS);
    const angle = tile * Math.PI * (3 - Math.sqrt(5));
    const flat = Math.sqrt(1 - height * height);
    const side = new three.Vector3(flat * Math.cos(angle), flat * Math.sin(angle), height);
    side.applyQuaternion(this.ground.quaternion);
    const { lamp } = this;
    const radius = 1.02 * ball.radius;
    [lamp.left, lamp.right, lamp.bottom, lamp.top] = [-radius, radius, -radius, radius];
    [lamp.near, lamp.far] = [0, 2 * radius];
    lamp.up.copy(Math.abs(height) < 0.9 ? up : new three.Vector3(0, 0, 1).cross(up).addScalar(0.1));
    lamp.position.copy(ball.center).addScaledVector(side, radius);
    lamp.lookAt(ball.center);
    lamp.updateMatrixWorld();
    lamp.updateProjectionMatrix();
    const lights = this.counter.uniforms.lights!.value as three.Matrix4[];
    lights[tile]!.multiplyMatrices(lamp.projectionMatrix, lamp.matrixWorldInverse);
    const corner = [TILE * (tile % COLUMNS), TILE * Math.floor(tile / COLUMNS)] as const;
    this.atlas.viewport.set(...corner, TILE, TILE);
    this.atlas.scissor.set(...corner, TILE, TILE);
    const { geometry, matrixWorld } = this.surface;
    this.draw(this.atlas, new three.Mesh(geometry, this.caster), matrixWorld);
  }

  private draw(
    target: three.WebGLRenderTarget,
    object: three.Object3D,
    matrixWorld: three.Matrix4,
  ): void {
    const scene = new three.Scene();
    scene.matrixWorldAutoUpdate = false;
    object.matrixWorld.copy(matrixWorld);
    object.frustumCulled = false;
    scene.add(object);
    this.renderer.setRenderTarget(target);
    this.renderer.render(scene, this.lamp);
  }

  /** Light the vertices and the ground by what they see. */
  private finish(): void {
    const { surface, ground } = this;
    const { faces } = surface;
    surface.replace("ambient", average(this.count(surface), faces, ROUNDS));
    this.darken(average(this.count(ground), this.grid, GROUND_ROUNDS));
    ground.visible = true;
    this.onDone();
  }

  /** Make the ground dark where it sees little of the sky; where it is not dark it is not drawn. */
  private darken(sky: Uint8Array): void {
    const { geometry } = this.ground;
    const places = geometry.getAttribute("uv");
    const dark = Float32Array.from(sky, (share, point) => {
      const away = 2 * Math.hypot(places.getX(point) - 0.5, places.getY(point) - 0.5);
      const fading = 1 - three.MathUtils.smoothstep(away, 0.5, 1); // it ends before the rim
      return Math.max(0, DARKEST * (1 - share / 255) * fading - FAINT);
    });
    geometry.setAttribute("dark", new three.BufferAttribute(dark, 1));
    const isDark = (_: number, place: number) => {
      const first = place - (place % 3);
      return this.grid.subarray(first, first + 3).some((point) => dark[point]! > 0);
    };
    geometry.setIndex(new three.BufferAttribute(this.grid.filter(isDark), 1));
  }

  /** Return, for each vertex of an object, how much of the sky it sees. */
  private count({ geometry, matrixWorld }: three.Mesh): Float32Array {
    const { renderer, counter } = this;
    const count = geometry.getAttribute("position").count;
    const height = Math.ceil(count / GRID);
    const target = new three.WebGLRenderTarget(GRID, height, { type: three.FloatType });
    // Buffers of its own: to dispose of shared ones breaks both.
    const bare = new three.BufferGeometry();
    for (const name of ["position", "normal"])
      bare.setAttribute(name, geometry.getAttribute(name).clone());
    const { grid, up } = counter.uniforms;
    grid!.value.set(GRID, height);
    up!.value.set(0, 0, 1).applyQuaternion(this.ground.quaternion);
    this.draw(target, new three.Points(bare, counter), matrixWorld);
    const pixels = new Float32Array(4 * GRID * height);
    renderer.readRenderTargetPixels(target, 0, 0, GRID, height, pixels);
    renderer.setRenderTarget(null);
    for (const each of [target, bare]) each.dispose();
    return Float32Array.from({ length: count }, (_, vertex) => pixels[4 * vertex]!);
  }
}

/** Return the shares in bytes, averaged with those of neighbors. */
function average(shares: Float32Array, corners: ArrayLike<number>, rounds: number): Uint8Array {
  const counts = new Uint16Array(shares.length);
  for (let place = 0; place < corners.length; place++) counts[corners[place]!]! += 3;
  for (let round = 0; round < rounds; round++) {
    const sums = new Float32Array(shares.length);
    for (let place = 0; place < corners.length; place += 3) {
      const [a, b, c] = [corners[place]!, corners[place + 1]!, corners[place + 2]!];
      const sum = shares[a]! + shares[b]! + shares[c]!;
      for (const corner of [a, b, c]) sums[corner]! += sum;
    }
    shares = sums.map((sum, vertex) => (counts[vertex] ? sum / counts[vertex]! : shares[vertex]!));
  }
  return Uint8Array.from(shares, (share) => 255 * Math.min(share, 1));
}
