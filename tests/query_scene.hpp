// Random worlds to query, and tests of all their bodies one by one.
#pragma once

#include <cmath>
#include <fathom/world.hpp>
#include <vector>

#include "geometry/query.hpp"
#include "query_oracle.hpp"
#include "world_fixture.hpp"

namespace fathom {

inline bool operator==(const CastHit& a, const CastHit& b) {
  return a.body == b.body && a.fraction == b.fraction && a.point == b.point && a.normal == b.normal &&
         a.starts_inside == b.starts_inside;
}

namespace test {

/// A world of all shapes, fixed, kinematic and dynamic, of sizes from `least` to `most` (m).
class QueryScene {
 public:
  QueryScene(WorldDef def, unsigned seed, Vec3 middle, float extent, float least, float most, int count)
      : world(def), random(seed), centre(middle), spread(extent), smallest(least), largest(most) {
    for (int i = 0; i < count; ++i) add();
  }

  void add() {
    BodyDef def;
    def.shape = any_shape();
    def.motion = static_cast<MotionType>(random() % 3);
    def.pose = any_placement();
    def.mass = 1;
    def.filter.category = 1u << random() % 4;
    def.user_data = random() % 3;
    if (def.motion != MotionType::fixed) def.velocity.linear = in_cube(random);
    const BodyId id = world.add(def);
    categories.resize(std::max<std::size_t>(categories.size(), id.index + 1));
    categories[id.index] = def.filter.category;
  }
  void remove() { world.remove(any_body()); }
  BodyId any_body() { return world.bodies()[random() % world.body_count()]; }
  float any_size() { return smallest * std::pow(largest / smallest, uniform(random, 0, 1)); }
  Shape any_shape() { return shapes_of_each_kind(random, any_size())[random() % 4]; }
  Pose any_placement() { return {centre + spread * in_cube(random), 0, any_rotation(random)}; }
  /// Usually towards some body.
  Vec3 any_way(Vec3 from) {
    const Vec3 aim = random() % 4 ? world.pose(any_body()).position : centre + spread * in_cube(random);
    return uniform(random, 0.5f, 1.5f) * (aim + 0.2f * any_size() * in_cube(random) - from);
  }
  QueryFilter any_filter() {
    QueryFilter filter;
    if (random() % 3 == 0) filter.mask = random() % 16;
    if (random() % 3 == 0) filter.ignored = {any_body(), any_body()};
    if (random() % 3 == 0) filter.accepts = [this](BodyId id) { return world.user_data(id) != 1; };
    return filter;
  }

  bool passes(const QueryFilter& filter, BodyId id) const {
    return (categories[id.index] & filter.mask) != 0 && std::ranges::find(filter.ignored, id) == filter.ignored.end() &&
           (!filter.accepts || filter.accepts(id));
  }
  /// What `ask(geometry, pose)`, an optional `SurfaceHit`, finds for every body that passes the filter, nearest first.
  template <class Ask>
  std::vector<CastHit> each(const QueryFilter& filter, const Ask& ask) const {
    std::vector<CastHit> hits;
    for (const BodyId id : world.bodies()) {
      if (!passes(filter, id)) continue;
      const std::optional<SurfaceHit> hit = ask(geometry(world.shape(id)), world.pose(id));
      if (hit) hits.push_back({id, hit->fraction, hit->point, hit->normal, hit->starts_inside});
    }
    std::ranges::stable_sort(hits, {}, &CastHit::fraction);
    return hits;
  }
  /// Bodies that pass the filter and for which `ask(geometry, pose)` is true.
  template <class Ask>
  std::vector<BodyId> those(const QueryFilter& filter, const Ask& ask) const {
    std::vector<BodyId> ids;
    for (const BodyId id : world.bodies())
      if (passes(filter, id) && ask(geometry(world.shape(id)), world.pose(id))) ids.push_back(id);
    return ids;
  }

  World world;
  Generator random;
  Vec3 centre;
  float spread, smallest, largest;
  std::vector<std::uint64_t> categories;  // by index
};

}  // namespace test
}  // namespace fathom
