// finish: bodies move to their solved poses, boxes follow, islands fall asleep, the step is reported.
#pragma once

#include "check/check.hpp"
#include "device/contact_arrays.hpp"
#include "device/grid.hpp"
#include "device/solve.hpp"
#include "dynamics/bounds.hpp"
#include "dynamics/forces.hpp"
#include "dynamics/overlap.hpp"
#include "dynamics/rotation.hpp"
#include "dynamics/sleep.hpp"
#include "exec/atomic.hpp"
#include "exec/bits.hpp"
#include "exec/kernel.hpp"

namespace fathom::device {

struct MoveParameters {
  float dt;  ///< s
  std::uint32_t substeps;
  SpeedLimits limits;
  bool sleeping;
  float slow_below;  ///< m/s
  bool jointed;      ///< there are joints
};

/// Moves every body that is awake and brings its boxes up to date.
struct MoveBodies {
  Bodies<body_data, body_state, body_islands, body_fast_pairs, body_supports> bodies;
  GridView grid;
  Counters* counters;
  MoveParameters p;

  FATHOM_HD void operator()(std::uint32_t i) const {
    if (counters->stopped) return;
    NotedBox fat = bodies.fat[i];
    if (fat.changes) {
      fat.changes = 0;
      bodies.known[i] = fat;
      bodies.fat[i] = fat;
    }
    const std::uint32_t flags = bodies.flags[i];
    if (!(flags & awake_flag)) return;
    if (counters->solved_step == counters->step + 1 && bodies.support[i].level > 0)
      bodies.support[i].held = bodies.nodes[i].held;
    if (exec::atomic_load(counters->loaded_step) >= counters->step) follow_load(i);
    const BodyConstants c = bodies.constants[i];
    const Pose before = bodies.poses[i];
    Pose pose = before;
    Velocity v = bodies.velocities[i];
    Vec3 residual{v.reserved0, v.reserved1, pose.reserved};  // `accelerate`
    const bool forced = flags & forced_flag;
    Vec3 moved_by_contacts;
    if (bodies.touching[i] > 0 && c.is_dynamic()) {
      moved_by_contacts = move_solved(i, c, forced, pose, v, residual);
    } else if (!c.is_dynamic()) {
      move_kinematic(pose, v);
      if (forced) pose = bodies.targets[i];
    } else {
      move_free(i, c, flags, pose, v, residual);
    }
    std::uint32_t new_flags = flags;
    // Islands must still see that bodies move before these stop.
    if (c.is_dynamic() || !p.sleeping) new_flags &= ~forced_flag;
    if (!c.is_dynamic() && !p.sleeping) {
      if (forced) v = {}, bodies.before[i] = before;
      bodies.before[i].reserved = forced ? has_arrived : 0.0f;
    }
    if (!is_finite(pose) || !is_finite(v.linear) || !is_finite(v.angular)) {
      pose = before;
      if (!is_finite(pose.rotation)) pose.rotation = Quat{};
      v = Velocity{};
      residual = {};
      new_flags = (new_flags & ~(awake_flag | forced_flag)) | isolated_flag;
      report_isolated(i);
    }
    if (new_flags != flags) bodies.flags[i] = new_flags;
    if (forced) bodies.forces[i] = {};
    // The residual of a velocity beyond the limits has no bound.
    const Vec3 slower = limited(v.linear, p.limits.linear);
    if (!(slower == v.linear)) residual = {};
    v.linear = slower;
    v.angular = limited(v.angular, p.limits.angular);
    // −0 becomes +0: equal states then have equal bits.
    v.linear += Vec3{};
    v.angular += Vec3{};
    pose.position += Vec3{};
    residual += Vec3{};
    v.reserved0 = residual.x, v.reserved1 = residual.y, pose.reserved = residual.z;
    FATHOM_ASSERT(is_finite(pose) && is_finite(v.linear) && is_finite(v.angular), i);
    FATHOM_ASSERT(abs(dot(pose.rotation, pose.rotation) - 1) < 1e-5f, i);
    if (c.is_dynamic() && (forced || bodies.touching[i] > 0)) note_stray(i, c, before, pose);
    bodies.poses[i] = pose;
    bodies.velocities[i] = v;
    if (!c.is_compound()) {
      const Aabb box = motion_box(bodies.bounds(i, pose), c.radius, v, p.dt);
      FATHOM_VALIDATE(
          contains(grown(box, 1e-4f * c.radius + 1e-6f * max_component(abs(pose.position))), bodies.bounds(i, pose)),
          i);
      bodies.boxes[i] = box;
      if (!contains(fat.box(), box)) put_fat_box(i, fat_box(c.radius, box, v.linear, p.dt), box_change);
    }
    if (p.sleeping) account_for_sleep(i, c, v, moved_by_contacts);
  }

