// Changes made by the application between steps, and what they wake.
#include <algorithm>
#include <vector>

#include "dynamics/move_to.hpp"
#include "native/native_simulator.hpp"

namespace fathom::native {

void NativeSimulator::body_added(std::uint32_t slot, const Pose& pose, const Velocity& velocity) {
  if (slot >= state_.size()) {
    state_.resize(slot + 1);
    graph_.resize(slot + 1);
    solver_.supports().overloads().resize(slot + 1);
  }
  state_.clear(slot);
  const BodyInfo& info = bodies[slot];
  state_.poses[slot] = pose;
  state_.velocities[slot] = velocity;
  state_.bounds[slot] = bounds_of(info, pose, velocity, def.dt);
  state_.flight[slot] = flight_data(info);
  state_.flags[slot] = static_cast<std::uint8_t>(box_changed | (info.motion == MotionType::fixed ? 0 : awake) |
                                                 (info.motion == MotionType::kinematic ? kinematic : 0));
  state_.note_filter(slot, info);
  state_.note_to_solve(slot);
  note_set(slot);
}

void NativeSimulator::body_removed(std::uint32_t slot) {
  graph_.for_each_of(slot, [&](std::uint32_t index) {
    const Contact& c = graph_[index];
    const std::uint32_t other = c.a == slot ? c.b : c.a;
    if (c.touching()) wake_island(other);
  });
  graph_.for_each_of(slot, [&](std::uint32_t index) { drop_contact(index, ended_by_removal_); });
  islands_.forget(slot);
  solver_.supports().overloads().forget(slot);
  state_.clear(slot);
  std::erase(forced_, slot);
  note_set(slot);
}

void NativeSimulator::set_pose(std::uint32_t slot, const Pose& pose) {
  note_moved(slot);
  wake(slot);
  wake_neighbours(slot);
  solver_.supports().overloads().clear_owed(slot);
  state_.flags[slot] &= static_cast<std::uint8_t>(~targeted);
  state_.poses[slot] = pose;
  state_.bounds[slot] = bounds_of(bodies[slot], pose, state_.velocities[slot], def.dt);
  state_.flags[slot] |= box_changed;
}

void NativeSimulator::set_velocity(std::uint32_t slot, const Velocity& velocity) {
  note_moved(slot);
  wake(slot);
  solver_.supports().overloads().clear_owed(slot);
  if (state_.flags[slot] & kinematic) {
    state_.flags[slot] &= static_cast<std::uint8_t>(~targeted);
    if (is_moving(velocity)) wake_neighbours(slot);
  }
  set_state(slot, state_.poses[slot], velocity);
}

void NativeSimulator::move_to(std::uint32_t slot, const Pose& pose) {
  set_velocity(slot, velocity_between(state_.poses[slot], pose, def.dt));
  state_.flags[slot] |= targeted;
  targets_.push_back({pose, slot});
}

void NativeSimulator::material_changed(std::uint32_t slot) {
  wake(slot);
  wake_neighbours(slot);
  graph_.for_each_of(slot, [&](std::uint32_t index) { graph_.mix_materials(graph_[index]); });
}

void NativeSimulator::info_changed(std::uint32_t slot) {
  state_.flight[slot] = flight_data(bodies[slot]);
  wake(slot);
}

void NativeSimulator::mass_changed(std::uint32_t slot) {
  info_changed(slot);
  solver_.mechanisms().find_anew();  // trees know how their bodies' masses compare
}

void NativeSimulator::filter_changed(std::uint32_t slot) {
  state_.note_filter(slot, bodies[slot]);
  solver_.mechanisms().find_anew();
  wake(slot);
  wake_neighbours(slot);
  graph_.for_each_of(slot, [&](std::uint32_t index) { drop_contact(index, ended_by_removal_); });
  state_.flags[slot] |= box_changed;  // makes it look for pairs again
}

void NativeSimulator::wake(std::uint32_t slot) {
  state_.slow_time[slot] = 0;
  if (bodies[slot].motion == MotionType::fixed || state_.flags[slot] & awake) return;
  if (state_.flags[slot] & isolated) {
    state_.flags[slot] = static_cast<std::uint8_t>((state_.flags[slot] & ~isolated) | awake);
    if (state_.flags[slot] & jointed) graph_.note_obstacle();
  } else {
    islands_.wake(slot);
  }
  active_.outdate();
}

// Edits of other bodies do not free a quarantined one.
void NativeSimulator::wake_island(std::uint32_t slot) {
  state_.slow_time[slot] = 0;
  if (!is_asleep(slot)) return;
  islands_.wake(slot);
  active_.outdate();
}

void NativeSimulator::wake_neighbours(std::uint32_t slot) {
  if (!islands_.any_asleep()) return;
  for (const std::uint32_t joint : joints.of(slot)) wake_joined(joint);
  graph_.for_each_of(slot, [&](std::uint32_t index) {
    const Contact& c = graph_[index];
    if (c.touching()) wake_island(c.a == slot ? c.b : c.a);
  });
}

// No other stage looks at pairs without an awake body.
void NativeSimulator::wake_below_fixed() {
  if (!changed_.any_at_rest() || !islands_.any_asleep()) return;
  for (const std::uint32_t slot : changed_.slots()) {
    if (bodies[slot].motion != MotionType::fixed) continue;
    graph_.for_each_of(slot, [&](std::uint32_t index) {
      const std::uint32_t other = graph_[index].a == slot ? graph_[index].b : graph_[index].a;
      if (overlaps(state_.bounds[slot].box, state_.bounds[other].box)) wake_island(other);
    });
  }
}

void NativeSimulator::gravity_changed() {
  std::vector<std::uint32_t> slots;
  islands_.for_each_with([&](std::uint32_t slot) { return bodies[slot].gravity_scale != 0; },
                         [&](std::uint32_t slot) { slots.push_back(slot); });
  for (const std::uint32_t slot : slots) wake_island(slot);
}

void NativeSimulator::apply(std::uint32_t slot, Vec3 force, Vec3 torque) {
  wake(slot);
  if (!(state_.flags[slot] & has_force)) forced_.push_back(slot);
  state_.flags[slot] |= has_force;
  state_.forces[slot].force += force;
  state_.forces[slot].torque += torque;
}

}  // namespace fathom::native
