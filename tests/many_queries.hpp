// Worlds and filters for tests of many queries at once.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "device/tuning.hpp"
#include "query_scene.hpp"
#include "shape_fixture.hpp"
#include "test_compounds.hpp"

namespace fathom::test {

/// All of it, bit for bit.
inline bool same(const std::optional<CastHit>& a, const std::optional<CastHit>& b) {
  if (!a || !b) return a.has_value() == b.has_value();
  return *a == *b && a->triangle == b->triangle && a->child == b->child;
}

/// A prism of 250 corners, near the largest that hulls may be.
inline Shape prism_of_250(float size) { return cylinder_hull(size, 0.6f * size, 125); }

/// Bodies of all shapes and motions, as sensors too, in all groups.
class ManyScene {
 public:
  ManyScene(SimulatorKind kind, unsigned seed, int ahead = 0, int count = 120)
      : ManyScene(definition(kind, ahead), seed, count) {}
  ManyScene(const WorldDef& def, unsigned seed, int count = 120) : world(def), random(seed) {
    for (int i = 0; i < count; ++i) add();
  }

  static WorldDef definition(SimulatorKind kind, int ahead = 0) {
    WorldDef def;
    def.simulator = kind;
    def.device = test_device();
    def.threads = 2;
    def.ahead = ahead;
    return def;
  }

  /// One of the shapes that may also be asked with.
  Shape any_convex(float size) {
    const auto kind = random() % 9;
    if (kind < 4) return shapes_of(size)[kind];
    if (kind == 4) return cylinder(size, 0.4f * size, 7);
    if (kind == 5) return cone(size, size, 0.3f * size, 9);
    if (kind == 6) return rounded(box({size, 0.8f * size, 0.6f * size}), 0.2f * size);
    if (kind == 7) return rounded(cylinder(size, 0.7f * size, 6), 0.3f * size);
    return prism_of_250(size);
  }
  void add() {
    BodyDef def;
    const auto kind = random() % 12;
    if (kind == 0)
      def.shape = wavy_mesh(12, uniform(random, 1, 5));
    else if (kind == 1)
      def.shape = wavy_field(11, uniform(random, 1, 5), {3, 17, 18, 44});
    else if (kind < 4)
      def.shape = random_compound(random, uniform(random, 0.2f, 1));
    else
      def.shape = any_convex(uniform(random, 0.05f, 1.5f));
    const bool is_surface = def.shape.is_surface();
    def.motion = is_surface ? static_cast<MotionType>(random() % 2) : static_cast<MotionType>(random() % 3);
    def.pose = any_pose();
    def.mass = 1;
    def.sensor = !is_surface && random() % 8 == 0;
    def.filter.category = 1u << random() % 4;
    def.filter.mask = random() % 4 ? ~std::uint64_t{0} : random() % 16;
    def.filter.group = static_cast<std::int32_t>(random() % 5) - 2;
    if (def.motion != MotionType::fixed) def.velocity.linear = in_cube(random);
    world.add(def);
  }
  void change(int what) {
    const BodyId id = any_body();
    if (what == 0) world.remove(id);
    if (what == 1) world.set_pose(id, any_pose());
    if (what == 2) world.set_filter(id, {1u << random() % 4, ~std::uint64_t{0}, 0});
    if (what == 3) add();
    if (what == 4) world.step();
  }

  BodyId any_body() { return world.bodies()[random() % world.body_count()]; }
  Pose any_pose() { return {9.0f * in_cube(random), 0, any_rotation(random)}; }
  Ray any_ray() {
    const Vec3 from = 12.0f * in_cube(random);
    Vec3 way = random() % 2 ? world.pose(any_body()).position - from : 9.0f * in_cube(random);
    if (random() % 8 == 0) way.x = 0;
    if (random() % 8 == 0 || way == Vec3{}) way = {0, 0, -20};
    return {from, way};
  }
  QueryFilter any_filter() {
    QueryFilter filter;
    if (random() % 3 == 0) filter.mask = random() % 16;
    if (random() % 3 == 0) filter.category = 1 + random() % 15;
    if (random() % 3 == 0) filter.group = static_cast<std::int32_t>(random() % 5) - 2;
    if (random() % 2 == 0)
      for (auto n = random() % 9; n > 0; --n) filter.ignored.push_back(any_body());
    filter.sensors = random() % 2;
    if (random() % 6 == 0) filter.accepts = [](BodyId id) { return id.index % 3 != 0; };
    return filter;
  }

  World world;
  Generator random;
};

inline constexpr SimulatorKind all_simulators[] = {SimulatorKind::native, SimulatorKind::device, SimulatorKind::hybrid};
inline std::string name_of(const testing::TestParamInfo<SimulatorKind>& kind) {
  return kind.param == SimulatorKind::native ? "native" : kind.param == SimulatorKind::device ? "device" : "hybrid";
}

}  // namespace fathom::test