  /// Sets the body's inertia for the next step, and what it owes the body.
  FATHOM_HD void follow_load(std::uint32_t i) const {
    BodyLoad& load = bodies.support[i].load;
    OwedMomentum& owed = bodies.support[i].owed;
    const bool is_jointed = p.jointed && bodies.joint_colours[i] != 0;
    if (bodies.touching[i] > 0 && load.inertia_scale > 1 && !is_jointed) {
      const Vec3 up = -normalize(counters->gravity);
      const SolverBody after = bodies.solver[i].body();
      const Velocity& before = bodies.velocities[i];
      owed.take(load.inertia_scale, after.linear - before.linear, after.angular - before.angular, up);
    }
    const float now = __builtin_bit_cast(float, load.now);
    const bool settled = is_settled(bodies.velocities[i].linear) ||
                         (counters->joined_step == counters->step && bodies.nodes[i].is_settled);
    load = {0, now, next_inertia_scale(load.inertia_scale, min(now, load.before), settled)};
    if (now > 0 || load.inertia_scale > 1 || owed.any()) exec::atomic_store(counters->loaded_step, counters->step + 1);
  }

  FATHOM_HD void put_fat_box(std::uint32_t i, const Aabb& box, std::uint32_t changes) const {
    bodies.fat[i] = {box.lower, changes, box.upper, grid.level_of(box)};
    if (!exec::atomic_load(counters->changed)) exec::atomic_store(counters->changed, 1u);
  }

 private:
  /// Moves a dynamic body with contacts or joints as solved. Returns the solver's translation (m).
  FATHOM_HD Vec3 move_solved(std::uint32_t i, const BodyConstants& c, bool forced, Pose& pose, Velocity& v,
                             Vec3& residual) const {
    const SolverBody s = bodies.solver[i].body();
    const Quat before = pose.rotation;
    if (!fly_on(i, s.linear, v.linear, residual)) v.linear = s.linear, residual = {};
    v.angular = s.angular;
    Vec3 moved = s.moved, turning = s.turned;
    if (!c.is_isotropic()) {
      pose.rotation = bodies.inertia[i].rotation;
      v.angular = rotate(pose.rotation, inverse_rotate(before, s.angular));
      turning = {};
    }
    if (forced) {
      const BodyMotion motion = bodies.motion[i];
      const Velocity start = bodies.velocities[i];
      complete_forced(moved, turning, bodies.forces[i], {motion.acceleration, motion.angular_acceleration},
                      start.linear, v.linear, start.angular, v.angular, has_flown(bodies.warm[i], s.linear), p.dt,
                      static_cast<float>(p.substeps));
      moved = limited(moved, p.dt * p.limits.linear);
    }
    pose.position = pose.position + moved;
    if (c.is_isotropic() || forced) pose.rotation = turned(pose.rotation, turning);
    return s.moved;
  }

  FATHOM_HD void report_isolated(std::uint32_t i) const {
    exec::atomic_store(counters->any_isolated, 1u);
    exec::atomic_add(counters->quarantined, 1u);
    bodies.isolated_in[i] = counters->step + 1;
    exec::atomic_store(counters->layout_dirty, 1u);
  }

