// The application's changes between steps, applied in the order of its calls.
#pragma once

#include "device/contact_arrays.hpp"
#include "device/grid.hpp"
#include "dynamics/bounds.hpp"
#include "dynamics/move_to.hpp"
#include "exec/atomic.hpp"

namespace fathom::device {

enum class EditKind : std::uint32_t {
  add,      ///< constants and tensors, pose, velocity, slot
  reserve,  ///< no body gets the index
  remove,
  set_pose,
  set_velocity,
  add_velocity,  ///< velocity is the change
  impulse,       ///< velocity is the impulse (N·s) and angular impulse (N·m·s)
  move_to,       ///< of a kinematic body
  force,         ///< velocity is the force (N) and torque (N·m), for the next step
  constants,     ///< only the constants of its BodyData
  wake,
  joints,  ///< its joints change: wakes the body, unless it is isolated
};

/// Only three quads, because a million bodies may be pushed at once.
struct alignas(16) Edit {
  EditKind kind = EditKind::wake;
  std::uint32_t index = 0;    ///< device index of the body
  std::uint32_t next = none;  ///< the body's next edit of this batch
  std::uint32_t data = 0;     ///< index of its BodyData
  Vec3 linear{};              ///< part of a velocity, impulse or force; or a position
  std::uint32_t later = 0;    ///< 1: not the body's first edit of this batch
  Vec3 angular{};             ///< part of the same; or the vector of a rotation
  float w = 0;                ///< of a rotation

  FATHOM_HD Pose pose() const { return {linear, 0, {w, angular.x, angular.y, angular.z}}; }
  FATHOM_HD Velocity velocity() const { return {linear, 0, angular, 0}; }
};
static_assert(sizeof(Edit) == 48);

inline Edit edit_of(EditKind kind, std::uint32_t index, const Velocity& v) {
  Edit e;
  e.kind = kind;
  e.index = index;
  e.linear = v.linear;
  e.angular = v.angular;
  return e;
}
inline Edit edit_of(EditKind kind, std::uint32_t index, const Pose& pose) {
  Edit e = edit_of(kind, index, {pose.position, 0, pose.rotation.vector(), 0});
  e.w = pose.rotation.w;
  return e;
}

struct alignas(16) BodyData {
  BodyConstants constants;
  BodyTensors tensors;
  FilterMasks filter;
  Pose pose{};                ///< of a body that is added; of a child in its compound
  Velocity velocity{};        ///< of a body that is added
  std::uint32_t changes = 0;  ///< `Changes` to note when constants change
  std::uint32_t slot = none;  ///< of a body that is added
  std::uint32_t unused[2] = {};
  SurfaceTraits traits{};
};

/// `v` after an impulse and an angular impulse.
FATHOM_HD Velocity pushed(const Velocity& v, const BodyConstants& c, const BodyTensors& t, Quat rotation,
                          const Velocity& impulse) {
  const Vec3 turn = angular_response(rotation, c.inverse_inertia, t.inverse, impulse.angular);
  return {mul_add(v.linear, c.inverse_mass, impulse.linear), 0, v.angular + turn, 0};
}

/// Applies each body's edits, one after the other. Does nothing while the simulator is stopped: the batch is submitted
/// again.
///
/// Edits are in the order of the application's calls, bodies along a curve, so edits read body data from scattered
/// addresses. If `follows`, a body with a single edit that changes its velocity is only marked, and FollowEdits does
/// the remaining work in the order of bodies.
struct ApplyEdits {
  static constexpr std::uint32_t group_size = 64;

  BodyArrays bodies;
  GridView grid;
  Counters* counters;
  const Edit* edits;
  const BodyData* data;
  float dt;
  bool follows;

  FATHOM_HD void operator()(std::uint32_t k) const {
    if (counters->stopped || edits[k].later) return;
    if (follows && edits[k].next == none && mark(edits[k])) return;
    for (std::uint32_t e = k; e != none; e = edits[e].next) apply(edits[e]);
  }

  /// The part of an edit that runs faster in the order of bodies.
  FATHOM_HD void follow(std::uint32_t i) const {
    if (counters->stopped || i >= counters->bodies || !(bodies.flags[i] & edited_flag)) return;
    bodies.flags[i] &= ~static_cast<std::uint32_t>(edited_flag);
    refit(i, false, set_moving(i));
    wake(i);
  }

