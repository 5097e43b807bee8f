layout(location = 0) in vec3 vertex_position;
layout(location = 1) in vec3 vertex_normal;
layout(location = 2) in float vertex_extra;

struct Pose {
  vec4 position;
  vec4 rotation;  // w, x, y, z
};
struct Instance {
  vec3 scale;  // half extents, radius, or radius and half length
  uint slot;
};
layout(std430, binding = 0) readonly buffer Poses { Pose poses[]; };
layout(std430, binding = 1) readonly buffer Instances { Instance instances[]; };
layout(std430, binding = 2) readonly buffer Colours { uint colours[]; };

// An instance of the draw call is several copies of the mesh, one per body.
layout(location = 0) uniform uint first_body;
layout(location = 1) uniform uint copies;
layout(location = 2) uniform uint vertices_of_copy;

out vec3 world_position;
out vec3 local_position;
out vec3 local_normal;
out float extra;
flat out vec3 body_scale;
flat out vec4 body_rotation;
flat out uint body_colour;

vec3 rotate(vec4 q, vec3 v) {
  vec3 t = 2.0 * cross(q.yzw, v);
  return v + q.x * t + cross(q.yzw, t);
}

void main() {
  uint body = first_body + uint(gl_InstanceID) * copies + uint(gl_VertexID) / vertices_of_copy;
  Instance instance = instances[body];
  Pose pose = poses[instance.slot];
#if defined(CAPSULE)
  local_position = vertex_position * instance.scale.x + vec3(0, 0, vertex_extra * instance.scale.z);
#else
  local_position = vertex_position * instance.scale;
#endif
  world_position = rotate(pose.rotation, local_position) + pose.position.xyz;
  local_normal = vertex_normal;
  extra = vertex_extra;
  body_scale = instance.scale;
  body_rotation = pose.rotation;
  body_colour = colours[instance.slot];
  gl_Position = view_projection * vec4(world_position, 1.0);
}