  /// Whether a body with contacts moved freely, without touching; the solver rounded its velocity `after` in every
  /// substep. If so, `v` becomes the velocity of free movement without that rounding.
  FATHOM_HD bool fly_on(std::uint32_t i, Vec3 after, Vec3& v, Vec3& residual) const {
    const BodyMotion motion = bodies.motion[i];
    if (motion.linear_damping != 1.0f) return false;
    Vec3 flown = v, left = residual;
    accelerate(flown, left, mul_add(residual, p.dt, motion.acceleration));
    if (!may_have_flown(v, after, flown, static_cast<float>(p.substeps))) return false;
    if (!has_flown(bodies.warm[i], after)) return false;
    v = flown;
    residual = left;
    return true;
  }

  /// As the solver moves it, repeating its rounding.
  FATHOM_HD void move_kinematic(Pose& pose, const Velocity& v) const {
    const float h = p.dt / static_cast<float>(p.substeps);
    const Vec3 linear = limited(v.linear, p.limits.linear), angular = limited(v.angular, p.limits.angular);
    Vec3 moved, turning;
    for (std::uint32_t s = 0; s < p.substeps; ++s) {
      moved = mul_add(moved, h, linear);
      turning = mul_add(turning, h, angular);
    }
    pose.position = pose.position + moved;
    pose.rotation = turned(pose.rotation, turning);
  }

  /// Moves a dynamic body without contacts.
  FATHOM_HD void move_free(std::uint32_t i, const BodyConstants& c, std::uint32_t flags, Pose& pose, Velocity& v,
                           Vec3& residual) const {
    const float h = p.dt / static_cast<float>(p.substeps);
    const bool forced = flags & forced_flag;
    const Velocity start = v;
    Acceleration all{c.gravity_scale * counters->gravity, {}};
    if (forced) all = forced_acceleration(bodies, i, pose.rotation, all.linear);
    const FlightForces<Vec3> by{all.linear, all.angular, damping_factor(c.linear_damping, h),
                                damping_factor(c.angular_damping, h)};
    Flight<Vec3> f{v.linear, v.angular, residual, {}, {}};
    const int substeps = static_cast<int>(p.substeps);
    fly(f, by, p.dt, substeps, p.limits.angular);
    v.linear = f.linear, v.angular = f.angular;
    residual = f.residual;
    if (!c.is_isotropic()) f.turned = {};
    // Angular velocity changes in torque-free rotation too; no torque causes that part.
    if (forced)
      complete_forced(f.moved, f.turned, bodies.forces[i], all, start.linear, f.linear, start.angular, f.angular, true,
                      p.dt, static_cast<float>(p.substeps));
    pose.position = pose.position + limited(f.moved, p.dt * p.limits.linear);
    if (!c.is_isotropic()) {
      v.angular = start.angular;
      spin_freely(pose.rotation, v.angular, all.angular, by.angular_damping, bodies.tensors[i].inertia,
                  bodies.tensors[i].inverse, h, substeps, p.limits.angular);
    }
    if (c.is_isotropic() || forced) pose.rotation = turned(pose.rotation, f.turned);
  }

  /// Lists a body that has left its initial line of motion by a good part of its thickness, and by more than the
  /// distance within which pairs are searched beside that line. A joint may pull its bodies through others in contact,
  /// so that distance is zero for jointed bodies.
  FATHOM_HD void note_stray(std::uint32_t i, const BodyConstants& c, const Pose& begin, const Pose& end) const {
    const Vec3 aside = aside_of(end.position - begin.position, p.dt * bodies.velocities[i].linear);
    const bool is_jointed = p.jointed && bodies.joint_colours[i] != 0;
    const float beside = is_jointed ? 0.0f : half_speculative_margin(c.radius, p.dt) + fall_within(p.dt);
    const float allowed = max(beside, slow_share * half_thickness(c));
    if (!(dot(aside, aside) > allowed * allowed)) return;
    if (bodies.fast_pair[i] == none) bodies.fast[exec::atomic_add(counters->fast_bodies, 1u)] = i;
    bodies.before[i] = {begin.position, 1.0f, begin.rotation};
  }

