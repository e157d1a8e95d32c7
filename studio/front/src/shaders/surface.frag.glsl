precision highp float;
in vec3 v_normal;
in float v_ambient; // share of the sky that is seen
uniform mat4 projectionMatrix;
uniform vec2 picture; // its width and height
// COLORING is 0: plain, 1: values through the table, 2: paint, 3: images and tints. Without a graphics card a branch
// that is not taken costs a sixth of a frame, so the shader is compiled for each of them.
#if COLORING == 1
in float v_value;
uniform sampler2D table; // 256 colors
uniform vec2 range;
uniform bool nodal;
uniform float line; // pixels of the picture for each of the page
#elif COLORING == 2
flat in vec3 v_paint;
flat in vec3 v_beyond;
in vec3 v_soft;
#elif COLORING == 3
in vec2 v_place_in_image; // the second number goes upward
in vec4 v_tint; // a color, and the number of the image from 1 on; 0 for none
uniform highp sampler2DArray images;
#else
uniform vec3 plain;
#endif
#ifdef MARKED
in vec4 v_mark;
#endif
#ifdef CLIPPED
in vec3 v_place;
uniform vec4 clip; // normal of the plane, and how far along it the shape is seen
#endif
#ifdef CREASED
in float v_crease;
in vec3 v_seen;
#endif
uniform float opacity;
out vec4 color;
void main() {
#ifdef CLIPPED
  if (dot(v_place, clip.xyz) > clip.w) discard;
#endif
#if COLORING == 1
  float share = (v_value - range.x) / max(range.y - range.x, 1e-30);
  vec3 base = texelFetch(table, ivec2(clamp(int(256.0 * share), 0, 255), 0), 0).rgb;
  // A line of constant width on the screen where the function changes its sign.
  // Where it is zero all over, as on a component of its own, there is none: slope is rounding.
  float slope = fwidth(v_value);
  float distance_to_zero = abs(v_value) / max(slope, 1e-30);
  if (isnan(v_value)) base = vec3(0.72); // no value, such as on a medial wall
  else if (nodal && slope > 1e-9 * range.y) base = mix(vec3(0.12), base, smoothstep(0.7 * line, 1.5 * line, distance_to_zero));
#elif COLORING == 2
  // The border is where the softened color is halfway to that beyond it.
  vec3 way = v_beyond - v_paint;
  float share = dot(v_soft - v_paint, way) / max(dot(way, way), 1e-6);
  float step_wide = max(fwidth(share), 1e-4);
  vec3 base = v_paint + way * smoothstep(0.5 - step_wide, 0.5 + step_wide, share);
#elif COLORING == 3
  float layer = round(255.0 * v_tint.a);
  vec3 there = vec3(v_place_in_image.x, 1.0 - v_place_in_image.y, max(layer - 1.0, 0.0));
  vec3 base = v_tint.rgb * mix(vec3(1.0), texture(images, there).rgb, min(layer, 1.0));
#else
  vec3 base = plain;
#endif
#ifdef MARKED
  base = mix(base, v_mark.rgb, v_mark.a);
#endif
  // Each number that a corner hands on costs time at every triangle; the pixel knows where the eye is.
  vec2 screen = 2.0 * gl_FragCoord.xy / picture - 1.0 + projectionMatrix[2].xy;
  vec3 eye = normalize(vec3(-screen / vec2(projectionMatrix[0][0], projectionMatrix[1][1]), 1.0));
  vec3 n = normalize(v_normal);
#ifdef CREASED
  // At a crease the normals of vertices are means across it: the face is drawn flat instead.
  if (v_crease > 0.0) n = normalize(cross(dFdx(v_seen), dFdy(v_seen)));
#endif
  if (dot(n, eye) < 0.0) n = -n; // both sides of an open surface are lit
  // A large soft lamp at the upper left of the camera, a faint one at the lower right, and daylight,
  // of which creases see little. Light changes how bright a color is, never its hue.
  float key = 0.5 + 0.5 * dot(n, vec3(-0.448, 0.647, 0.617));
  float fill = max(dot(n, vec3(0.781, -0.279, 0.558)), 0.0);
  float rim = 1.0 - max(dot(n, eye), 0.0);
  float light = 0.36 + 0.68 * key * key + 0.1 * fill - 0.12 * rim * rim * rim;
  light *= mix(0.4, 1.3, v_ambient);
  color = vec4(min(base * light, 1.0), opacity);
}
