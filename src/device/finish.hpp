// finish: bodies move to where the solver took them, boxes follow, islands fall asleep, the step is reported.
#pragma once

#include "device/contact_arrays.hpp"
#include "device/grid.hpp"
#include "device/solve.hpp"
#include "dynamics/bounds.hpp"
#include "dynamics/restitution.hpp"
#include "dynamics/rotation.hpp"
#include "exec/atomic.hpp"
#include "exec/kernel.hpp"

namespace fathom::device {

struct MoveParameters {
  float dt;  ///< s
  std::uint32_t substeps;
  float max_linear_speed;  ///< m/s
  bool sleeping;
  float slow_below;  ///< m/s
};

/// Moves every body that is awake and brings its boxes up to date.
struct MoveBodies {
  BodyArrays bodies;
  Grid grid;
  Counters* counters;
  std::uint32_t* quarantined;  ///< list of bodies, `Counters::quarantined` of them
  MoveParameters p;

  FATHOM_HD void operator()(std::uint32_t i) const {
    NotedBox fat = bodies.fat[i];
    if (fat.changes) {
      fat.changes = 0;
      bodies.known[i] = fat;
      bodies.fat[i] = fat;
    }
    const std::uint32_t flags = bodies.flags[i];
    if (!(flags & awake_flag)) return;
    const BodyConstants c = bodies.constants[i];
    const Pose before = bodies.poses[i];
    Pose pose = before;
    Velocity v = bodies.velocities[i];
    if (bodies.touching[i] > 0 && c.is_dynamic()) {
      const SolverBody s = bodies.solver[i].body();
      v.linear = s.linear;
      v.angular = s.angular;
      pose.position = pose.position + s.moved;
      // The solver has turned anisotropic bodies already.
      if (c.is_isotropic()) pose.rotation = turned(pose.rotation, s.turned);
    } else if (!c.is_dynamic()) {
      move_kinematic(pose, v);
    } else {
      move_free(i, c, flags, pose, v);
    }
    std::uint32_t new_flags = flags & ~forced_flag;
    if (!is_finite(pose) || !is_finite(v.linear) || !is_finite(v.angular)) {
      pose = before;
      if (!is_finite(pose.rotation)) pose.rotation = Quat{};
      v = Velocity{};
      new_flags = (new_flags & ~awake_flag) | isolated_flag;
      exec::atomic_store(counters->any_isolated, 1u);
      quarantined[exec::atomic_add(counters->quarantined, 1u)] = i;
      exec::atomic_store(counters->layout_dirty, 1u);
    }
    if (new_flags != flags) bodies.flags[i] = new_flags;
    if (flags & forced_flag) bodies.forces[i] = {};
    limit(v.linear, p.max_linear_speed);
    limit(v.angular, pi / p.dt);
    // −0 becomes +0, so that equal states have equal bits.
    v.linear += Vec3{};
    v.angular += Vec3{};
    pose.position += Vec3{};
    bodies.poses[i] = pose;
    bodies.velocities[i] = v;
    const Aabb box = motion_box(bodies.geometry(i), c.radius, pose, v, p.dt);
    bodies.boxes[i] = box;
    if (!contains(fat.box(), box)) put_fat_box(i, fat_box(c.radius, box, v.linear, p.dt), box_change);
    if (p.sleeping) account_for_sleep(i, c, v);
  }

  FATHOM_HD void put_fat_box(std::uint32_t i, const Aabb& box, std::uint32_t changes) const {
    bodies.fat[i] = {box.lower, changes, box.upper, grid.level_of(box)};
    if (!exec::atomic_load(counters->changed)) exec::atomic_store(counters->changed, 1u);
  }

 private:
  FATHOM_HD static void limit(Vec3& v, float most) {
    const float squared = dot(v, v);
    if (squared > most * most) v *= most / fathom::sqrt(squared);
  }