  FATHOM_HD void account_for_sleep(std::uint32_t i, const BodyConstants& c, const Velocity& v, Vec3 moved) const {
    const bool may_sleep = c.bits & can_sleep_bit && c.is_dynamic();
    const bool slow = may_sleep && is_slow(v, moved, c.radius, p.slow_below, p.dt);
    bodies.slow_time[i] = slow ? bodies.slow_time[i] + p.dt : 0.0f;
    if (may_sleep && is_round(c.shape()) && bodies.touching[i] > 0 && bodies.joint_colours[i] == 0)
      bodies.velocities[i].angular = rest_factor(v, c.shape_radius, p.slow_below, p.dt) * v.angular;
  }
};

/// Ends the step and reports it to the host, in pinned memory.
struct EndStep {
  Counters* counters;
  Report* reports;
  std::uint32_t report_count;

  FATHOM_HD void operator()(std::uint32_t) const {
    Counters& c = *counters;
    // A stopped step is reported under the number it would have had.
    const std::uint32_t number = c.step + 1;
    if (!c.stopped) {
      c.step = number;
      if (c.solved_step == number) c.held_step = number;
    }
    Report r;
    r.step = number;
    r.stopped = c.stopped;
    r.contacts = c.contacts;
    r.free_contacts = c.free_contacts;
    r.found = c.found + patches_per_pair * c.found_with_surfaces;
    r.patches = c.patches;
    r.manifolds = c.manifolds + c.taken_manifolds + c.needed_manifolds() - c.free_manifolds;
    r.constraints = c.constraints;
    r.solved_joints = c.solved_joints;
    r.overflow = c.overflow;
    r.colours = c.sweeps - (c.overflow ? 1 : 0);
    r.recycled = c.recycled;
    r.points = c.points;
    r.begun = c.begun;
    r.ended = c.ended;
    r.hits = c.hits;
    r.quarantined = c.quarantined;
    r.islands = c.islands;
    r.active = c.active;
    r.overrun = c.overrun;
    reports[number % report_count] = r;
  }
};

/// Copies a step's events to the host, up to the room there.
struct CopyEvents {
  Contacts<> contacts;
  std::uint32_t step;
  std::uint32_t begun_count, ended_count, hit_count;
  std::uint32_t room;  ///< of each of the following arrays in pinned memory
  PairRecord* begun;
  PairRecord* ended;
  HitRecord* hits;

  FATHOM_HD void operator()(std::uint32_t k) const {
    if (k >= room) return;
    if (k < begun_count) begun[k] = contacts.begun[contacts.event(step, k)];
    if (k < ended_count) ended[k] = contacts.ended[contacts.event(step, k)];
    if (k < hit_count) hits[k] = contacts.hits[contacts.event(step, k)];
  }
};

/// The same for the step that has just ended, before the host knows the counts.
struct CopyNewestEvents {
  CopyEvents copy;
  const Counters* counters;

  FATHOM_HD void operator()(std::uint32_t k) const {
    if (counters->stopped) return;
    CopyEvents all = copy;
    all.begun_count = counters->begun, all.ended_count = counters->ended, all.hit_count = counters->hits;
    all(k);
  }
};

/// Publishes what the application sees of a body, by slot.
struct PublishBodies {
  Bodies<> bodies;
  const Counters* counters;
  Pose* poses;
  Velocity* velocities;
  std::uint32_t* flags;

  FATHOM_HD void operator()(std::uint32_t i) const {
    if (i >= counters->bodies) return;
    const std::uint32_t slot = bodies.slots[i];
    if (slot == none) return;
    poses[slot] = bodies.poses[i];
    velocities[slot] = bodies.velocities[i];
    flags[slot] = bodies.flags[i] | bodies.island[i] << island_shift;
  }
};

}  // namespace fathom::device
