// Pairs that may touch in several parts, each with a contact of its own: one per contact direction and material with a
// surface (terrain/), one per pair of children with a compound, one per combination with both. Parts are matched with
// those of the last step by children or materials, and those of surfaces also by normal.
#include <algorithm>
#include <tuple>

#include "check/check.hpp"
#include "collision/collide.hpp"
#include "dynamics/manifold_update.hpp"
#include "dynamics/surface_ahead.hpp"
#include "geometry/compound_query.hpp"
#include "native/native_simulator.hpp"
#include "native/pieces.hpp"
#include "native/quick_bounds.hpp"
#include "native/tuning.hpp"

namespace fathom::native {

namespace {

/// A contact of the pair.
struct Part {
  std::uint32_t index;
  Children children;
  bool touches;
  bool is_matched = false;

  auto key() const { return std::tuple(children.a, children.b, !touches); }
};

/// A part found between two pieces.
struct FoundPart {
  Children children;
  float ahead;  ///< see NewManifold
  Pose b_in_a;  ///< of the bodies
  Manifold manifold;
  AxisCache axis;
};

/// A piece of A with what it needs to be tried against many pieces of B.
struct PieceOfA {
  Piece piece;
  Aabb box;  ///< in A's frame
  Mover mover;
};

/// Scratch memory, reused from pair to pair.
struct PairScratch {
  /// Which of `pieces` a child of A is, if it was needed in this pair.
  struct Known {
    std::uint64_t pair;
    std::uint32_t piece;
  };
  std::vector<PieceOfA> pieces;
  std::vector<Known> known;  ///< by child of A
  std::uint64_t pair = 0;

  std::vector<Part> parts;  ///< sorted by children, touching ones first
  std::vector<FoundPart> found;
  std::vector<Part*> matches;  ///< matching part of each found one, or null
  std::vector<std::uint32_t> children_a, children_b;
  std::vector<SurfacePush> pushes;
  SurfaceScratch surface;
};

/// The manifold in the frame in which its own frame has the pose `pose`.
Manifold moved(Manifold m, const Pose& pose) {
  m.normal = rotate(pose.rotation, m.normal);
  for (int i = 0; i < m.count; ++i) m.points[i].position = transform(pose, m.points[i].position);
  return m;
}

}  // namespace

/// One pair during its update. The thread that has its first contact handles all its contacts.
class PartedPair {
 public:
  PartedPair(std::uint32_t first, const NarrowPhase& narrow_phase, PairScratch& scratch)
      : first_(first),
        narrow_phase_(narrow_phase),
        scratch_(scratch),
        a_(narrow_phase.bodies[narrow_phase.graph[first].a]),
        b_(narrow_phase.bodies[narrow_phase.graph[first].b]) {
    scratch_.parts.clear();
    scratch_.found.clear();
    scratch_.pieces.clear();
    ++scratch_.pair;
    const ContactGraph& graph = narrow_phase.graph;
    graph.for_each_in_ring(first, [&](std::uint32_t index) {
      scratch_.parts.push_back({index, graph.children(index), graph[index].touching()});
    });
    std::ranges::stable_sort(scratch_.parts, {}, &Part::key);
  }

  Change update() {
    const std::uint32_t touching = any_touching();
    const std::uint32_t asked = touching != none ? touching : first_;
    const Inspection seen =
        inspect_contact(contact(asked), touching != none ? &manifold(touching) : nullptr, narrow_phase_.bodies,
                        narrow_phase_.state, narrow_phase_.dt, narrow_phase_.graph.children(asked));
    if (seen.change == Change::recycled && others_moved_little(touching)) {
      watch_all();
      return Change::recycled;
    }
    if (!seen.collide && seen.change != Change::recycled) return end_all(seen.change == Change::gone);
    find_parts();
    return match();
  }

