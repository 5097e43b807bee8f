// Invariants after every step of the native simulator (check/check.hpp).
#include <bit>

#include "check/check.hpp"
#include "dynamics/speed_limits.hpp"
#include "geometry/support.hpp"
#include "native/native_simulator.hpp"

namespace fathom::native {

void NativeSimulator::validate() const {
  validate_bodies();
  validate_contacts();
  validate_colours();
  FATHOM_VALIDATE(active_.agrees_with(bodies, state_));
}

void NativeSimulator::validate_bodies() const {
  const SpeedLimits limits =
      speed_limits(def.solver.max_linear_speed, def.dt / static_cast<float>(def.solver.substeps));
  for (const BodyId id : bodies.living()) {
    const std::uint32_t slot = id.index;
    const Pose& pose = state_.poses[slot];
    const Velocity& v = state_.velocities[slot];
    FATHOM_VALIDATE(is_finite(pose) && is_finite(v.linear) && is_finite(v.angular), slot);
    FATHOM_VALIDATE(fathom::abs(dot(pose.rotation, pose.rotation) - 1) < 1e-5f, slot);
    const std::uint8_t flags = state_.flags[slot];
    FATHOM_VALIDATE(!(flags & awake) || !(flags & isolated), slot);
    FATHOM_VALIDATE(!(flags & awake) || bodies[slot].motion != MotionType::fixed, slot);
    if (!(flags & awake)) continue;
    FATHOM_VALIDATE(length(v.linear) <= 1.001f * limits.linear && length(v.angular) <= 1.001f * limits.angular, slot);
    const BodyBounds& bounds = state_.bounds[slot];
    const float rounding = 1e-4f * bodies[slot].radius + 1e-6f * max_component(abs(pose.position));
    FATHOM_VALIDATE(contains(grown(bounds.box, rounding), fathom::bounds(bodies[slot].geometry, pose)), slot);
    FATHOM_VALIDATE(contains(bounds.fat_box, bounds.box), slot);
  }
}

void NativeSimulator::validate_contacts() const {
  // Where the supports' direct solution removes a load, rounding leaves impulses outside the friction cone.
  const float beyond = !solver_.supports().empty() ? 1.25f : 1.001f;
  const auto speed_of = [this](std::uint32_t slot) {
    const Velocity& v = state_.velocities[slot];
    return fastest_speed(bodies[slot].radius, v.linear, v.angular);
  };
  std::size_t in_use = 0;
  for (std::uint32_t i = 0; i < graph_.size(); ++i) {
    const Contact& c = graph_[i];
    if (!c.in_use) continue;
    ++in_use;
    FATHOM_VALIDATE(c.a < state_.size() && c.b < state_.size() && c.a != c.b, c.b);
    FATHOM_VALIDATE(c.fixed_a == (bodies[c.a].motion != MotionType::dynamic), c.a);
    FATHOM_VALIDATE(bodies[c.b].motion == MotionType::dynamic, c.b);
    FATHOM_VALIDATE(c.touching() || c.colour == no_colour, c.b);
    if (!c.touching()) continue;
    const ContactManifold& m = graph_.manifold(c);
    FATHOM_VALIDATE(m.point_count() >= 1 && m.point_count() <= max_manifold_points, c.b);
    for (int p = 0; p < m.point_count(); ++p) FATHOM_VALIDATE(is_finite(m.impulses[p]) && m.impulses[p] >= 0, c.b);
    FATHOM_VALIDATE(is_finite(m.friction_impulse[0]) && is_finite(m.friction_impulse[1]) && is_finite(m.twist_impulse),
                    c.b);
    FATHOM_VALIDATE(m.step_impulse >= 0, c.b);
    // The `impulse` solver ends with normal rows, whose impulses its friction has not seen. New manifolds drop points'
    // impulses.
    if (def.solver.method != Solver::soft || !was_solved(c)) continue;
    const float of_surfaces = c.on_moving_surface ? length(graph_.surface_slide(i)) : 0.0f;
    const float stopping = (speed_of(c.a) + speed_of(c.b) + of_surfaces) / bodies[c.b].inverse_mass;
    FATHOM_VALIDATE(is_within_cone(m, beyond, stopping), c.b);
  }
  FATHOM_VALIDATE(in_use == graph_.pair_count());
}

// Constraints of a colour share no body, and lists, contacts and bodies agree about colours.
void NativeSimulator::validate_colours() const {
  std::vector<int> colours(state_.size());
  std::vector<int> colour_of(state_.size(), -1);
  std::size_t listed = 0;
  for (int colour = 0; colour <= overflow_colour; ++colour) {
    const auto occupy = [&](std::uint32_t slot) {
      if (colour == overflow_colour) return;
      FATHOM_VALIDATE(colour_of[slot] != colour, slot);
      FATHOM_VALIDATE(state_.colour_mask[slot] >> colour & 1, slot);
      colour_of[slot] = colour;
      ++colours[slot];
    };
    std::size_t of_contacts = 0, of_joints = 0;
    graph_.for_each_of_colour(colour, [&](std::uint32_t index) {
      const Contact& c = graph_[index];
      FATHOM_VALIDATE(c.in_use && c.touching() && c.colour == colour, c.b);
      occupy(c.b);
      if (!c.fixed_a) occupy(c.a);
      ++of_contacts;
    });
    for (std::size_t unit = 0; unit < graph_.domains().units(); ++unit) {
      for (const ConstraintKind kind :
           {ConstraintKind::ball_joint, ConstraintKind::generic_joint, ConstraintKind::coupling})
        for (const std::uint32_t slot : graph_.joints_of(kind, unit, colour)) {
          const Joint& joint = graph_.joint(slot);
          FATHOM_VALIDATE(joint.in_use && joint.kind == kind && joint.colour == colour, joint.b);
          occupy(joint.b);
          if (!joint.fixed_a) occupy(joint.a);
          ++of_joints;
        }
    }
    FATHOM_VALIDATE(of_contacts == graph_.size_of(colour) && of_joints == graph_.joints_of_colour(colour));
    listed += of_contacts + of_joints;
  }
  std::size_t coloured = 0;
  for (std::uint32_t i = 0; i < graph_.size(); ++i) coloured += graph_[i].in_use && graph_[i].colour != no_colour;
  for (std::uint32_t i = 0; i < graph_.joint_slots(); ++i) coloured += graph_.joint(i).colour != no_colour;
  FATHOM_VALIDATE(listed == coloured);
  for (const BodyId id : bodies.living()) {
    const std::uint32_t slot = id.index;
    FATHOM_VALIDATE(std::popcount(state_.colour_mask[slot]) == colours[slot], slot);
    const bool to_solve =
        state_.colour_mask[slot] != 0 || state_.overflow_count[slot] != 0 || (state_.flags[slot] & kinematic);
    FATHOM_VALIDATE(state_.is_to_solve(slot) == to_solve, slot);
  }
}

/// Whether its impulses are from this step.
bool NativeSimulator::was_solved(const Contact& c) const { return c.colour != no_colour && is_active(c); }

}  // namespace fathom::native
