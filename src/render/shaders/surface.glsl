// The surface of a body: rounded edges, quarters, grid, shadows. For the renderer and for the web page, after
// light.glsl. One of BOX, ROUND, CAPSULE, HULL, GROUND and TERRAIN is defined, and TAPS: samples of the shadow map
// along each axis, 0 for none.

vec3 rotate(vec4 q, vec3 v) {
  vec3 t = 2.0 * cross(q.yzw, v);
  return v + q.x * t + cross(q.yzw, t);
}

// Fraction of sunlight that reaches the point: comparisons with the shadow map, each interpolated.
float sunlight(vec3 position, vec3 normal) {
#if TAPS == 0
  return 1.0;
#else
  float texel = viewport.z;
  float slope = 1.0 - abs(dot(normal, look_sun_direction.xyz));
  vec3 p = (shadow_matrix * vec4(position + normal * texel * (1.0 + 2.4 * slope), 1.0)).xyz;
  if (any(lessThan(p.xy, vec2(0.002))) || any(greaterThan(p.xy, vec2(0.998)))) return 1.0;
  p.z = clamp(p.z, 0.0, 1.0);  // below or above everything that casts shadows
  vec2 apart = 1.0 / vec2(textureSize(shadow_map, 0));
  float sum = 0.0;
  for (int y = 0; y < TAPS; ++y)
    for (int x = 0; x < TAPS; ++x)
      sum += texture(shadow_map, vec3(p.xy + apart * (vec2(x, y) - 0.5 * float(TAPS - 1)), p.z));
  return sum / float(TAPS * TAPS);
#endif
}

// `colour` is sRGB; `scale` and `extra` are those of body.vert.glsl. Returns sRGB.
vec3 surface(vec4 colour, vec3 world_position, vec3 local_position, vec3 local_normal, float extra, vec3 scale,
             vec4 rotation) {
  vec3 albedo = to_linear(colour.rgb);
  vec3 n = normalize(local_normal);
  float gloss = 0.25;
  // Metres that a pixel covers: smaller details fade out.
  float footprint = max(length(dFdx(world_position)), length(dFdy(world_position)));
#if defined(BOX)
  float smallest = min(scale.x, min(scale.y, scale.z));
  float radius = 0.1 * smallest;
  vec3 inner = max(scale - radius, 0.0);
  // The normal of the box with rounded edges.
  vec3 rounded = local_position - clamp(local_position, -inner, inner);
  float detail = clamp(1.5 - footprint / radius, 0.0, 1.0);
  n = normalize(mix(n, normalize(rounded + 1e-6 * n), detail));
  vec3 to_face = scale - abs(local_position);
  // Of the three distances one is zero, that of the face itself; the middle one is the distance of the nearest edge.
  float nearest = max(min(to_face.x, to_face.y), min(max(to_face.x, to_face.y), to_face.z));
  float line = max(0.035 * smallest, footprint);
  float strength = clamp(0.35 * smallest / footprint, 0.0, 1.0);
  albedo *= 1.0 - 0.5 * strength * (1.0 - smoothstep(0.3 * line, 1.3 * line, nearest));
#elif defined(HULL)
  float line = max(0.02, footprint);
  albedo *= 1.0 - 0.45 * (1.0 - smoothstep(0.3 * line, 1.3 * line, extra));
#elif defined(GROUND) || defined(TERRAIN)
  gloss = 0.0;
#else
  // Quarters in two tones make the rotation of round bodies visible.
  vec3 quarter = step(0.0, local_position);
  albedo *= mix(0.72, 1.08, mod(quarter.x + quarter.y, 2.0));
#endif
  n = rotate(rotation, n);
#if defined(GROUND)
  if (n.z > 0.7) albedo = ground_albedo(world_position, n);
#elif defined(TERRAIN)
  albedo = ground_albedo(world_position, n);
#endif
  // Alpha below 1: asleep.
  float awake = step(0.99, colour.a);
  albedo = mix(vec3(dot(albedo, vec3(0.2126, 0.7152, 0.0722))) * 0.45, albedo, 0.35 + 0.65 * awake);
  return lit(albedo, world_position, n, gloss, sunlight(world_position, n));
}
