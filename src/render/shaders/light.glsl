// Light, air and water, for the renderer and for the web page. Colours are linear here. The look_ values are those of
// look.hpp. WATER is defined under water; software renderers would execute both sides of a branch.

// sRGB's curves to within 0.3 % without powers (Chilliant, "sRGB approximations for HLSL", 2012).
vec3 to_linear(vec3 c) { return c * (c * (c * 0.305306011 + 0.682171111) + 0.012522878); }

vec3 to_srgb(vec3 c) {
  vec3 a = sqrt(clamp(c, 0.0, 1.0)), b = sqrt(a), d = sqrt(b);
  return 0.662002687 * a + 0.684122060 * b - 0.323583601 * d - 0.0225411470 * c;
}

// A shoulder for values brighter than white (Narkowicz 2016, fitted to the ACES curve).
vec3 tone(vec3 c) { return (c * (2.51 * c + 0.03)) / (c * (2.43 * c + 0.59) + 0.14); }

vec3 background(vec3 direction) {
  return mix(look_horizon.rgb, direction.z > 0.0 ? look_zenith.rgb : look_nadir.rgb, sqrt(abs(direction.z)));
}

// The fraction of light that passes through air or water over a distance, by channel.
vec3 transmission(float way) { return exp(-way * look_extinction.rgb); }

// Light from the sky and from the ground, by the height of the normal.
vec3 ambient(vec3 normal) {
  return mix(look_ambient_down.rgb, look_ambient_up.rgb, 0.5 + 0.5 * normal.z);
}

// Caustics: light that surface waves focus on objects under water, as a product of two wave patterns.
float caustics(vec3 p, float time) {
  vec2 q = p.xy * 0.9;
  float a = sin(q.x + 0.7 * sin(q.y * 1.3 + time)) + sin(q.y * 1.1 + 0.8 * sin(q.x * 0.9 - 0.8 * time));
  float b = sin(0.8 * (q.x + q.y) + 0.9 * sin(q.x - 1.2 * q.y + 0.6 * time));
  float c = 1.0 - abs(0.4 * a + 0.35 * b);
  c = clamp(c, 0.0, 1.0);
  return (c * c) * (c * c);
}

// Colour of a lit surface as seen from the eye, in sRGB.
vec3 lit(vec3 albedo, vec3 position, vec3 normal, float gloss, float sunlit) {
  vec3 to_eye = eye.xyz - position;
  float range = length(to_eye);
  vec3 view = to_eye / range;
  vec3 sun = look_sun_direction.xyz;
  vec3 sun_colour = look_sun_colour.rgb;
#if defined(WATER)
  // Sunlight is attenuated by the water above.
  sun_colour *= transmission(max(look_water.x - position.z, 0.0)) * (0.7 + 1.6 * caustics(position, look_water.y));
#endif
  float facing = max(dot(normal, sun), 0.0);
  vec3 halfway = normalize(sun + view);
  float h = max(dot(normal, halfway), 0.0);
  h *= h, h *= h, h *= h, h *= h, h = h * h * h;  // to the power of 48
  float highlight = gloss * h * facing;
  float r = 1.0 - max(dot(normal, view), 0.0);
  float rim = gloss * 0.5 * (r * r) * (r * r);
  vec3 colour = albedo * (sun_colour * (facing * sunlit) + ambient(normal));
  colour += sun_colour * (highlight * sunlit) + look_horizon.rgb * rim;
  vec3 through = transmission(range);
  vec3 air = background(-view);
  return to_srgb(tone(colour * through + air * (1.0 - through)));
}

// Lines of a grid, averaged over the pixel's footprint (Quilez, "Filterable procedurals", 2018). `share` is the
// fraction of the spacing covered by a line.
float grid_lines(vec2 p, float spacing, float share) {
  vec2 q = p / spacing + 0.5 * share;
  vec2 w = max(abs(dFdx(q)), abs(dFdy(q))) + 1e-4;
  vec2 a = q + 0.5 * w, b = q - 0.5 * w;
  vec2 covered = (floor(a) + min(fract(a) / share, 1.0) - floor(b) - min(fract(b) / share, 1.0)) * share / w;
  return 1.0 - (1.0 - covered.x) * (1.0 - covered.y);
}

vec3 ground_albedo(vec3 position, vec3 normal) {
  vec3 base = look_ground.rgb;
  float fine = grid_lines(position.xy, 1.0, 0.03), coarse = grid_lines(position.xy, 10.0, 0.008);
  float far = 1.0 - smoothstep(30.0, 90.0, length(eye.xyz - position));
  float lines = max(0.55 * fine * far, 0.85 * coarse);
  return mix(base, look_ground_line.rgb, lines * step(0.7, normal.z));
}