 private:
  const BodyState& state() const { return narrow_phase_.state; }
  const Pose& pose_a() const { return state().poses[contact(first_).a]; }
  const Pose& pose_b() const { return state().poses[contact(first_).b]; }
  const Velocity& velocity_a() const { return state().velocities[contact(first_).a]; }
  const Velocity& velocity_b() const { return state().velocities[contact(first_).b]; }
  Contact& contact(std::uint32_t index) const { return narrow_phase_.graph[index]; }
  ContactManifold& manifold(std::uint32_t index) const { return narrow_phase_.graph.manifold(contact(index)); }

  std::uint32_t any_touching() const {
    for (const Part& part : scratch_.parts)
      if (part.touches) return part.index;
    return none;
  }

  /// Whether all parts but `asked`, already tested, have moved little. A turning compound also moves its other
  /// children, none of which may come near unnoticed.
  bool others_moved_little(std::uint32_t asked) const {
    const Pose b_in_a = relative(pose_a(), pose_b());
    for (const Part& part : scratch_.parts) {
      if (!part.touches) continue;
      Contact& c = contact(part.index);
      const float distance = kept_within(c, part.children, narrow_phase_.bodies);
      const ContactManifold& m = manifold(part.index);
      if (part.index != asked && (c.ahead || !moved_little(m, b_in_a, distance) || is_to_reduce_anew(c.axis, m)))
        return false;
      if (!b_.geometry.is_compound()) continue;
      const Vec3 half_turn = (conjugate(m.rotation_at_build) * b_in_a.rotation).vector();
      if (!(4 * length_squared(half_turn) * b_.radius * b_.radius < distance * distance)) return false;
    }
    return true;
  }

  /// Returns the change of the first contact; those of the others go to lists.
  Change end_all(bool gone) {
    for (const Part& part : scratch_.parts) {
      if (part.index == first_) continue;
      if (part.touches) narrow_phase_.ended.push_back(part.index);
      if (gone) narrow_phase_.gone.push_back(part.index);
    }
    if (gone) return Change::gone;
    return contact(first_).touching() ? Change::ended : Change::nothing;
  }

  // --- what touches ------------------------------------------------------------------------------------------

  float margin() const {
    return speculative_margin(a_.radius, b_.radius, velocity_a(), velocity_b(), narrow_phase_.dt);
  }

  /// Indices of the pieces of B that may touch A.
  std::span<const std::uint32_t> near_children_of_b() {
    std::vector<std::uint32_t>& near = scratch_.children_b;
    near.clear();
    if (b_.geometry.is_compound())
      find_children(b_.geometry.compound(), grown(bounds(a_.geometry, relative(pose_b(), pose_a())), margin()), near);
    else
      near.push_back(0);
    std::ranges::sort(near);
    return near;
  }

  void find_parts() {
    const auto end_of = [&](const BodyInfo& info, const Pose& pose, const Velocity& v) {
      return info.geometry.is_compound() ? advanced(pose, v, narrow_phase_.dt) : pose;
    };
    end_a_ = end_of(a_, pose_a(), velocity_a());
    end_b_ = end_of(b_, pose_b(), velocity_b());
    for (const std::uint32_t child : near_children_of_b()) {
      const Piece b = piece_of(b_, child);
      if (a_.geometry.is_surface())
        touch_surface(b, child);
      else
        touch_pieces(b, child);
    }
  }

  void watch_all() {
    if (!a_.geometry.is_surface()) return;
    for (const std::uint32_t child : near_children_of_b()) watch(child);
  }

  /// Makes the piece's end pose be checked after the step: a load may press a thin piece through within one step.
  void watch(std::uint32_t child_b) {
    const Contact& c = contact(first_);
    narrow_phase_.fast.push_back({first_, c.a, c.b, pose_a(), pose_b(), {}, {0, child_b}});
  }

  /// After a search that found no triangle: the piece watched last moves in that box, unless a load presses it.
  void note_clear() { narrow_phase_.fast.back().clear = scratch_.surface.searched; }

