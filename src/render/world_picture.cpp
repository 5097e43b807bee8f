#include "render/world_picture.hpp"

#include <algorithm>

namespace fathom::render {
namespace {

constexpr float floor_half_width = 5.0f;  // m
constexpr int read_every = 30;            // updates, with poses on the device

/// Whether `wall` covers `inside` over its whole height: along x (axis 0) or y, on the lower or the upper side.
bool covers(const Aabb& wall, const Aabb& inside, int axis, bool upper) {
  const int across = 1 - axis;
  const bool is_beyond = upper ? wall.lower[axis] >= inside.upper[axis] : wall.upper[axis] <= inside.lower[axis];
  return is_beyond && wall.lower[across] <= inside.lower[across] && wall.upper[across] >= inside.upper[across] &&
         wall.lower.z <= inside.lower.z && wall.upper.z >= inside.upper.z;
}

}  // namespace

bool is_ground(const World& world, BodyId id) {
  if (world.motion(id) != MotionType::fixed) return false;
  const Shape& shape = world.shape(id);
  if (shape.is_surface()) return true;
  return shape.type == ShapeType::box && shape.half_extents.x >= floor_half_width &&
         shape.half_extents.y >= floor_half_width;
}

std::vector<BodyId> bin_walls(const World& world) {
  const Aabb bounds = moving_bounds(world);
  const Aabb inside = grown(bounds, -0.1f * min_component(half_extents(bounds)));  // some bodies lean against the walls
  std::vector<BodyId> walls;
  for (int side = 0; side < 4; ++side) {
    const std::size_t before = walls.size();
    for (const BodyId id : world.bodies())
      if (world.motion(id) == MotionType::fixed && !world.is_sensor(id) &&
          covers(world.bounds(id), inside, side / 2, side % 2 != 0))
        walls.push_back(id);
    if (walls.size() == before) return {};
  }
  return walls;
}

void WorldPicture::list_bodies(const World& world, Renderer& renderer) {
  bodies_.assign(world.bodies().begin(), world.bodies().end());
  std::vector<DrawnBody> drawn;
  drawn.reserve(bodies_.size());
  ground_height_.reset();
  const std::vector<BodyId> walls = bin_walls(world);
  for (const BodyId id : bodies_) {
    if (world.is_sensor(id) || std::ranges::find(walls, id) != walls.end()) continue;
    const bool ground = is_ground(world, id);
    drawn.push_back({id.index, world.shape(id), ground});
    if (ground && !world.shape(id).is_surface())
      ground_height_ = max(ground_height_.value_or(-1e30f), world.bounds(id).upper.z);
  }
  renderer.set_bodies(drawn);
}

void WorldPicture::update(const World& world, Renderer& renderer, Colouring colouring, bool exact) {
  const bool new_bodies = !std::ranges::equal(world.bodies(), bodies_);
  if (new_bodies) list_bodies(world, renderer);
  const auto on_device = world.device_poses();
  ++since_read_;
  const bool reads = exact || new_bodies || !on_device || since_read_ >= read_every || coloured_ != colouring ||
                     colouring != Colouring::start;
  if (reads) {
    renderer.set_colours(colours_.update(world, colouring));
    moving_ = moving_bounds(world);
    coloured_ = colouring;
    since_read_ = 0;
  }
  if (on_device)
    renderer.poses().write(*on_device);
  else
    renderer.poses().write(world.poses());
}

Aabb moving_bounds(const World& world) {
  std::vector<BodyId> shown;
  for (const BodyId id : world.bodies())
    if (world.motion(id) == MotionType::dynamic) shown.push_back(id);
  if (shown.empty()) {
    for (const BodyId id : world.bodies())
      if (!is_ground(world, id)) shown.push_back(id);
  }
  if (shown.empty()) return {{-5, -5, -1}, {5, 5, 4}};
  // Bounds without the outermost 1 % on each side of each axis.
  Aabb box{{1e30f, 1e30f, 1e30f}, {-1e30f, -1e30f, -1e30f}};
  float low[3], high[3];
  std::vector<float> values(shown.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::ranges::transform(shown, values.begin(), [&](BodyId id) { return world.poses()[id.index].position[axis]; });
    const std::size_t strays = values.size() / 100;
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(strays);
    std::nth_element(values.begin(), first, values.end());
    low[axis] = *first;
    const auto last = values.end() - 1 - static_cast<std::ptrdiff_t>(strays);
    std::nth_element(values.begin(), last, values.end());
    high[axis] = *last;
  }
  const Aabb middles = grown({{low[0], low[1], low[2]}, {high[0], high[1], high[2]}}, 1e-3f);
  for (const BodyId id : shown) {
    const Vec3 p = world.poses()[id.index].position;
    if (contains(middles, {p, p})) box = merged(box, world.bounds(id));
  }
  return box.lower.x <= box.upper.x ? box : middles;
}

}  // namespace fathom::render
