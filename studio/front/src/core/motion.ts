/** How the vertices move: the uniforms that every shader of the shape shares. */

import * as three from "three";
import type { Handle } from "./backend";
import { MAX_REGIONS } from "./regions";
import movedSource from "../shaders/moved.glsl?raw";

/** Compile the shader of a material anew if a constant of it changes; undefined removes it. */
export function define(material: three.ShaderMaterial, name: string, value: unknown): void {
  material.defines ??= {};
  if (material.defines[name] === value) return;
  if (value === undefined) delete material.defines[name];
  else material.defines[name] = value;
  material.needsUpdate = true;
}

const KINDS = { rotation: 1, translation: 2, scaling: 3 }; // as in moved.glsl; 0: at rest
const vectors = () => Array.from({ length: MAX_REGIONS }, () => new three.Vector3());

export class Motion {
  readonly n_moving = { value: 0 };
  readonly kind = { value: new Int32Array(MAX_REGIONS) };
  readonly pivot = { value: vectors() };
  readonly direction = { value: vectors() };
  readonly angle = { value: new Float32Array(MAX_REGIONS) };
  readonly blend = { value: 0 }; // of the exact result
  private readonly materials: three.ShaderMaterial[] = [];
  readonly clip = { value: new three.Vector4() }; // of materials that are CLIPPED

  set(handles: Handle[]): void {
    this.n_moving.value = handles.some((handle) => handle) ? handles.length : 0;
    handles.forEach((handle, region) => {
      const [pivot, direction] = [this.pivot.value[region]!, this.direction.value[region]!];
      this.kind.value[region] = handle ? KINDS[handle.type] : 0;
      if (handle && handle.type !== "translation") pivot.set(...handle.pivot);
      if (handle?.type === "rotation") {
        direction.set(...handle.axis);
        this.angle.value[region] = handle.angle;
      } else if (handle?.type === "translation") direction.set(...handle.vector);
      else if (handle) direction.set(...handle.factors).subScalar(1);
    });
    // A shape is drawn without what its motion does not need.
    this.define("MOVING", this.n_moving.value > 0);
    this.define("TURNING", handles.some((handle) => handle?.type === "rotation"));
    this.fade(0);
  }

  /** Blend so much of the exact result in, from 0 to 1. */
  fade(share: number): void {
    this.blend.value = share;
    this.define("BLENDING", share > 0);
  }

  private define(name: string, holds: boolean): void {
    for (const material of this.materials) define(material, name, holds ? 1 : undefined);
  }

  /** Cut off what lies beyond a plane, or nothing. */
  cut(plane: three.Vector4 | null, materials: three.ShaderMaterial[]): void {
    if (plane) this.clip.value.copy(plane);
    for (const material of materials) define(material, "CLIPPED", plane ? 1 : undefined);
  }

  /** Return a material whose vertices move as `moved.glsl` says. */
  material(vertex: string, fragmentShader: string, own: Record<string, three.IUniform>) {
    const { n_moving, kind, pivot, direction, angle, blend, clip } = this;
    const uniforms = { n_moving, kind, pivot, direction, angle, blend, clip, ...own };
    const vertexShader = movedSource + vertex;
    const glslVersion = three.GLSL3;
    const made = new three.ShaderMaterial({ glslVersion, vertexShader, fragmentShader, uniforms });
    this.materials.push(made);
    return made;
  }
}
