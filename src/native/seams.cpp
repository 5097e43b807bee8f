#include "native/seams.hpp"

#include <algorithm>
#include <span>
#include <vector>

#include "dynamics/drift.hpp"
#include "geometry/compound_query.hpp"
#include "terrain/surface_seam.hpp"

namespace fathom::native {

/// What lies beside the touched piece at one moment, in its frame.
struct SeamMoment {
  std::vector<NeighbourSolid> solids;
  std::vector<NeighbourTriangle> triangles;
  std::vector<std::uint32_t> found;

  void clear() {
    solids.clear();
    triangles.clear();
  }
  bool empty() const { return solids.empty() && triangles.empty(); }
  template <class Act>
  bool any(const Act& act) const {
    return std::ranges::any_of(solids, act) || std::ranges::any_of(triangles, act);
  }
};

struct SeamNeighbours {
  SeamMoment begin, end;  ///< of the step; `end` counts only if some move against the piece
  bool any_moves = false;

  void clear() {
    begin.clear();
    any_moves = false;
  }
  int moments() const { return any_moves ? 2 : 1; }
  const SeamMoment& at(int moment) const { return moment == 0 ? begin : end; }
};

namespace {

/// Adds all pieces of the body at `body_in_a` that the box in A's frame meets, except the child `without`.
void add_pieces(const BodyInfo& body, const Pose& body_in_a, const Aabb& box, const Filter& touching, float depth,
                std::uint32_t without, SeamMoment& neighbours) {
  if (has_faces(body.geometry)) return neighbours.solids.push_back({body.geometry, body_in_a});
  if (!body.geometry.is_compound() && !body.geometry.is_surface()) return;
  const Aabb near = bounds(box, inverse(body_in_a));
  std::vector<std::uint32_t>& found = neighbours.found;
  found.clear();
  if (body.geometry.is_surface()) {
    body.geometry.surface().find(near, found);
    for (const std::uint32_t number : found) {
      Triangle triangle = body.geometry.surface().triangle(number);
      for (Vec3& corner : triangle.corners) corner = transform(body_in_a, corner);
      neighbours.triangles.push_back({SurfaceTriangle(triangle, {}), depth});
    }
    return;
  }
  find_children(body.geometry.compound(), near, found);
  for (const std::uint32_t child : found) {
    const Piece piece = piece_of(body, child);
    if (child != without && has_faces(piece.geometry) && may_collide(piece.filter, touching))
      neighbours.solids.push_back({piece.geometry, body_in_a * piece.pose});
  }
}

/// Normals of the surface's triangles in the box.
std::span<const Vec3> normals_in(const Surface& surface, const Aabb& box) {
  thread_local std::vector<std::uint32_t> found;
  thread_local std::vector<Vec3> normals;
  found.clear();
  surface.find(box, found);
  normals.clear();
  for (const std::uint32_t number : found) normals.push_back(SurfaceTriangle(surface.triangle(number), {}).normal);
  return normals;
}

}  // namespace

void Seams::find(const FixedTree& fixed, ThreadPool& pool) {
  const std::span<const std::uint32_t> kinematic = bodies_.kinematic();
  fixed_ = &fixed;
  several_ = fixed.size() + kinematic.size() > 1;
  if (!several_ || (kinematic.empty() && listed_.empty())) return;
  const bool is_listed = std::ranges::equal(listed_, kinematic);
  if (is_listed) kinematic_.refit(state_.bounds.data(), pool);
  if (is_listed && !kinematic_.is_loose()) return;
  listed_.assign(kinematic.begin(), kinematic.end());
  kinematic_.build(listed_, state_.bounds.data(), pool);
}

/// Whether the application may decide that the two bodies do not collide.
bool Seams::is_asked_about(std::uint32_t a, std::uint32_t b) const {
  const BodyInfo &of_a = bodies_[a], &of_b = bodies_[b];
  return of_a.pre_solve || of_b.pre_solve || of_a.custom_filter || of_b.custom_filter;
}

/// Whether the neighbour certainly collides with the body.
bool Seams::may_rest_on(std::uint32_t slot, std::uint32_t neighbour) const {
  const BodyInfo &body = bodies_[slot], &other = bodies_[neighbour];
  return !is_asked_about(slot, neighbour) && may_collide(body, other) && !joints_.keeps_apart(neighbour, slot) &&
         !excluded_.contains(neighbour, slot);
}

SeamManifold Seams::kept(const SeamSide& a, const SeamSide& b, const Pose& b_in_a, float margin,
                         const Manifold& m) const {
  const SeamManifold of_a = kept_of_first(a, b, b_in_a, margin, m);
  if (of_a.manifold.count == 0 || !b.piece.is_child) return of_a;
  const Pose a_in_b = inverse(b_in_a);
  const SeamManifold of_b = kept_of_first(b, a, a_in_b, margin, swapped(of_a.manifold, a_in_b));
  return {swapped(of_b.manifold, b_in_a), of_a.has_neighbours || of_b.has_neighbours, of_a.is_whole && of_b.is_whole};
}

SeamManifold Seams::kept_of_first(const SeamSide& a, const SeamSide& b, const Pose& b_in_a, float margin,
                                  const Manifold& m) const {
  const bool has_others = may_have(a.slot), has_siblings = a.piece.is_child && !is_asked_about(a.slot, b.slot);
  if (!(has_others || has_siblings) || a.piece.geometry.is_surface()) return {m};
  const Pose body_pose = state_.poses[a.slot], pose = a.piece.is_child ? body_pose * a.piece.pose : body_pose;
  const bool is_pushed = bodies_[a.slot].motion == MotionType::dynamic;
  const float half = is_pushed ? min(a.piece.half, b.piece.half) : b.piece.half;
  SeamLengths lengths = make_seam_lengths(b.piece.half, a.piece.radius, b.piece.radius, b_in_a, pose);
  if (is_pushed) lengths.limit_depth(a.piece.half);
  if (!may_be_at_seam(a.piece.geometry, m, lengths)) return {m};

  thread_local SeamNeighbours neighbours;
  neighbours.clear();
  const Aabb box = grown(bounds(b.piece.geometry, b_in_a), lengths.edge);
  if (has_siblings)
    add_pieces(bodies_[a.slot], inverse(a.piece.pose), box, b.piece.filter, b.piece.half, a.child, neighbours.begin);
  if (has_others) add_others(a, pose, b, box, neighbours);
  if (neighbours.begin.empty()) return {m};
  return kept_at_seam(a.piece.geometry, b.piece.geometry, b_in_a, margin, half, neighbours, lengths, m);
}

Manifold Seams::kept_on_surface(const SeamSide& a, const SeamSide& b, const Pose& b_in_a, const Manifold& m) const {
  if (!may_have(a.slot)) return m;
  const Pose& pose = state_.poses[a.slot];
  const SeamLengths lengths = make_seam_lengths(b.piece.half, max_component(abs(pose.position)));
  thread_local SeamNeighbours neighbours;
  neighbours.clear();
  const Aabb box = around_patch(m, lengths.edge + b.piece.half);
  add_others(a, pose, b, box, neighbours);
  if (neighbours.begin.empty()) return m;
  const std::span<const Vec3> normals = normals_in(a.piece.geometry.surface(), around_patch(m, lengths.step));
  const auto any_normal = [&](const Aabb&, const auto& act) { return std::ranges::any_of(normals, act); };
  return kept_beside(neighbours, any_normal, lengths, b.piece.geometry, b_in_a, m);
}

/// Adds other bodies that cannot be pushed, meet the box (in the frame of A's piece, which has this pose) and collide
/// with B.
void Seams::add_others(const SeamSide& a, const Pose& pose, const SeamSide& b, const Aabb& box,
                       SeamNeighbours& neighbours) const {
  if (!listed_.empty()) return add_others_that_may_move(a, pose, b, box, neighbours);
  thread_local std::vector<std::uint32_t> slots;
  slots.clear();
  fixed_->overlap(bounds(box, pose), slots);
  for (const std::uint32_t other : slots)
    if (other != a.slot && may_rest_on(b.slot, other))
      add_pieces(bodies_[other], relative(pose, state_.poses[other]), box, b.piece.filter, b.piece.half, none,
                 neighbours.begin);
}

/// The same where there are kinematic bodies.
void Seams::add_others_that_may_move(const SeamSide& a, const Pose& pose, const SeamSide& b, const Aabb& box,
                                     SeamNeighbours& neighbours) const {
  thread_local std::vector<std::uint32_t> slots;
  slots.clear();
  const Pose end = end_of(a.slot) * a.piece.pose;
  const Aabb in_world = bounds_of_way(box, pose, end);
  fixed_->overlap(in_world, slots);
  kinematic_.overlap(in_world, slots);
  std::erase_if(slots, [&](std::uint32_t other) { return other == a.slot || !may_rest_on(b.slot, other); });
  const auto moves = [&](std::uint32_t other) {
    return !stay_together(state_.velocities[a.slot], state_.velocities[other]);
  };
  neighbours.any_moves = std::ranges::any_of(slots, moves);
  if (neighbours.any_moves) neighbours.end = neighbours.begin;
  const auto add = [&](std::uint32_t other, const Pose& in_a, SeamMoment& moment) {
    add_pieces(bodies_[other], in_a, box, b.piece.filter, b.piece.half, none, moment);
  };
  for (const std::uint32_t other : slots) {
    const Pose in_a = relative(pose, state_.poses[other]);
    add(other, in_a, neighbours.begin);
    if (neighbours.any_moves) add(other, moves(other) ? relative(end, end_of(other)) : in_a, neighbours.end);
  }
}

Pose Seams::end_of(std::uint32_t slot) const { return advanced(state_.poses[slot], state_.velocities[slot], dt_); }

}  // namespace fathom::native