  void touch_surface(const Piece& b, std::uint32_t child) {
    if (!may_collide(a_.filter, b.filter)) return;
    watch(child);
    const float dt = narrow_phase_.dt;
    const Mover surface{a_.geometry, a_.radius, pose_a(), velocity_a()};
    const Mover body = mover_of(b, pose_b(), velocity_b(), end_b_, dt);
    const Pose b_in_a = relative(surface.pose, body.pose);
    const float near = speculative_margin(surface.radius, body.radius, surface.velocity, body.velocity, dt);
    const float movement = movement_of(near, surface.radius, body.radius, dt);
    const std::span<const SurfacePush> pushes = pushes_of(child);
    const Vec3 centre =
        b.is_child ? inverse_rotate(surface.pose.rotation, pose_b().position - body.pose.position) : Vec3{};
    SurfaceContact found;
    SurfaceAhead ahead{b_in_a, -1};
    if (movement <= max(slow_movement, slow_share * b.half)) {
      collide_surface(a_.geometry.surface(), b.geometry, b_in_a, near, pushes, scratch_.surface, found, centre);
    } else {
      const float rest = min(margin_at_rest(surface.radius, body.radius, dt), slow_share * b.half);
      ahead = look_ahead(surface, body, b_in_a, near, rest, b.half, dt, scratch_.surface);
      if (ahead.is_clear) return note_clear();
      collide_surface(a_.geometry.surface(), b.geometry, ahead.b_in_a, ahead.time >= 0 ? min(near, b.half) : rest,
                      pushes, scratch_.surface, found, centre);
    }
    if (scratch_.surface.triangles.empty()) return note_clear();
    const Pose body_in_a = b.is_child ? ahead.b_in_a * inverse(b.pose) : ahead.b_in_a;
    const Piece of_surface = piece_of(a_, 0);
    for (int g = 0; g < found.count; ++g) {
      const Manifold kept = narrow_phase_.seams.kept_on_surface(
          {contact(first_).a, 0, of_surface}, {contact(first_).b, child, b}, ahead.b_in_a, found.manifolds[g]);
      if (kept.count == 0) continue;
      AxisCache axis;
      axis.reduced = found.is_reduced[g];
      scratch_.found.push_back({{found.materials[g], child}, ahead.time, body_in_a, kept, axis});
    }
  }

  void touch_pieces(const Piece& b, std::uint32_t child_b) {
    const float dt = narrow_phase_.dt;
    const Mover on_b = mover_of(b, pose_b(), velocity_b(), end_b_, dt);
    const Aabb box = quick_bounds(b.geometry, relative(pose_a(), pose_b()) * b.pose);
    std::vector<std::uint32_t>& near = scratch_.children_a;
    near.clear();
    if (a_.geometry.is_compound())
      find_children(a_.geometry.compound(), grown(box, margin()), near);
    else
      near.push_back(0);
    std::ranges::sort(near);
    for (const std::uint32_t child_a : near) {
      const PieceOfA& a = piece_of_a(child_a);
      if (!may_collide(a.piece.filter, b.filter)) continue;
      // That of the whole bodies, which the search has used, is far larger where large compounds turn.
      const float margin = speculative_margin(a.piece.radius, b.radius, a.mover.velocity, on_b.velocity, dt);
      if (overlaps(a.box, grown(box, margin))) touch(a, b, on_b, margin, {child_a, child_b});
    }
  }

  const PieceOfA& piece_of_a(std::uint32_t child) {
    if (scratch_.known.size() <= child) scratch_.known.resize(child + 1);
    PairScratch::Known& known = scratch_.known[child];
    if (known.pair != scratch_.pair) {
      known = {scratch_.pair, static_cast<std::uint32_t>(scratch_.pieces.size())};
      const Piece a = piece_of(a_, child);
      const Aabb box = a.is_child ? a_.geometry.compound().bounds(child) : bounds(a.geometry, {});
      scratch_.pieces.push_back({a, box, mover_of(a, pose_a(), velocity_a(), end_a_, narrow_phase_.dt)});
    }
    return scratch_.pieces[known.piece];
  }

