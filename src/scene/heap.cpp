#include "scene/heap.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>
#include <vector>

#include "scene/heap_bodies.hpp"

namespace fathom {
namespace {

constexpr std::size_t first_body = 5;  // after the floor and the walls

template <std::size_t n>
int one_of(Random& random, const int (&values)[n]) {
  return values[random.bits() % n];
}

HeapKind random_kind(Random& random) {
  constexpr HeapKind kinds[] = {HeapKind::bin,           HeapKind::bin,          HeapKind::bin,    HeapKind::bin,
                                HeapKind::slope,         HeapKind::slope,        HeapKind::stream, HeapKind::stream,
                                HeapKind::sliding_floor, HeapKind::turning_floor};
  return kinds[random.bits() % std::size(kinds)];
}

/// Chooses time step, substeps and sleeping.
void choose_world(Random& random, const Heap& heap, WorldDef& world) {
  int rate = one_of(random, {30, 60, 60, 120, 240});
  if (heap.time_unit > 2) rate = std::min(rate, 60);  // else one heap would take minutes
  world.dt = 1.0f / static_cast<float>(rate);
  world.solver.substeps = one_of(random, {2, 3, 4, 4, 6, 8});
  world.sleep.enabled = random.bits() % 2 == 0;
}

/// 30 to 300; fewer if the heap has many steps, or is so small that all bodies are within each other's margins.
int body_count(Random& random, const Heap& heap) {
  const double steps = 30 * heap.time_unit / static_cast<double>(heap.scene.world.dt);
  const double most = std::clamp(400'000 / steps, 30.0, heap.largest < 0.05 ? 80.0 : 300.0);
  return static_cast<int>(log_uniform(random, 30, most + 0.5));
}

/// Fills the space above the floor shelf by shelf, each body in a cube that fits it in any orientation, so that none
/// touch. Returns the height of the top.
double spread_out(std::vector<BodyDef>& bodies, double half_width, double bottom) {
  double x = -half_width, y = -half_width, z = bottom, row = 0, layer = 0;
  for (BodyDef& body : bodies) {
    const double cell = 2.05 * outer_radius(body.shape);
    if (x + cell > half_width) {
      x = -half_width;
      y += row;
      row = 0;
    }
    if (y + cell > half_width) {
      x = y = -half_width;
      z += layer;
      row = layer = 0;
    }
    body.pose.position = {static_cast<float>(x + 0.5 * cell), static_cast<float>(y + 0.5 * cell),
                          static_cast<float>(z + 0.5 * cell)};
    x += cell;
    row = std::max(row, cell);
    layer = std::max(layer, cell);
  }
  return z + layer;
}

/// Sorts bodies by ascending or descending size, or not at all.
void arrange(Random& random, std::vector<BodyDef>& bodies) {
  const auto volume_of = [](const BodyDef& body) { return outer_radius(body.shape); };
  const std::uint64_t order = random.bits() % 3;
  if (order == 0) return;
  std::ranges::stable_sort(bodies, {}, volume_of);
  if (order == 1) std::ranges::reverse(bodies);
}

BodyDef part(Vec3 half_extents, Vec3 position, const Material& material) {
  BodyDef def;
  def.motion = MotionType::fixed;
  def.shape = box(half_extents);
  def.pose.position = position;
  def.material = material;
  return def;
}

/// A slope of 2 to 25°, given by the tangents of half the angles about x and y.
Quat random_tilt(Random& random) {
  const double about_x = random.symmetric(0.15), about_y = random.symmetric(0.15) + 0.02;
  const double scale = 1 / std::sqrt(1 + about_x * about_x + about_y * about_y);
  return {static_cast<float>(scale), static_cast<float>(scale * about_x), static_cast<float>(scale * about_y), 0};
}

/// How far a plane through the origin with this tilt rises within the bin (m).
double highest_corner(Quat tilt, double half_width) {
  const Vec3 normal = abs(rotate(tilt, {0, 0, 1}));
  return half_width * static_cast<double>((normal.x + normal.y) / normal.z);
}

BodyDef floor(Random& random, const Heap& heap, Quat tilt, const Material& material) {
  // Wide enough that a sliding floor does not end; a slope is no wider than the bin, or it would hide the heap.
  const bool is_slope = heap.kind == HeapKind::slope;
  const float half_side = is_slope ? 1.2f * (heap.half_width + 2 * heap.floor_half_height) : 12 * heap.half_width;
  BodyDef def = part({half_side, half_side, heap.floor_half_height}, {}, material);
  def.pose.rotation = tilt;
  def.pose.position = rotate(tilt, {0, 0, -heap.floor_half_height});
  const double gravity = 9.81, width = static_cast<double>(heap.half_width);
  if (heap.kind == HeapKind::sliding_floor) {
    // It stays under the bin for the ten units of time in which it is judged.
    const double speed = std::min(0.5 * std::sqrt(gravity * width), width / heap.time_unit);
    def.motion = MotionType::kinematic;
    def.velocity.linear.x = static_cast<float>(random.symmetric(speed));
    def.velocity.linear.y = static_cast<float>(random.symmetric(speed));
  } else if (heap.kind == HeapKind::turning_floor) {
    def.motion = MotionType::kinematic;
    def.velocity.angular.z = static_cast<float>(random.symmetric(std::sqrt(0.5 * gravity / width)));
  }
  return def;
}

void add_bin(Random& random, Heap& heap, Quat tilt, bool is_smooth) {
  const Material material{is_smooth ? 0.0f : static_cast<float>(0.2 + 0.8 * random.unit()), 0};
  heap.scene.bodies.push_back(floor(random, heap, tilt, material));
  heap.scene.names.push_back({"floor", 0});
  const float inside = heap.half_width, half_wall = heap.floor_half_height;
  // Down to the lowest slope.
  const float bottom = -inside - 2 * half_wall;
  const float half_height = 0.5f * (heap.rim - bottom), z = 0.5f * (heap.rim + bottom), away = inside + half_wall;
  const float along = inside + 2 * half_wall;
  for (const float side : {-1.0f, 1.0f}) {
    heap.scene.bodies.push_back(part({half_wall, along, half_height}, {side * away, 0, z}, material));
    heap.scene.bodies.push_back(part({inside, half_wall, half_height}, {0, side * away, z}, material));
  }
}

/// Bodies stay for about four units of time and return above the bin, side by side: the previous one at the same
/// position has fallen clear by then.
Stream stream_from(const Heap& heap, const std::vector<BodyDef>& bodies, double top, double widest) {
  const double half_width = static_cast<double>(heap.half_width), dt = static_cast<double>(heap.scene.world.dt);
  const auto side = static_cast<std::size_t>(2 * half_width / widest), positions = side * side;
  const double stay = 4 * heap.time_unit / static_cast<double>(bodies.size());
  const double clear = 1.2 * std::sqrt(2 * widest / 9.81) / static_cast<double>(positions);
  Stream stream{static_cast<int>(std::ceil(std::max(stay, clear) / dt)), first_body, {}};
  const double cell = 2 * half_width / static_cast<double>(side);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    Pose source = bodies[i].pose;
    const double x = (static_cast<double>(i % side) + 0.5) * cell - half_width;
    const double y = (static_cast<double>(i % positions / side) + 0.5) * cell - half_width;
    source.position = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(top + 0.5 * widest)};
    stream.sources.push_back(source);
  }
  return stream;
}

}  // namespace

