struct Mark {
  vec3 a;
  float width;  // pixels
  vec3 b;
  uint colour;
};
layout(std430, binding = 3) readonly buffer Marks { Mark marks[]; };

flat out vec4 mark_colour;
out vec2 across;     // pixels from the centre line
flat out vec2 size;  // half length and half width (pixels)

// A line of constant width in pixels as two triangles; a dot if both ends are the same point.
void main() {
  Mark mark = marks[gl_VertexID / 6];
  int corner = gl_VertexID % 6;
  bool second = corner == 1 || corner == 2 || corner == 4;
  float side = (corner == 2 || corner == 4 || corner == 5) ? 1.0 : -1.0;
  vec4 a = view_projection * vec4(mark.a, 1.0), b = view_projection * vec4(mark.b, 1.0);
  // Clips an end behind the eye to a point in front of it.
  float near = 1e-3;
  if (a.w < near) a = mix(b, a, (b.w - near) / max(b.w - a.w, 1e-9));
  if (b.w < near) b = mix(a, b, (a.w - near) / max(a.w - b.w, 1e-9));
  vec2 pixels = 0.5 * viewport.xy;
  vec2 pa = a.xy / a.w * pixels, pb = b.xy / b.w * pixels;
  vec2 along = pb - pa;
  float len = length(along);
  vec2 ahead = len > 1e-3 ? along / len : vec2(1, 0);
  float half_width = 0.5 * mark.width + 1.0;
  vec4 here = second ? b : a;
  vec2 offset = (second ? 1.0 : -1.0) * half_width * ahead + side * half_width * vec2(-ahead.y, ahead.x);
  size = vec2(0.5 * len, 0.5 * mark.width);
  across = vec2((second ? 1.0 : -1.0) * (0.5 * len + half_width), side * half_width);
  mark_colour = unpackUnorm4x8(mark.colour);
  // Slightly nearer (depth is reversed), so that marks in the surface of a body are visible.
  gl_Position = vec4(here.xy + offset / pixels * here.w, 1.003 * here.z, here.w);
}