 private:
  /// The velocity of body i is new: a kinematic body drops its target and, if it moves, wakes what rests on it.
  FATHOM_HD std::uint32_t set_moving(std::uint32_t i) const {
    if (bodies.constants[i].motion() != MotionType::kinematic) return 0;
    bodies.flags[i] &= ~static_cast<std::uint32_t>(forced_flag);
    return fathom::is_moving(bodies.velocities[i]) ? static_cast<std::uint32_t>(wake_partners) : 0u;
  }

  FATHOM_HD bool mark(const Edit& e) const {
    Velocity& v = bodies.velocities[e.index];
    if (e.kind == EditKind::set_velocity) {
      v = e.velocity();
    } else if (e.kind == EditKind::add_velocity) {
      v.linear += e.linear;
      v.angular += e.angular;
    } else {
      return false;
    }
    bodies.flags[e.index] |= edited_flag;
    return true;
  }

  FATHOM_HD void apply(const Edit& e) const {
    const std::uint32_t i = e.index;
    switch (e.kind) {
      case EditKind::add:
        return add(i, e);
      case EditKind::reserve:
        return begin(i);
      case EditKind::remove:
        return remove(i);
      case EditKind::set_pose:
        set_moving(i);
        bodies.poses[i] = e.pose();
        refit(i, true, box_change | wake_partners);
        break;
      case EditKind::set_velocity:
        bodies.velocities[i] = e.velocity();
        refit(i, false, set_moving(i));
        break;
      case EditKind::add_velocity:
        bodies.velocities[i].linear += e.linear;
        bodies.velocities[i].angular += e.angular;
        refit(i, false, set_moving(i));
        break;
      case EditKind::impulse:
        bodies.velocities[i] = pushed(bodies.velocities[i], bodies.constants[i], bodies.tensors[i],
                                      bodies.poses[i].rotation, e.velocity());
        refit(i, false, 0);
        break;
      case EditKind::move_to:
        bodies.velocities[i] = velocity_between(bodies.poses[i], e.pose(), dt);
        refit(i, false, set_moving(i));
        bodies.targets[i] = e.pose();
        bodies.flags[i] |= forced_flag;
        break;
      case EditKind::force: {
        Force f = bodies.flags[i] & forced_flag ? bodies.forces[i] : Force{};
        f.force += e.linear;
        f.torque += e.angular;
        bodies.forces[i] = f;
        bodies.flags[i] |= forced_flag;
        break;
      }
      case EditKind::constants:
        bodies.constants[i] = data[e.data].constants;
        bodies.tensors[i] = data[e.data].tensors;
        bodies.filters[i] = data[e.data].filter;
        set_surface(i, data[e.data]);
        note(i, data[e.data].changes);
        if (data[e.data].changes & drop_contacts) bodies.known[i] = no_box();
        break;
      case EditKind::joints:
        note(i, joint_change);
        if (bodies.flags[i] & isolated_flag) return;
        break;
      case EditKind::wake:
        break;
    }
    wake(i);
  }

  /// The state of an index without a body.
  FATHOM_HD void begin(std::uint32_t i) const {
    bodies.slots[i] = none;
    bodies.constants[i] = BodyConstants{};
    bodies.tensors[i] = BodyTensors{};
    bodies.filters[i] = FilterMasks{};
    bodies.poses[i] = Pose{};
    bodies.velocities[i] = Velocity{};
    bodies.flags[i] = 0;
    bodies.slow_time[i] = 0;
    bodies.colours[i] = bodies.further[i] = bodies.joint_colours[i] = bodies.best[i] = 0;
    bodies.touching[i] = 0;
    bodies.island[i] = i;
    bodies.island_woken[i] = bodies.isolated_in[i] = 0;
    bodies.fast_pair[i] = none;
    bodies.solver[i] = SolverQuads(SolverBody{});
    bodies.support[i] = {};
    bodies.known[i] = no_box();
    bodies.fat[i] = no_box();
    exec::atomic_max(counters->bodies, i + 1);
  }

  FATHOM_HD void add(std::uint32_t i, const Edit& e) const {
    begin(i);
    const BodyConstants c = data[e.data].constants;
    bodies.slots[i] = data[e.data].slot;
    bodies.constants[i] = c;
    bodies.tensors[i] = data[e.data].tensors;
    bodies.filters[i] = data[e.data].filter;
    set_surface(i, data[e.data]);
    if (c.is_child()) bodies.child_poses[i] = data[e.data].pose;
    bodies.poses[i] = data[e.data].pose;
    bodies.velocities[i] = data[e.data].velocity;
    const bool is_still = c.is_child() || c.motion() == MotionType::fixed;
    bodies.flags[i] = is_still ? 0u : static_cast<std::uint32_t>(awake_flag);
    refit(i, true, box_change);
  }

