#include "terrain/found_triangles.hpp"

#include <algorithm>
#include <bit>

#include "terrain/triangle_contact.hpp"
#include "terrain/triangle_lanes.hpp"

namespace fathom {
namespace {

constexpr std::uint32_t no_corner = 0xffffffff;

Aabb box_of(const EightTriangles& eight) {
  const auto corner = [&](int k, int lane) {
    const auto& of = eight.corners[k];
    return Vec3{of.x[lane], of.y[lane], of.z[lane]};
  };
  Aabb box{corner(0, 0), corner(0, 0)};
  for (int lane = 0; lane < eight.count; ++lane)
    for (int k = 0; k < 3; ++k) box = merged(box, {corner(k, lane), corner(k, lane)});
  return box;
}

}  // namespace

bool FoundTriangles::rises(const SurfaceTriangle& t, unsigned tips, Vec3 axis) const {
  const SharedCorners shared(t, tips);
  const auto any_rises = [&](const EightTriangles& eight, unsigned beside) {
    for (int i = 1; i < shared.count; ++i) beside &= eight.having(shared.names[i]);
    for (; beside != 0; beside &= beside - 1)
      if (does_rise(t, eight.at(lowest_bit(beside)), shared, axis)) return true;
    return false;
  };
  if (eights_.size() < few)
    return std::ranges::any_of(
        eights_, [&](const EightTriangles& eight) { return any_rises(eight, eight.having(shared.names[0])); });
  index_corners();
  for (std::uint32_t corner = index_.first[chain_of(shared.names[0])]; corner != no_corner;
       corner = index_.next[corner]) {
    const EightTriangles& eight = eights_[corner / 24];
    const std::uint32_t lane = corner / 3 % 8;
    if (eight.names[corner % 3][lane] == shared.names[0] && any_rises(eight, 1u << lane)) return true;
  }
  return false;
}

// Corner k of the triangle in lane l of eight e has the number 24 e + 3 l + k.
void FoundTriangles::index_corners() const {
  if (has_corners_) return;
  has_corners_ = true;
  index_.first.assign(std::bit_ceil(16 * eights_.size()), no_corner);
  index_.next.resize(24 * eights_.size());
  for (std::size_t e = 0; e < eights_.size(); ++e)
    for (std::size_t corner = 24 * e; corner < 24 * e + 3 * static_cast<std::size_t>(eights_[e].count); ++corner) {
      std::uint32_t& first = index_.first[chain_of(eights_[e].names[corner % 3][corner / 3 % 8])];
      index_.next[corner] = first;
      first = static_cast<std::uint32_t>(corner);
    }
}

/// Multiplicative hashing (Knuth, "The Art of Computer Programming", volume 3, 6.4).
std::size_t FoundTriangles::chain_of(std::uint32_t name) const {
  return (name * 2654435769u) >> (33 - std::bit_width(index_.first.size()));
}

void FoundTriangles::index_boxes() const {
  if (has_boxes_) return;
  has_boxes_ = true;
  index_.boxes.clear(), index_.of_many.clear();
  for (const EightTriangles& eight : eights_) {
    const Aabb box = box_of(eight);
    if (index_.boxes.size() % eights_per_box == 0) index_.of_many.push_back(box);
    index_.boxes.push_back(box);
    index_.of_many.back() = merged(index_.of_many.back(), box);
  }
}

/// Whether any eight whose box meets `box` passes the test.
template <class Test>
bool FoundTriangles::any_eight_near(const Aabb& box, const Test& test) const {
  if (eights_.size() < few) return std::ranges::any_of(eights_, test);
  index_boxes();
  for (std::size_t many = 0; many < index_.of_many.size(); ++many) {
    if (!overlaps(index_.of_many[many], box)) continue;
    const std::size_t end = std::min((many + 1) * eights_per_box, eights_.size());
    for (std::size_t e = many * eights_per_box; e < end; ++e)
      if (overlaps(index_.boxes[e], box) && test(eights_[e])) return true;
  }
  return false;
}

bool FoundTriangles::is_nearer_elsewhere(Vec3 point, float depth, float tolerance) const {
  const float way = depth - tolerance;
  return way > 0 && any_eight_near(grown({point, point}, 1.001f * way), [&](const EightTriangles& triangles) {
           const PointByTriangles<EightLanes> p(make_lanes(triangles), point);
           return (bits(p.squares < eight(way * way)) & triangles.present()) != 0;
         });
}

bool FoundTriangles::is_inside(Vec3 point, float depth) const {
  Eight in_front = eight(3e38f), behind = eight(3e38f);  // squared distances (m²)
  for (const EightTriangles& triangles : eights_) {
    const PointByTriangles<EightLanes> p(make_lanes(triangles), point);
    const EightInts is_there = lane_numbers() < eight(triangles.count);
    const EightInts is_front = p.heights > eight(0.0f);
    in_front = select(is_there & is_front, min(p.squares, in_front), in_front);
    behind = select(is_there & ~is_front, min(p.squares, behind), behind);
  }
  const auto least = [](Eight values) { return min_lane(values, lane_numbers()).value; };
  const float nearest = least(behind);
  if (nearest < depth * depth || !is_behind(least(in_front), nearest)) return false;
  for (const EightTriangles& triangles : eights_) {
    const PointByTriangles<EightLanes> p(make_lanes(triangles), point);
    const unsigned is_nearest = bits(p.squares <= eight(nearest)) & triangles.present();
    if (is_nearest != 0) return continues_at(triangles.at(lowest_bit(is_nearest)), point);
  }
  return false;
}

bool FoundTriangles::continues_at(const SurfaceTriangle& t, Vec3 point) const {
  const unsigned tips = nearest_tips(t, point);
  if (tips == all_tips) return true;
  const SharedCorners shared(t, tips);
  std::uint32_t walk = 0;
  for (const EightTriangles& eight : eights_) {
    unsigned beside = eight.having(shared.names[0]);
    if (shared.count == 2) beside &= eight.having(shared.names[1]);
    for (; beside != 0; beside &= beside - 1) walk += walk_past(eight.at(lowest_bit(beside)).names, shared);
  }
  return walk == 0;
}

}  // namespace fathom