  void touch(const PieceOfA& piece_a, const Piece& b, const Mover& on_b, float margin, Children children) {
    const Piece& a = piece_a.piece;
    const Mover& on_a = piece_a.mover;
    const float dt = narrow_phase_.dt;
    const Pose b_in_a = relative(on_a.pose, on_b.pose);
    AxisCache axis;
    PatchLoad load;
    if (const Part* const part = touching_part(children)) {
      axis = contact(part->index).axis;
      if (axis.reduced) load = load_of(manifold(part->index));
      load.at = inverse_transform(a.pose, load.at);
    }
    const Manifold fresh = collide(a.geometry, b.geometry, b_in_a, margin, axis, load);
    const auto take = [&](const Manifold& m, const Pose& at, float ahead) {
      if (m.count == 0) return;
      const Manifold kept =
          narrow_phase_.seams
              .kept({contact(first_).a, children.a, a}, {contact(first_).b, children.b, b}, at, margin, m)
              .manifold;
      if (kept.count > 0)
        scratch_.found.push_back({children, ahead, a.pose * at * inverse(b.pose), moved(kept, a.pose), axis});
    };
    const float half = min(a.half, b.half);
    const bool may_be_pressed = contact(first_).fixed_a && is_pressed(fresh, half);
    if (!may_be_pressed && movement_of(margin, a.radius, b.radius, dt) <= max(slow_movement, slow_share * half))
      return take(fresh, b_in_a, -1);
    if (!contact(first_).fixed_a && pass_for_certain(fresh, axis, on_a.velocity, on_b.velocity, dt)) return;
    const LookAhead seen = look_ahead(on_a, on_b, fresh, margin, half, dt);
    if (seen.is_watched && is_swept(a_, b_)) {
      const Contact& c = contact(first_);
      narrow_phase_.fast.push_back({first_, c.a, c.b, pose_a(), pose_b(), seen.first, children});
    }
    if (seen.ahead == Ahead::meets) return take(seen.manifold, seen.b_in_a, seen.time);
    if (seen.ahead == Ahead::as_seen) take(fresh, b_in_a, -1);
  }

  // --- which contact it is -----------------------------------------------------------------------------------

  std::span<Part> parts_of(Children children) const {
    const std::tuple same(children.a, children.b);
    const auto children_of = [](const Part& p) { return std::tuple(p.children.a, p.children.b); };
    return {std::ranges::lower_bound(scratch_.parts, same, {}, children_of),
            std::ranges::upper_bound(scratch_.parts, same, {}, children_of)};
  }

  /// Pushes of a surface's existing manifolds against this child.
  std::span<const SurfacePush> pushes_of(std::uint32_t child_b) const {
    std::vector<SurfacePush>& pushes = scratch_.pushes;
    pushes.clear();
    for (const Part& part : scratch_.parts)
      if (part.touches && part.children.b == child_b)
        pushes.push_back({manifold(part.index).normal, load_of(manifold(part.index))});
    return pushes;
  }

  const Part* touching_part(Children children) const {
    const std::span<Part> same = parts_of(children);
    return !same.empty() && same[0].touches ? &same[0] : nullptr;
  }

  Change match() {
    std::vector<Part*>& matches = scratch_.matches;
    matches.clear();
    for (const FoundPart& found : scratch_.found) matches.push_back(taken(max_alike(found)));
    Change of_first = contact(first_).touching() ? Change::ended : Change::nothing;
    std::size_t unused = 0;
    for (std::size_t i = 0; i < scratch_.found.size(); ++i) {
      const FoundPart& found = scratch_.found[i];
      if (!matches[i]) matches[i] = taken(next_unused(unused, found.children));
      if (!matches[i]) {
        narrow_phase_.has_new_parts = true;
        narrow_phase_.begun.push_back(
            {first_ | NewManifold::new_part, found.ahead, found.b_in_a, found.manifold, found.children, found.axis});
        continue;
      }
      const std::uint32_t index = matches[i]->index;
      Contact& c = contact(index);
      c.axis = found.axis;
      const Change change = narrow_phase_.put(index, c, found.manifold, found.b_in_a, found.ahead,
                                              c.touching() ? &manifold(index) : nullptr);
      if (index == first_) of_first = change;
    }
    for (const Part& part : scratch_.parts)
      if (part.index != first_ && !part.is_matched && part.touches) narrow_phase_.ended.push_back(part.index);
    return of_first;
  }