const char* name_of(HeapKind kind) {
  switch (kind) {
    case HeapKind::bin:
      return "bin";
    case HeapKind::slope:
      return "slope";
    case HeapKind::sliding_floor:
      return "sliding floor";
    case HeapKind::turning_floor:
      return "turning floor";
    case HeapKind::stream:
      break;
  }
  return "stream";
}

Heap make_heap(std::uint64_t seed) {
  Random random(seed);
  random.bits();  // neighbouring seeds begin alike
  Heap heap;
  heap.scene.name = "heap";
  heap.kind = random_kind(random);
  HeapRecipe recipe = HeapRecipe::make(random);
  heap.largest = recipe.largest;
  heap.size_ratio = recipe.size_ratio;
  heap.slenderness = recipe.slenderness;
  heap.density_ratio = recipe.density_ratio;
  heap.largest_restitution = recipe.restitution_high;
  heap.has_restitution = recipe.restitution_high > 0;
  heap.has_damping = recipe.damping > 0;
  heap.time_unit = std::sqrt(std::max(1.0, recipe.largest));
  recipe.damping /= heap.time_unit;
  choose_world(random, heap, heap.scene.world);

  std::vector<BodyDef> bodies(static_cast<std::size_t>(body_count(random, heap)));
  for (BodyDef& body : bodies) body = random_body(random, recipe);
  arrange(random, bodies);
  // About as many layers as suit a bin slightly higher than wide, with room for the largest body.
  double area = 0, widest = 0;
  for (const BodyDef& body : bodies) {
    const double cell = 2.05 * outer_radius(body.shape);
    area += cell * cell;
    widest = std::max(widest, cell);
  }
  const double layers = log_uniform(random, 2, 8);
  heap.half_width = static_cast<float>(0.5 * std::max(1.3 * widest, std::sqrt(area / layers)));
  heap.floor_half_height = static_cast<float>(widest);
  const double half_width = static_cast<double>(heap.half_width);
  const Quat tilt = heap.kind == HeapKind::slope ? random_tilt(random) : Quat{};
  const double rise = highest_corner(tilt, half_width), bottom = rise + 0.05 * widest;
  heap.lowest = static_cast<float>(-rise);
  const double top = spread_out(bodies, half_width, bottom);
  heap.rim = static_cast<float>(2 * top);

  add_bin(random, heap, tilt, recipe.friction_high <= 0);
  heap.scene.bodies.insert(heap.scene.bodies.end(), bodies.begin(), bodies.end());
  if (heap.kind == HeapKind::stream) heap.scene.stream = stream_from(heap, bodies, top, widest);
  return heap;
}

static std::string describe_surface(const Heap& heap) {
  if (!heap.surface) return {};
  char text[80];
  const bool is_mesh = heap.scene.bodies[heap.surface->body].shape.type == ShapeType::mesh;
  std::snprintf(text, sizeof text, " on a %s, cells %.2g and heights %.2g of the largest",
                is_mesh ? "mesh" : "height field", heap.surface->cell, heap.surface->height);
  return text;
}

std::string describe(const Heap& heap) {
  const WorldDef& world = heap.scene.world;
  const std::size_t bodies = heap.scene.bodies.size() - first_body - (heap.surface ? 1 : 0);
  const std::string joints =
      heap.scene.joints.empty() ? "" : ", " + std::to_string(heap.scene.joints.size()) + " joints";
  char text[300];
  std::snprintf(
      text, sizeof text,
      "%s%s, %zu bodies%s up to %.3g m, sizes 1:%g, slenderness %g, densities 1:%g, restitution %.2f, Δt 1/%ld s, "
      "%d substeps, sleeping %s",
      name_of(heap.kind), describe_surface(heap).c_str(), bodies, joints.c_str(), heap.largest, heap.size_ratio,
      heap.slenderness, heap.density_ratio, heap.largest_restitution, std::lround(1 / static_cast<double>(world.dt)),
      world.solver.substeps, world.sleep.enabled ? "on" : "off");
  return text;
}

}  // namespace fathom
