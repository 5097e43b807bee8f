out vec3 direction;

// One triangle covering the whole picture, at infinity.
void main() {
  vec2 p = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  direction = camera_ahead.xyz + p.x * camera_right.xyz + p.y * camera_up.xyz;
  gl_Position = vec4(p, FAR_DEPTH, 1.0);
}
