/** How the vertices move: the uniforms that every shader of the shape shares. */

import * as three from "three";
import type { Handle } from "./backend";
import { MAX_REGIONS } from "./regions";
import movedSource from "../shaders/moved.glsl?raw";

const vectors = () => Array.from({ length: MAX_REGIONS }, () => new three.Vector3());

export class Motion {
  readonly n_moving = { value: 0 };
  readonly kind = { value: new Int32Array(MAX_REGIONS) };
  readonly pivot = { value: vectors() };
  readonly direction = { value: vectors() };
  readonly angle = { value: new Float32Array(MAX_REGIONS) };
  readonly blend = { value: 0 }; // of the exact result

  set(handles: Handle[]): void {
    this.n_moving.value = handles.some((handle) => handle) ? handles.length : 0;
    handles.forEach((handle, region) => {
      this.kind.value[region] = handle ? (handle.type === "rotation" ? 1 : 2) : 0;
      if (handle?.type === "rotation") {
        this.pivot.value[region]!.set(...handle.pivot);
        this.direction.value[region]!.set(...handle.axis);
        this.angle.value[region] = handle.angle;
      } else if (handle) this.direction.value[region]!.set(...handle.vector);
    });
    this.blend.value = 0;
  }

  /** Return a material whose vertices move as `moved.glsl` says. */
  material(vertex: string, fragmentShader: string, own: Record<string, three.IUniform>) {
    const uniforms = { ...this, ...own };
    const vertexShader = movedSource + vertex;
    const glslVersion = three.GLSL3;
    return new three.ShaderMaterial({ glslVersion, vertexShader, fragmentShader, uniforms });
  }
}
