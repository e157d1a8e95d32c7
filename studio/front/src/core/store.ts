/** Arrays of the backend, loaded when asked for and kept until their version changes. */

import type { Backend } from "./backend";
import type { TypedArray } from "./wire";

export class Store {
  private version = "";
  private readonly kept = new Map<string, Promise<TypedArray>>();

  /** Forget everything if this is another version than the last. */
  renew(version: string): boolean {
    if (version === this.version) return false;
    this.version = version;
    this.kept.clear();
    return true;
  }

  get<T extends TypedArray>(backend: Backend, name: string, start?: number, stop?: number): Promise<T> {
    const key = `${name} ${start} ${stop}`;
    let array = this.kept.get(key);
    if (!array) {
      array = backend.array(name, start, stop).then(({ data }) => data);
      array.catch(() => this.kept.delete(key)); // the next request tries again
      this.kept.set(key, array);
    }
    return array as Promise<T>;
  }
}
