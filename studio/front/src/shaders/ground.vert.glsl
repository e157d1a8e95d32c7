out vec2 v_place; // from -1 to 1
void main() {
  v_place = vec2(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y); // rows of three.js begin above
  gl_Position = projectionMatrix * (modelViewMatrix * vec4(position, 1.0));
}
