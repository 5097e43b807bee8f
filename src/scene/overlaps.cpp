#include "scene/overlaps.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "collision/collide.hpp"
#include "geometry/geometry.hpp"
#include "geometry/support.hpp"
#include "terrain/surface_contact.hpp"
#include "world/filter.hpp"

namespace fathom {
namespace {

struct Placed {
  std::uint32_t body;  // in Scene::bodies
  Filter filter;
  Geometry geometry;
  Pose pose;
  Aabb box;
  bool is_dynamic;
};

bool may_touch(const Placed& a, const Placed& b) {
  return (a.is_dynamic || b.is_dynamic) && may_collide(a.filter, b.filter);
}

double overlap_with_surface(const Placed& surface, const Placed& b) {
  SurfaceScratch scratch;
  SurfaceContact contact;
  collide_surface(surface.geometry.surface(), b.geometry, relative(surface.pose, b.pose), 0, {}, scratch, contact);
  float deepest = 0;
  for (int k = 0; k < contact.count; ++k)
    for (int i = 0; i < contact.manifolds[k].count; ++i)
      deepest = max(deepest, -contact.manifolds[k].points[i].separation);
  return static_cast<double>(deepest);
}

double overlap_of(const Placed& a, const Placed& b) {
  if (a.geometry.is_compound()) {
    double deepest = 0;
    for (const ChildShape& child : a.geometry.compound().children()) {
      Placed piece = a;
      piece.geometry = geometry(child.shape);
      piece.pose = a.pose * child.pose;
      deepest = std::max(deepest, overlap_of(piece, b));
    }
    return deepest;
  }
  if (b.geometry.is_compound()) return overlap_of(b, a);
  if (a.geometry.is_surface()) return overlap_with_surface(a, b);
  if (b.geometry.is_surface()) return overlap_with_surface(b, a);
  AxisCache axis;
  const Manifold manifold = collide_shapes(a.geometry, b.geometry, relative(a.pose, b.pose), 0, axis);
  float deepest = 0;
  for (int i = 0; i < manifold.count; ++i) deepest = max(deepest, -manifold.points[i].separation);
  return static_cast<double>(deepest);
}

using Pair = std::pair<std::uint32_t, std::uint32_t>;

Pair ordered(std::size_t a, std::size_t b) {
  return {static_cast<std::uint32_t>(std::min(a, b)), static_cast<std::uint32_t>(std::max(a, b))};
}

/// Pairs that may not collide, by joints or exclusion, ascending.
std::vector<Pair> kept_apart(const Scene& scene) {
  std::vector<Pair> pairs;
  for (const SceneJoint& joint : scene.joints)
    if (!joint.def.collide_connected) pairs.push_back(ordered(joint.a, joint.b));
  for (const auto& [a, b] : scene.excluded) pairs.push_back(ordered(a, b));
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

/// Bodies by grid cell. Bodies larger than a cell are in none; they are not dynamic, so no two of them are tested.
class Grid {
 public:
  Grid(const std::vector<Placed>& bodies, float cell) : bodies_(bodies), cell_(cell) {
    for (std::uint32_t i = 0; i < bodies.size(); ++i) {
      const Vec3 size = bodies[i].box.upper - bodies[i].box.lower;
      if (max_component(size) > cell)
        large_.push_back(i);
      else
        entries_.push_back({key(at(bodies[i].box.lower)), i});
    }
    std::sort(entries_.begin(), entries_.end());
  }

  double deepest(const std::vector<Pair>& apart) const {
    double deepest = 0;
    const auto look_at = [&](std::uint32_t i, std::uint32_t k) {
      const Placed &a = bodies_[i], &b = bodies_[k];
      if (!may_touch(a, b) || !overlaps(a.box, b.box)) return;
      if (std::binary_search(apart.begin(), apart.end(), ordered(a.body, b.body))) return;
      deepest = std::max(deepest, overlap_of(a, b));
    };
    for (const std::uint32_t large : large_)
      for (const Entry& entry : entries_) look_at(large, entry.body);
    for (const Entry& entry : entries_) {
      const Cell own = at(bodies_[entry.body].box.lower);
      for (int n = 0; n < 27; ++n) {
        const std::uint64_t neighbour = key({own.x + n % 3 - 1, own.y + n / 3 % 3 - 1, own.z + n / 9 - 1});
        auto other = std::lower_bound(entries_.begin(), entries_.end(), Entry{neighbour, 0});
        for (; other != entries_.end() && other->key == neighbour; ++other)
          if (other->body > entry.body) look_at(entry.body, other->body);
      }
    }
    return deepest;
  }

 private:
  struct Cell {
    std::int64_t x, y, z;
  };
  struct Entry {
    std::uint64_t key;
    std::uint32_t body;
    auto operator<=>(const Entry&) const = default;
  };

  Cell at(Vec3 p) const {
    const auto number = [&](float x) {
      return static_cast<std::int64_t>(std::floor(std::clamp(x / cell_, -1e6f, 1e6f)));
    };
    return {number(p.x), number(p.y), number(p.z)};
  }
  static std::uint64_t key(const Cell& c) {
    constexpr std::int64_t most = (1 << 21) - 1, middle = 1 << 20;
    const auto part = [](std::int64_t x) { return static_cast<std::uint64_t>((x + middle) & most); };
    return part(c.x) << 42 | part(c.y) << 21 | part(c.z);
  }

  const std::vector<Placed>& bodies_;
  float cell_;
  std::vector<Entry> entries_;
  std::vector<std::uint32_t> large_;
};

}  // namespace

double deepest_overlap(const Scene& scene, std::span<const Pose> poses) {
  const std::vector<BodyDef>& bodies = scene.bodies;
  std::vector<Placed> placed;
  float cell = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (!is_finite(poses[i]) || bodies[i].sensor) continue;
    const bool is_dynamic = bodies[i].motion == MotionType::dynamic;
    const Geometry shape = fathom::geometry(bodies[i].shape);
    const Aabb box = bounds(shape, poses[i]);
    placed.push_back({static_cast<std::uint32_t>(i), bodies[i].filter, shape, poses[i], box, is_dynamic});
    if (is_dynamic) cell = max(cell, max_component(box.upper - box.lower));
  }
  return cell > 0 ? Grid(placed, cell).deepest(kept_apart(scene)) : 0;
}

}  // namespace fathom
