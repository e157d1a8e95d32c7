precision highp float;
in vec3 v_tint;
out vec4 color;
void main() {
  float radius = 2.0 * length(gl_PointCoord - 0.5);
  float edge = fwidth(radius);
  float disc = 1.0 - smoothstep(1.0 - edge, 1.0, radius);
  if (disc <= 0.0) discard;
#ifdef HOLLOW
  disc *= smoothstep(0.52, 0.58, radius);
  color = vec4(mix(v_tint, vec3(0.08), smoothstep(0.8, 0.86, radius)), disc);
#else
  color = vec4(mix(v_tint, vec3(0.08), smoothstep(0.68, 0.74, radius)), disc);
#endif
}