  /// As the solver moves it, whose rounding this repeats.
  FATHOM_HD void move_kinematic(Pose& pose, const Velocity& v) const {
    const float h = p.dt / static_cast<float>(p.substeps);
    Vec3 moved, turning;
    for (std::uint32_t s = 0; s < p.substeps; ++s) {
      moved = mul_add(moved, h, v.linear);
      turning = mul_add(turning, h, v.angular);
    }
    pose.position = pose.position + moved;
    pose.rotation = turned(pose.rotation, turning);
  }

  /// All substeps of a dynamic body without contacts.
  FATHOM_HD void move_free(std::uint32_t i, const BodyConstants& c, std::uint32_t flags, Pose& pose,
                           Velocity& v) const {
    const float h = p.dt / static_cast<float>(p.substeps);
    Vec3 acceleration = c.gravity_scale * counters->gravity, angular_acceleration;
    if (flags & forced_flag) {
      const Force f = bodies.forces[i];
      acceleration = mul_add(acceleration, c.inverse_mass, f.force);
      angular_acceleration =
          c.is_isotropic() ? c.inverse_inertia * f.torque
                           : rotate(pose.rotation, bodies.tensors[i].inverse * inverse_rotate(pose.rotation, f.torque));
    }
    const float linear_damping = 1.0f / (1.0f + h * c.linear_damping);
    const float angular_damping = 1.0f / (1.0f + h * c.angular_damping);
    Vec3 moved, turning;
    for (std::uint32_t s = 0; s < p.substeps; ++s) {
      v.linear = mul_add(linear_damping * v.linear, h, acceleration);
      v.angular = mul_add(angular_damping * v.angular, h, angular_acceleration);
      moved = mul_add(moved, h, mean_velocity(false, v.linear, acceleration, h));
      if (c.is_isotropic())
        turning = mul_add(turning, h, v.angular);
      else
        step_torque_free(pose.rotation, v.angular, bodies.tensors[i].inertia, bodies.tensors[i].inverse, h);
    }
    pose.position = pose.position + moved;
    if (c.is_isotropic()) pose.rotation = turned(pose.rotation, turning);
  }

  FATHOM_HD void account_for_sleep(std::uint32_t i, const BodyConstants& c, const Velocity& v) const {
    const float speed = length(v.linear) + length(v.angular) * c.radius;
    const bool slow = c.bits & can_sleep_bit && c.is_dynamic() && speed < p.slow_below;
    bodies.slow_time[i] = slow ? bodies.slow_time[i] + p.dt : 0.0f;
  }
};

/// Ends the step: tells the host, in pinned memory.
struct EndStep {
  Counters* counters;
  Report* reports;
  std::uint32_t report_count;

  FATHOM_HD void operator()(std::uint32_t) const {
    Counters& c = *counters;
    // A stopped step is reported under the number it would have had.
    const std::uint32_t number = c.step + 1;
    if (!c.stopped) c.step = number;
    Report r;
    r.step = number;
    r.stopped = c.stopped;
    r.contacts = c.contacts;
    r.free_contacts = c.free_contacts;
    r.found = c.found;
    r.manifolds = c.manifolds + c.taken_manifolds + c.deferred[0] + c.deferred[1] - c.free_manifolds;
    r.constraints = c.constraints;
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
    reports[number % report_count] = r;
  }
};

/// What the application sees of a body, by its slot.
struct PublishBodies {
  BodyArrays bodies;
  const std::uint32_t* slots;
  Pose* poses;
  Velocity* velocities;
  std::uint32_t* flags;

  FATHOM_HD void operator()(std::uint32_t i) const {
    const std::uint32_t slot = slots[i];
    if (slot == none) return;
    poses[slot] = bodies.poses[i];
    velocities[slot] = bodies.velocities[i];
    flags[slot] = bodies.flags[i] | bodies.island[i] << island_shift;
  }
};

}  // namespace fathom::device
