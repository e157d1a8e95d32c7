precision highp float;
flat in float v_share;
out vec4 share;
void main() {
  share = vec4(v_share);
}
