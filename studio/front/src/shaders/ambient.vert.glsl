// How much light of the sky reaches a vertex: directions from which it is seen, each by its cosine
// and its brightness. Light from below comes from the ground and is faint. One pixel a vertex.
uniform mat4 lights[COLUMNS * ROWS]; // into the depth picture of each direction
uniform sampler2D depths;
uniform ivec2 grid;
uniform vec3 up;
flat out float v_share;

const vec2 SIZE = vec2(COLUMNS, ROWS);
const float TEXEL = 1.0 / float(TILE);

// The share of four neighboring pixels whose depth does not hide the place.
float sees(int tile, vec3 place) {
  vec3 at = 0.5 + 0.5 * (lights[tile] * vec4(place, 1.0)).xyz;
  if (any(lessThan(at.xy, vec2(TEXEL))) || any(greaterThan(at.xy, vec2(1.0 - TEXEL)))) return 1.0;
  at.z = min(at.z, 1.0); // beyond the far plane, as what is not hidden at all
  ivec2 corner = TILE * ivec2(tile % COLUMNS, tile / COLUMNS) + ivec2(float(TILE) * at.xy - 0.5);
  float share = 0.0;
  for (int i = 0; i < 4; i++)
    share += step(at.z, texelFetch(depths, corner + ivec2(i % 2, i / 2), 0).r + 0.5 * TEXEL);
  return share / 4.0;
}

void main() {
  vec3 n = normalize(mat3(modelMatrix) * normal);
  float size = 2.0 / length(vec3(lights[0][0][0], lights[0][1][0], lights[0][2][0])); // of a tile
  vec3 place = (modelMatrix * vec4(position, 1.0)).xyz + 3.0 * size * TEXEL * n;
  float all = 0.0;
  float seen = 0.0;
  for (int tile = 0; tile < COLUMNS * ROWS; tile++) {
    mat4 light = lights[tile];
    vec3 side = -normalize(vec3(light[0][2], light[1][2], light[2][2])); // towards the light
    float share = max(dot(n, side), 0.0);
    if (share <= 0.0) continue;
    all += share;
    seen += share * mix(0.45, 1.0, smoothstep(-0.4, 0.4, dot(side, up))) * sees(tile, place);
  }
  v_share = all > 0.0 ? seen / all : 1.0;
  vec2 cell = vec2(gl_VertexID % grid.x, gl_VertexID / grid.x) + 0.5;
  gl_Position = vec4(2.0 * cell / vec2(grid) - 1.0, 0.0, 1.0);
  gl_PointSize = 1.0;
}
