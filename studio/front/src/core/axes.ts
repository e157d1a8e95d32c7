/** The axes of the coordinates, as directions. */

import { Vector3 } from "three";

/** Return the axis, or its opposite, that a direction is nearest to. */
export function nearestAxis(direction: Vector3): Vector3 {
  const sizes = direction.toArray().map(Math.abs);
  const axis = sizes.indexOf(Math.max(...sizes));
  return new Vector3().setComponent(axis, Math.sign(direction.getComponent(axis)));
}
