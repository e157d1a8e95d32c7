precision highp float;
in vec3 v_rest;
in vec3 v_place;
flat in float v_last;
#ifdef CLIPPED
uniform vec4 clip;
#endif
layout(location = 0) out vec4 rest;
layout(location = 1) out vec4 place;
void main() {
#ifdef CLIPPED
  if (dot(v_place, clip.xyz) > clip.w) discard;
#endif
  rest = vec4(v_rest, v_last + 1.0); // 0 where there is no face
  place = vec4(v_place, 1.0);
}
