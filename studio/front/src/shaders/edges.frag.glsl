precision highp float;
#ifdef CLIPPED
in vec3 v_place;
uniform vec4 clip;
#endif
out vec4 color;
void main() {
#ifdef CLIPPED
  if (dot(v_place, clip.xyz) > clip.w) discard;
#endif
  color = vec4(0.1, 0.1, 0.12, 0.45);
}
