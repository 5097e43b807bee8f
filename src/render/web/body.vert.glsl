layout(location = 0) in vec3 vertex_position;
layout(location = 1) in vec3 vertex_normal;
layout(location = 2) in float vertex_extra;
layout(location = 3) in vec3 pose_position;
layout(location = 4) in vec4 pose_rotation;  // w, x, y, z
layout(location = 5) in vec3 instance_scale;
layout(location = 6) in vec4 instance_colour;

out vec3 world_position;
out vec3 local_position;
out vec3 local_normal;
out float extra;
flat out vec3 body_scale;
flat out vec4 body_rotation;
flat out vec4 body_colour;

vec3 rotated(vec4 q, vec3 v) {
  vec3 t = 2.0 * cross(q.yzw, v);
  return v + q.x * t + cross(q.yzw, t);
}

void main() {
#if defined(CAPSULE)
  local_position = vertex_position * instance_scale.x + vec3(0, 0, vertex_extra * instance_scale.z);
#else
  local_position = vertex_position * instance_scale;
#endif
  world_position = rotated(pose_rotation, local_position) + pose_position;
  local_normal = vertex_normal;
  extra = vertex_extra;
  body_scale = instance_scale;
  body_rotation = pose_rotation;
  body_colour = instance_colour;
  gl_Position = view_projection * vec4(world_position, 1.0);
}