  FATHOM_HD void set_surface(std::uint32_t i, const BodyData& body) const {
    if (body.constants.has_moving_surface() || body.constants.has_friction_axis()) bodies.traits[i] = body.traits;
  }

  FATHOM_HD void remove(std::uint32_t i) const {
    bodies.slots[i] = none;
    bodies.constants[i] = BodyConstants{};
    bodies.flags[i] = 0;
    bodies.known[i] = no_box();
    bodies.fat[i] = no_box();
    note(i, box_change | drop_contacts | wake_partners);
  }

  FATHOM_HD void note(std::uint32_t i, std::uint32_t changes) const {
    bodies.fat[i].changes |= changes;
    if (changes) exec::atomic_store(counters->changed, 1u);
  }

  FATHOM_HD void refit(std::uint32_t i, bool always, std::uint32_t changes) const {
    const BodyConstants& c = bodies.constants[i];
    if (c.is_child()) return;
    // Its children are placed before the next search, and more room than they need does no harm.
    if (c.is_compound()) return note(i, changes | box_change);
    const Velocity& v = bodies.velocities[i];
    const Aabb box = motion_box(bodies.bounds(i, bodies.poses[i]), c.radius, v, dt);
    bodies.boxes[i] = box;
    const NotedBox old = bodies.fat[i];
    if (always || !contains(old.box(), box)) {
      const Aabb fat = fat_box(c.radius, box, v.linear, dt);
      bodies.fat[i] = {fat.lower, old.changes, fat.upper, grid.level_of(fat)};
      changes |= box_change;
    }
    note(i, changes);
  }

  FATHOM_HD void wake(std::uint32_t i) const {
    if (bodies.constants[i].is_child()) return;
    bodies.slow_time[i] = 0;
    const std::uint32_t flags = bodies.flags[i];
    if (flags & awake_flag || bodies.constants[i].motion() == MotionType::fixed) return;
    if (flags & isolated_flag) {
      bodies.flags[i] = (flags & ~isolated_flag) | awake_flag;
    } else {
      exec::atomic_store(bodies.island_woken[bodies.island[i]], counters->step + 1);
      exec::atomic_store(counters->wake_asked, 1u);
    }
    exec::atomic_store(counters->layout_dirty, 1u);
  }
};

/// After ApplyEdits, for every body.
struct FollowEdits {
  ApplyEdits edits;

  FATHOM_HD void operator()(std::uint32_t i) const { edits.follow(i); }
};

/// For tests, on the host only: isolates bodies of a category before a step.
struct IsolateOnRequest {
  Bodies<body_state> bodies;
  Counters* counters;
  std::uint64_t category;

  FATHOM_HD void operator()(std::uint32_t i) const {
    if (!bodies.is_awake(i) || !bodies.constants[i].is_dynamic() || bodies.filters[i].category != category) return;
    bodies.flags[i] = (bodies.flags[i] & ~static_cast<std::uint32_t>(awake_flag)) | isolated_flag;
    bodies.velocities[i] = Velocity{};
    bodies.poses[i].reserved = 0;
    exec::atomic_store(counters->any_isolated, 1u);
    exec::atomic_store(counters->layout_dirty, 1u);
  }
};

struct SetGravity {
  Counters* counters;
  Vec3 gravity;  ///< m/s²

  FATHOM_HD void operator()(std::uint32_t) const {
    if (!counters->stopped) counters->gravity = gravity;
  }
};

/// Wakes the islands of all bodies that gravity acts on.
struct WakeByGravity {
  Bodies<body_islands> bodies;
  Counters* counters;

  FATHOM_HD void operator()(std::uint32_t i) const {
    if (counters->stopped || i >= counters->bodies || bodies.flags[i] & (awake_flag | isolated_flag)) return;
    const BodyConstants& c = bodies.constants[i];
    if (!c.is_living() || !c.is_dynamic() || c.gravity_scale == 0) return;
    exec::atomic_store(bodies.island_woken[bodies.island[i]], counters->step + 1);
    exec::atomic_store(counters->wake_asked, 1u);
    exec::atomic_store(counters->layout_dirty, 1u);
  }
};

/// Lets steps run again after one has stopped.
struct GoOn {
  Counters* counters;

  FATHOM_HD void operator()(std::uint32_t) const { counters->stopped = 0; }
};

}  // namespace fathom::device