  static Part* taken(Part* part) {
    if (part) part->is_matched = true;
    return part;
  }

  /// The unmatched touching part of the same children whose normal is nearest to the found one. Null if there is none
  /// or, with a surface, none near enough.
  Part* max_alike(const FoundPart& found) const {
    Part* best = nullptr;
    float nearest = a_.geometry.is_surface() ? alike_normals : -2.0f;
    for (Part& part : parts_of(found.children)) {
      if (part.is_matched || !part.touches) continue;
      const float cosine = dot(manifold(part.index).normal, found.manifold.normal);
      if (cosine > nearest) best = &part, nearest = cosine;
    }
    return best;
  }

  /// The next unmatched contact that does not touch, reassigned to these children; null if there is none.
  Part* next_unused(std::size_t& next, Children children) {
    while (next < scratch_.parts.size() && (scratch_.parts[next].is_matched || scratch_.parts[next].touches)) ++next;
    if (next == scratch_.parts.size()) return nullptr;
    narrow_phase_.graph.set_children(scratch_.parts[next].index, children);
    return &scratch_.parts[next];
  }

  std::uint32_t first_;
  const NarrowPhase& narrow_phase_;
  PairScratch& scratch_;
  const BodyInfo &a_, &b_;
  Pose end_a_, end_b_;  // where compounds take their children within the step
};

Change update_parts(std::uint32_t index, const NarrowPhase& narrow_phase) {
  thread_local PairScratch scratch;
  return PartedPair(index, narrow_phase, scratch).update();
}

/// Never lets a piece's centre get behind a triangle, which would push it out on the other side. From half the piece's
/// thickness in front, or from its initial distance, the centre slides along the triangle
/// (`slowed_by_triangles` gives its velocity).
bool NativeSimulator::hold_back_from_surface(const FastPair& pair) {
  thread_local SurfaceScratch scratch;
  const BodyInfo& a = bodies[pair.a];
  const Piece b = piece_of(bodies[pair.b], pair.children.b);
  const Velocity& of_surface = state_.velocities[pair.a];
  Pose end = state_.poses[pair.b];
  const Pose begin_of_piece = pair.pose_b * b.pose, end_of_piece = end * b.pose;
  const Vec3 begin_in_a = inverse_transform(pair.pose_a, begin_of_piece.position);
  const Vec3 end_in_a = inverse_transform(state_.poses[pair.a], end_of_piece.position);
  if (length_squared(end_in_a - begin_in_a) <= surface_creep * surface_creep * b.half * b.half) return false;
  const Aabb passed = grown({min(begin_in_a, end_in_a), max(begin_in_a, end_in_a)}, b.half);
  if (contains(pair.clear, passed)) return false;
  Velocity v = state_.velocities[pair.b];
  const CentreWay way =
      centre_way({a.geometry, a.radius, pair.pose_a, of_surface}, {b.geometry, b.radius, begin_of_piece, v},
                 state_.poses[pair.a], end_of_piece, b.half, scratch);
  if (way.stops == 0 ||
      length_squared(way.end - end_of_piece.position) <= already_there * already_there * b.half * b.half)
    return false;
  if (!pre_solve_.may_stop(pair, way.normals[0])) return false;
  end.position = b.is_child ? end.position + (way.end - end_of_piece.position) : way.end;
  v.linear = slowed_by_triangles(way, end.position, of_surface, state_.poses[pair.a].position, v);
  set_state(pair.b, end, v);
  if (pair.contact != none) forget_build(pair.contact);
  return true;
}

}  // namespace fathom::native
