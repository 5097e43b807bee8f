#include "render/sensor_marks.hpp"

#include <cmath>
#include <fathom/compound.hpp>
#include <fathom/mesh.hpp>

namespace fathom::render {
namespace {

constexpr Colour empty_colour{80, 200, 220, 200}, entered_colour{120, 255, 140, 255};
constexpr int circle_parts = 24;

class Outline {
 public:
  Outline(std::vector<Mark>& marks, Colour colour) : marks_(marks), colour_(colour) {}

  void add(const Shape& shape, const Pose& pose) {
    switch (shape.type) {
      case ShapeType::sphere:
        return add_ball(pose, shape.radius, {});
      case ShapeType::capsule:
        add_ball(pose, shape.radius, shape.half_extents);
        return add_ball(pose, shape.radius, -shape.half_extents);
      case ShapeType::box:
        return add_box({-shape.half_extents, shape.half_extents}, pose);
      case ShapeType::hull:
        return add_hull(*shape.hull, pose);
      case ShapeType::mesh:
      case ShapeType::height_field:
        return add_box(shape.surface->bounds(), pose);
      case ShapeType::compound:
        for (const ChildShape& child : shape.compound->children()) add(child.shape, pose * child.pose);
    }
  }

 private:
  void add_line(const Pose& pose, Vec3 a, Vec3 b) {
    marks_.push_back({transform(pose, a), 1.5f, transform(pose, b), colour_});
  }

  void add_ball(const Pose& pose, float radius, Vec3 centre) {
    const Vec3 axes[] = {{radius, 0, 0}, {0, radius, 0}, {0, 0, radius}};
    for (int plane = 0; plane < 3; ++plane) {
      const auto point = [&](int part) {
        const float angle = 2 * pi * static_cast<float>(part) / circle_parts;
        return centre + std::cos(angle) * axes[plane] + std::sin(angle) * axes[(plane + 1) % 3];
      };
      for (int part = 0; part < circle_parts; ++part) add_line(pose, point(part), point(part + 1));
    }
  }

  void add_box(const Aabb& box, const Pose& pose) {
    const auto corner = [&box](int i) {
      return Vec3{i & 1 ? box.upper.x : box.lower.x, i & 2 ? box.upper.y : box.lower.y,
                  i & 4 ? box.upper.z : box.lower.z};
    };
    for (int a = 0; a < 8; ++a)
      for (int bit = 1; bit < 8; bit *= 2)
        if (!(a & bit)) add_line(pose, corner(a), corner(a | bit));
  }

  void add_hull(const Hull& hull, const Pose& pose) {
    const std::span<const Hull::HalfEdge> edges = hull.edges();
    for (std::size_t e = 0; e + 1 < edges.size(); e += 2)
      add_line(pose, hull.vertices()[edges[e].origin], hull.vertices()[edges[e + 1].origin]);
  }

  std::vector<Mark>& marks_;
  Colour colour_;
};

}  // namespace

void add_sensor_marks(const World& world, std::vector<Mark>& marks) {
  for (const BodyId id : world.bodies()) {
    if (!world.is_sensor(id)) continue;
    bool is_entered = false;
    world.for_each_in_sensor(id, [&](BodyId) { is_entered = true; });
    Outline(marks, is_entered ? entered_colour : empty_colour).add(world.shape(id), world.pose(id));
  }
}

}  // namespace fathom::render
