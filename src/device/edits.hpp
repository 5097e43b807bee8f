// What the application changes between steps, applied in the order it was asked for.
#pragma once

#include "device/contact_arrays.hpp"
#include "device/grid.hpp"
#include "dynamics/bounds.hpp"
#include "exec/atomic.hpp"

namespace fathom::device {

enum class EditKind : std::uint32_t {
  add,  ///< constants and tensors, pose, velocity
  remove,
  set_pose,
  set_velocity,
  add_velocity,  ///< velocity: the change
  impulse,       ///< velocity: impulse (N·s) and angular impulse (N·m·s)
  force,         ///< velocity: force (N) and torque (N·m), for the next step
  constants,     ///< constants alone
  wake,
};

struct alignas(16) Edit {
  EditKind kind = EditKind::wake;
  std::uint32_t index = 0;    ///< device index of the body
  std::uint32_t next = none;  ///< the body's next edit of this batch
  std::uint32_t data = 0;     ///< index of its BodyData
  Pose pose{};
  Velocity velocity{};
  std::uint32_t changes = 0;  ///< further `Changes` to note
  std::uint32_t later = 0;    ///< 1: not the body's first edit of this batch
  std::uint32_t unused[2] = {};
};

struct alignas(16) BodyData {
  BodyConstants constants;
  BodyTensors tensors;
};

/// The change of velocity by an impulse and an angular impulse.
FATHOM_HD Velocity pushed(const Velocity& v, const BodyConstants& c, const BodyTensors& t, Quat rotation,
                          const Velocity& impulse) {
  if (!c.is_dynamic()) return v;
  const Vec3 turn = c.is_isotropic() ? c.inverse_inertia * impulse.angular
                                     : rotate(rotation, t.inverse * inverse_rotate(rotation, impulse.angular));
  return {mul_add(v.linear, c.inverse_mass, impulse.linear), 0, v.angular + turn, 0};
}

/// Each body's edits, one after the other. Nothing happens while the simulator is stopped: the batch comes again.
struct ApplyEdits {
  static constexpr std::uint32_t group_size = 64;

  BodyArrays bodies;
  Grid grid;
  Counters* counters;
  const Edit* edits;
  const BodyData* data;
  float dt;

  FATHOM_HD void operator()(std::uint32_t k) const {
    if (counters->stopped || edits[k].later) return;
    for (std::uint32_t e = k; e != none; e = edits[e].next) apply(edits[e]);
  }

 private:
  FATHOM_HD void apply(const Edit& e) const {
    const std::uint32_t i = e.index;
    switch (e.kind) {
      case EditKind::add:
        return add(i, e);
      case EditKind::remove:
        return remove(i);
      case EditKind::set_pose:
        bodies.poses[i] = e.pose;
        refit(i, true, box_change | wake_partners);
        break;
      case EditKind::set_velocity:
        bodies.velocities[i] = e.velocity;
        refit(i, false, 0);
        break;
      case EditKind::add_velocity:
        bodies.velocities[i].linear += e.velocity.linear;
        bodies.velocities[i].angular += e.velocity.angular;
        refit(i, false, 0);
        break;
      case EditKind::impulse:
        bodies.velocities[i] =
            pushed(bodies.velocities[i], bodies.constants[i], bodies.tensors[i], bodies.poses[i].rotation, e.velocity);
        refit(i, false, 0);
        break;
      case EditKind::force: {
        Force f = bodies.flags[i] & forced_flag ? bodies.forces[i] : Force{};
        f.force += e.velocity.linear;
        f.torque += e.velocity.angular;
        bodies.forces[i] = f;
        bodies.flags[i] |= forced_flag;
        break;
      }
      case EditKind::constants:
        bodies.constants[i] = data[e.data].constants;
        note(i, e.changes);
        if (e.changes & drop_contacts) bodies.known[i] = no_box();
        break;
      case EditKind::wake:
        break;
    }
    wake(i);
  }

  FATHOM_HD void add(std::uint32_t i, const Edit& e) const {
    const BodyConstants c = data[e.data].constants;
    bodies.constants[i] = c;
    bodies.tensors[i] = data[e.data].tensors;
    bodies.poses[i] = e.pose;
    bodies.velocities[i] = e.velocity;
    bodies.flags[i] = c.motion() == MotionType::fixed ? 0u : static_cast<std::uint32_t>(awake_flag);
    bodies.slow_time[i] = 0;
    bodies.colours[i] = bodies.best[i] = 0;
    bodies.touching[i] = 0;
    bodies.island[i] = i;
    bodies.island_woken[i] = 0;
    bodies.solver[i] = SolverBody{};
    bodies.known[i] = no_box();
    bodies.fat[i] = no_box();
    exec::atomic_max(counters->bodies, i + 1);
    refit(i, true, box_change);
  }

  FATHOM_HD void remove(std::uint32_t i) const {
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
    const Velocity& v = bodies.velocities[i];
    const Aabb box = motion_box(bodies.geometry(i), c.radius, bodies.poses[i], v, dt);
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

struct SetGravity {
  Counters* counters;
  Vec3 gravity;  ///< m/s²

  FATHOM_HD void operator()(std::uint32_t) const { counters->gravity = gravity; }
};

/// Lets steps run again after one was stopped.
struct GoOn {
  Counters* counters;

  FATHOM_HD void operator()(std::uint32_t) const { counters->stopped = 0; }
};

}  // namespace fathom::device
