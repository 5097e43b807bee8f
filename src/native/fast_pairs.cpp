// Pairs that move fast for their size (dynamics/look_ahead.hpp). They have a separate file, because otherwise the
// compiler would not inline the pose functions that every contact needs.
#include <algorithm>
#include <utility>

#include "dynamics/free_end.hpp"
#include "dynamics/way_over_seam.hpp"
#include "geometry/compound_query.hpp"
#include "native/native_simulator.hpp"
#include "native/pieces.hpp"

namespace fathom::native {

Change NarrowPhase::take_fast(std::uint32_t index, Contact& c, const Manifold& fresh, const Inspection& seen,
                              ContactManifold* manifold) const {
  const BodyInfo &a = bodies[c.a], &b = bodies[c.b];
  const float half = min(half_thickness(a), half_thickness(b));
  const LookAhead found =
      look_ahead({a.geometry, a.radius, state.poses[c.a], state.velocities[c.a]},
                 {b.geometry, b.radius, state.poses[c.b], state.velocities[c.b]}, fresh, seen.margin, half, dt);
  if (found.is_watched && is_swept(a, b)) {
    const Pose &pose_a = state.poses[c.a], &pose_b = state.poses[c.b];
    fast.push_back({index, c.a, c.b, pose_a, pose_b, found.first});
  }
  if (found.ahead == Ahead::meets) return put_kept(index, c, found.manifold, found.b_in_a, found.time, manifold);
  const bool passes = found.ahead == Ahead::nothing;
  const Change change = put_kept(index, c, passes ? Manifold{} : fresh, seen.b_in_a, -1, manifold);
  // The next step must see it again.
  if (manifold && change == Change::nothing && c.fixed_a && is_pressed(fresh, half)) manifold->forget_build();
  return change;
}

namespace {

/// How far (m) a body that moves with `v` for `dt` (s) from this pose takes its points to or from the box, in world
/// axes.
float reach_to(const Aabb& box, const Pose& pose, const Velocity& v, float dt) {
  const Vec3 farthest = max(abs(box.lower - pose.position), abs(box.upper - pose.position));
  return dt * (length(v.linear) + length(v.angular) * length(farthest));
}

/// Calls act(children) for pieces of both bodies that overlap the box, in world axes; A's within `reach_a` (m) of it.
template <class Act>
void for_each_near_piece(const BodyInfo& a, const Pose& pose_a, float reach_a, const BodyInfo& b, const Pose& pose_b,
                         const Aabb& box, const Act& act) {
  const auto list = [&](const BodyInfo& info, const Pose& pose, float reach) {
    std::vector<std::uint32_t> children;
    if (info.geometry.is_compound())
      find_children(info.geometry.compound(), bounds(grown(box, reach), relative(pose, {})), children);
    else
      children.push_back(0);
    std::ranges::sort(children);
    return children;
  };
  const std::vector<std::uint32_t> of_a = list(a, pose_a, reach_a), of_b = list(b, pose_b, 0);
  for (const std::uint32_t child_b : of_b)
    for (const std::uint32_t child_a : of_a) act({child_a, child_b});
}

}  // namespace

/// If a body ended inside or behind a non-dynamic body, stops it where its path was still free; it continues in the
/// next step. There it may be inside or behind another body.
void NativeSimulator::hold_back_fast() {
  changes_.for_each_fast_pair([&](const FastPair& pair) {
    if (!is_free(pair) && hold_back(pair, HoldBack::with_room))
      strays_.list.push_back({pair.b, {pair.pose_b.position, 0, pair.pose_b.rotation}});
  });
  hold_back_strays();
  // The lighter body stops beside the heavier one. If another body is in its way, the heavier one stops beside it
  // instead.
  constexpr int rounds = 4;
  for (int round = 0; round < rounds; ++round) {
    changes_.for_each_fast_pair([&](const FastPair& pair) {
      if (is_free(pair)) hold_back_free(pair, round % 2 == 1);
    });
    if (strays_.list.empty()) return;
    hold_back_strays();
  }
}

/// Whether both bodies are dynamic.
bool NativeSimulator::is_free(const FastPair& pair) const { return bodies[pair.a].motion == MotionType::dynamic; }

/// Adds the body that is held back to the strays.
void NativeSimulator::hold_back_free(const FastPair& pair, bool heavier) {
  const auto can_be_held = [this](std::uint32_t slot) { return (state_.flags[slot] & (awake | isolated)) == awake; };
  if (!can_be_held(pair.a) && !can_be_held(pair.b)) return;
  const bool is_a_lighter = bodies[pair.a].inverse_mass > bodies[pair.b].inverse_mass;
  const bool hold_a = !can_be_held(pair.b) || (can_be_held(pair.a) && is_a_lighter != heavier);
  FastPair seen = pair;  // A is the body that is not held back
  if (hold_a) {
    std::swap(seen.a, seen.b);
    std::swap(seen.pose_a, seen.pose_b);
    std::swap(seen.children.a, seen.children.b);
    seen.first.normal = -seen.first.normal;
  }
  const Piece a = piece_of(bodies[seen.a], seen.children.a), b = piece_of(bodies[seen.b], seen.children.b);
  const Velocity v = state_.velocities[seen.b];
  const Pose &end_a = state_.poses[seen.a], &end_b = state_.poses[seen.b];
  const Mover on_a = mover_of(a, seen.pose_a, state_.velocities[seen.a], def.dt);
  const Mover on_b = mover_of(b, seen.pose_b, v, def.dt);
  const Pose end_of_a = a.is_child ? end_a * a.pose : end_a, end_of_b = b.is_child ? end_b * b.pose : end_b;
  const float half = min(a.half, b.half);
  const FreeWay way = free_way(on_a, on_b, end_of_a, end_of_b, seen.first, half, def.dt);
  if (way.is_free || !pre_solve_.may_stop(seen, seen.first.normal)) return;
  Pose pose = end_beside(way, on_a, on_b, end_of_a, end_of_b, seen.first, half, def.dt);
  if (b.is_child) pose = pose * relative(b.pose, {});
  pose.reserved = end_b.reserved;
  set_state(seen.b, pose, v);
  strays_.list.push_back({seen.b, {seen.pose_b.position, 0, seen.pose_b.rotation}});
  forget_build(seen.contact);
}

/// Returns whether it changed B's end pose.
bool NativeSimulator::hold_back(const FastPair& pair, HoldBack how) {
  if ((state_.flags[pair.b] & (awake | isolated)) != awake) return false;
  if (bodies[pair.a].geometry.is_surface()) return hold_back_from_surface(pair);
  const Piece a = piece_of(bodies[pair.a], pair.children.a), b = piece_of(bodies[pair.b], pair.children.b);
  const Pose end = state_.poses[pair.b];
  Velocity v = state_.velocities[pair.b];
  const Mover on_a = mover_of(a, pair.pose_a, state_.velocities[pair.a], def.dt);
  const Mover on_b = mover_of(b, pair.pose_b, v, def.dt);
  const Pose end_a = a.is_child ? state_.poses[pair.a] * a.pose : state_.poses[pair.a];
  const Pose end_b = b.is_child ? end * b.pose : end;
  FreeWay way = free_way(on_a, on_b, end_a, end_b, pair.first, min(a.half, b.half), def.dt, how);
  if (!way.is_free && (a.is_child || b.is_child || seams_.may_have(pair.a))) {
    const SeamSide side_a{pair.a, pair.children.a, a}, side_b{pair.b, pair.children.b, b};
    const auto kept = [&](const Pose& b_in_a, float margin, const Manifold& m) {
      return seams_.kept(side_a, side_b, b_in_a, margin, m);
    };
    find_way_over_seam(on_a, on_b, end_a, end_b, pair.first, min(a.half, b.half), def.dt, kept, way);
  }
  if (way.is_free || !pre_solve_.may_stop(pair, pair.first.normal)) return false;
  const SpeedLimits limits =
      speed_limits(def.solver.max_linear_speed, def.dt / static_cast<float>(def.solver.substeps));
  if (way.is_lifted) {
    const BodyInfo& info = bodies[pair.b];
    v = stopped(way, on_a.velocity, end_a.position, end_b.position, v, end, info.inverse_mass,
                info.isotropic ? info.inverse_inertia.xx : 0.0f, info.inverse_inertia);
    v.angular = limited(v.angular, limits.angular);
  }
  v.linear = limited(v.linear, limits.linear);
  put_back(pair.b, end_of(way, pair.pose_b, end, def.dt), v);
  if (pair.contact != none) forget_build(pair.contact);
  return true;
}

void NativeSimulator::put_back(std::uint32_t slot, const Pose& pose, Velocity v) {
  // An isotropic body has the same energy about any axis.
  if (!bodies[slot].isotropic) v.angular = spin_put_back(v.angular, state_.poses[slot].rotation, pose.rotation);
  // Otherwise a body put back in many steps would accumulate the rounding of all the products.
  Pose unit = pose;
  unit.rotation = normalize(pose.rotation);
  set_state(slot, unit, v);
}

/// Strays may have reached bodies that they form no pair with: searches their whole path for static and kinematic
/// bodies.
void NativeSimulator::hold_back_strays() {
  if (strays_.list.empty()) return;
  std::ranges::sort(strays_.list, {}, &Strays::Stray::slot);
  // Duplicates are equal, so it does not matter which thread was first.
  const auto is_same = [](const Strays::Stray& x, const Strays::Stray& y) { return x.slot == y.slot; };
  strays_.list.erase(std::unique(strays_.list.begin(), strays_.list.end(), is_same), strays_.list.end());
  tree_.refresh_fixed(bodies, state_.bounds.data(), pool_);
  std::vector<std::uint32_t> kinematic_bodies;
  for (const std::uint32_t slot : active_.active())
    if (state_.flags[slot] & kinematic) kinematic_bodies.push_back(slot);
  for (const Strays::Stray& stray : strays_.list) hold_back_stray(stray, kinematic_bodies);
  strays_.list.clear();
}

void NativeSimulator::hold_back_stray(const Strays::Stray& stray, const std::vector<std::uint32_t>& kinematic_bodies) {
  // Holding it back from one obstacle may move it into another. Its initial pose was outside all of them, or as deep
  // inside as it may be. If a kinematic body has carried it on from there, it is held back from static ones.
  std::uint32_t carrier = none;
  const bool has_joints = state_.flags[stray.slot] & jointed;
  for (int round = 0; round < hold_back_rounds; round = round_after(round, has_joints)) {
    if (round == turned_back_from || round == moved_back_from) {
      Pose pose = stray.begin;
      Velocity v = state_.velocities[stray.slot];
      if (round == turned_back_from)
        pose.position = state_.poses[stray.slot].position;
      else
        v.linear *= kept_when_stuck, v.angular *= kept_when_stuck;
      put_back(stray.slot, pose, v);
    }
    const HoldBack how = how_in(round, has_joints);
    bool is_free = true;
    for (const std::uint32_t slot : obstacles_of(stray, kinematic_bodies)) {
      if (!hold_back(stray, slot, how)) continue;
      is_free = false;
      if (bodies[slot].motion != MotionType::fixed) carrier = slot;
    }
    if (is_free) return;
  }
  const Velocity v = state_.velocities[stray.slot];
  if (carrier == none) return put_back(stray.slot, stray.begin, v);
  put_back(stray.slot, state_.poses[carrier] * relative(begin_of_obstacle(carrier), stray.begin), v);
  for (const std::uint32_t slot : obstacles_of(stray, kinematic_bodies))
    if (bodies[slot].motion == MotionType::fixed) hold_back(stray, slot, HoldBack::with_room);
}

Pose NativeSimulator::begin_of_obstacle(std::uint32_t slot) const {
  const Pose& end = state_.poses[slot];
  return bodies[slot].motion == MotionType::fixed ? end : advanced(end, state_.velocities[slot], -def.dt);
}

/// Static and kinematic bodies near the stray's path, in ascending order.
std::vector<std::uint32_t> NativeSimulator::obstacles_of(const Strays::Stray& stray,
                                                         const std::vector<std::uint32_t>& kinematic_bodies) {
  const BodyInfo& info = bodies[stray.slot];
  const Vec3 begin = stray.begin.position, way = state_.poses[stray.slot].position - begin;
  const Vec3 reach{info.radius, info.radius, info.radius};
  struct Found final : BodyVisitor {
    float visit(std::uint32_t slot) override {
      slots.push_back(slot);
      return 1;
    }
    std::vector<std::uint32_t> slots;
  } found;
  tree_.visit_fixed({begin, reach, way}, found);
  const Aabb box{min(begin, begin + way) - reach, max(begin, begin + way) + reach};
  for (const std::uint32_t slot : kinematic_bodies)
    if (overlaps(state_.bounds[slot].fat_box, box)) found.slots.push_back(slot);
  std::erase_if(found.slots, [&](std::uint32_t slot) {
    return !may_collide(bodies[slot], info) || joints.keeps_apart(slot, stray.slot) ||
           excluded.contains(slot, stray.slot) || !lets_collide(slot, stray.slot);
  });
  std::ranges::sort(found.slots);
  return found.slots;
}

bool NativeSimulator::hold_back(const Strays::Stray& stray, std::uint32_t obstacle, HoldBack how) {
  const BodyInfo &info = bodies[stray.slot], &other = bodies[obstacle];
  const Velocity v = state_.velocities[obstacle];
  const Pose pose = begin_of_obstacle(obstacle);
  const Velocity way = velocity_between(stray.begin, state_.poses[stray.slot], def.dt);
  const Vec3 reach{info.radius, info.radius, info.radius}, to = state_.poses[stray.slot].position;
  const Aabb box{min(stray.begin.position, to) - reach, max(stray.begin.position, to) + reach};
  bool is_held = false;
  const float reach_a = other.motion == MotionType::fixed ? 0 : reach_to(box, pose, v, def.dt);
  for_each_near_piece(other, pose, reach_a, info, stray.begin, box, [&](Children children) {
    const Piece a = piece_of(other, children.a), b = piece_of(info, children.b);
    if (!may_collide(a.filter, b.filter)) return;
    Apart first{};
    if (!other.geometry.is_surface()) {
      const Mover on_a = mover_of(a, pose, v, def.dt), on_b = mover_of(b, stray.begin, way, def.dt);
      const float skin = skin_of(on_a, on_b, min(a.half, b.half));
      // Where they overlap, only the manifold tells by how much and on which side.
      const float margin = speculative_margin(on_a.radius, on_b.radius, on_a.velocity, on_b.velocity, def.dt);
      AxisCache axis;
      const Manifold seen = collide_shapes(on_a.geometry, on_b.geometry, relative(on_a.pose, on_b.pose), margin, axis);
      first = apart_at_first(on_a, on_b, near_cores(on_a, on_b, def.dt, skin), seen, skin);
    }
    is_held |= hold_back({none, obstacle, stray.slot, pose, stray.begin, first, children}, how);
  });
  return is_held;
}

/// Makes the next step rebuild the manifolds of the pair with this first contact.
void NativeSimulator::forget_build(std::uint32_t first) {
  const auto forget = [&](std::uint32_t index) {
    if (graph_[index].touching()) graph_.manifold(graph_[index]).forget_build();
  };
  if (graph_[first].in_parts)
    graph_.for_each_in_ring(first, forget);
  else
    forget(first);
}

}  // namespace fathom::native
