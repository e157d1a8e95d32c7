precision highp float;
in vec3 v_tint;
out vec4 color;
void main() {
  float radius = 2.0 * length(gl_PointCoord - 0.5);
  float edge = fwidth(radius);
  float disc = 1.0 - smoothstep(1.0 - edge, 1.0, radius);
  if (disc <= 0.0) discard;
  color = vec4(mix(v_tint, vec3(0.08), smoothstep(0.68, 0.74, radius)), disc);
}
