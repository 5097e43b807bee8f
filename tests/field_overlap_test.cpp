// Contacts of single bodies that overlap bumpy height fields, against the overlap in double precision: none is missing,
// few are much shallower, and none pushes a body much farther than it has sunk.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/mesh.hpp>
#include <fathom/world.hpp>
#include <optional>
#include <vector>

#include "random.hpp"
#include "validate/exact_surface.hpp"

namespace fathom::test::field_overlap_test {
namespace {

float log_uniform(Generator& random, float lo, float hi) {
  return lo * std::exp(uniform(random, 0, std::log(hi / lo)));
}

/// A field with the body over its middle; slopes up to 56°.
Shape bumpy_field(Generator& random, float size, Vec3& middle, float& amplitude) {
  const float cell_x = size * log_uniform(random, 0.3f, 5), cell_y = cell_x * log_uniform(random, 0.3f, 3);
  const auto samples = [&](float cell) { return 3 + 2 * static_cast<std::uint32_t>(std::ceil(2.2f * size / cell)); };
  const std::uint32_t columns = samples(cell_x), rows = samples(cell_y);
  amplitude = std::min(cell_x, cell_y) * uniform(random, 0, 1.5f);
  std::vector<float> heights;
  for (std::uint32_t i = 0; i < columns * rows; ++i) heights.push_back(amplitude * uniform(random, -0.5f, 0.5f));
  middle = {0.5f * cell_x * static_cast<float>(columns - 1), 0.5f * cell_y * static_cast<float>(rows - 1), 0};
  return height_field({columns, rows, cell_x, cell_y, heights});
}

Shape any_polyhedron(Generator& random, float size, float& half_thickness) {
  const float a = size * log_uniform(random, 0.15f, 1), b = size * log_uniform(random, 0.15f, 1);
  half_thickness = std::min(a, b);
  switch (random() % 3) {
    case 0:
      return box({size, a, b});
    case 1:
      return cylinder(half_thickness, size);
    default:
      half_thickness *= 0.3f;
      return cone(a, 2 * size, 0.5f * b);
  }
}

class FieldOverlap {
 public:
  explicit FieldOverlap(unsigned seed) : random_(seed) {
    size_ = log_uniform(random_, 0.02f, 2);
    Vec3 middle;
    float amplitude = 0;
    field_ = bumpy_field(random_, size_, middle, amplitude);
    shape_ = any_polyhedron(random_, size_, half_thickness_);
    for (std::uint32_t t = 0; t < field_.surface->triangle_count(); ++t)
      triangles_.emplace_back(field_.surface->triangle(t), Pose{});
    pose_ = {middle + size_ * Vec3{uniform(random_, -0.5f, 0.5f), uniform(random_, -0.5f, 0.5f), 0}, 0,
             any_rotation(random_)};
    sunk_ = half_thickness_ * log_uniform(random_, 0.03f, 0.35f);
    lower_until_it_touches(amplitude + 3 * size_);
    pose_.position.z -= sunk_;
    const validate::Ground ground(*field_.surface);
    const std::optional<double> height = ground.height_over({}, to_double(pose_.position));
    is_in_front_ = height && *height > static_cast<double>(0.05f * half_thickness_);
  }

  bool is_in_front() const { return is_in_front_; }  ///< or the engine may take it to come from below
  double depth() const { return depth_at(pose_); }
  double tolerance() const {
    return static_cast<double>(std::max({0.001f * size_, 0.01f * half_thickness_, 2e-5f})) + 1e-5;
  }

  struct Found {
    double depth = 0;   ///< m, of the deepest contact
    double raises = 0;  ///< m, farthest that a contact pushes beyond the body's first touch, along its normal
  };
  Found contacts_of(WorldDef def) const {
    def.gravity = {};
    World world(def);
    world.add({.motion = MotionType::fixed, .shape = field_});
    const BodyId id = world.add({.pose = pose_, .shape = shape_});
    world.step();
    Found found;
    world.for_each_contact([&](const ContactInfo& contact) {
      const float up = contact.a == id ? -contact.normal.z : contact.normal.z;
      for (int i = 0; i < contact.point_count; ++i) {
        const double depth = static_cast<double>(-contact.points[i].separation);
        found.depth = std::max(found.depth, depth);
        if (up > 0.05f) found.raises = std::max(found.raises, depth - static_cast<double>(sunk_ * up));
      }
    });
    return found;
  }

 private:
  double depth_at(const Pose& pose) const {
    const validate::Solid solid(shape_, pose);
    double depth = 0;
    for (const validate::Solid& triangle : triangles_) depth = std::max(depth, overlap_depth(triangle, solid));
    return depth;
  }
  void lower_until_it_touches(float from) {
    float above = from, below = -from;
    const auto touches = [&](float z) {
      Pose pose = pose_;
      pose.position.z = z;
      return depth_at(pose) > 0;
    };
    const float step = std::max(0.15f * half_thickness_, 0.01f * size_);
    for (below = above - step; below > -from && !touches(below); below -= step) above = below;
    for (int halving = 0; halving < 20; ++halving) {
      const float middle = 0.5f * (above + below);
      (touches(middle) ? below : above) = middle;
    }
    pose_.position.z = above;
  }

  Generator random_;
  float size_ = 0, half_thickness_ = 0, sunk_ = 0;  // m
  Shape field_, shape_;
  Pose pose_;
  std::vector<validate::Solid> triangles_;
  bool is_in_front_ = false;
};

WorldDef native() {
  WorldDef def;
  def.threads = 1;
  return def;
}
WorldDef device() {
  WorldDef def = native();
  def.simulator = SimulatorKind::device;
  def.device = "host";
  return def;
}

TEST(FieldOverlap, HasAContactAsDeepAsTheBodyHasSunk) {
  struct Result {
    WorldDef def;
    int shallow = 0, deep = 0;
  };
  Result results[] = {{native()}, {device()}};
  int tried = 0;
  for (unsigned seed = 0; seed < 2000; ++seed) {
    const FieldOverlap overlap(seed);
    if (!overlap.is_in_front()) continue;
    ++tried;
    const double depth = overlap.depth(), tolerance = overlap.tolerance();
    for (Result& result : results) {
      const FieldOverlap::Found found = overlap.contacts_of(result.def);
      EXPECT_TRUE(found.depth > 0 || depth < 2 * tolerance) << "seed " << seed << ", " << depth << " m deep";
      result.shallow += found.depth < 0.7 * depth - tolerance;
      result.deep += found.raises > 0.3 * depth + 2 * tolerance;
    }
  }
  EXPECT_GT(tried, 1500);
  for (const Result& result : results) {
    EXPECT_LT(result.shallow, 10);
    EXPECT_LT(result.deep, 5);
  }
}

}  // namespace
}  // namespace fathom::test::field_overlap_test
