#include "native/islands.hpp"

#include <utility>

#include "dynamics/move_to.hpp"
#include "dynamics/moving_surface.hpp"
#include "dynamics/sleep.hpp"

namespace fathom::native {

// Union-find with path halving. The smaller root wins, so the outcome does not depend on the order of contacts.
std::uint32_t Islands::root(std::uint32_t slot) {
  while (parent_[slot] != slot) slot = parent_[slot] = parent_[parent_[slot]];
  return slot;
}

void Islands::find_islands(std::span<const std::uint32_t> active) {
  parent_.resize(state_.size());
  slow_time_.resize(state_.size());
  for (const std::uint32_t slot : active) parent_[slot] = slot;
  for (int colour = 0; colour <= overflow_colour; ++colour) {
    graph_.for_each_of_colour(colour, [&](std::uint32_t index) {
      const Contact& c = graph_[index];
      if (c.on_moving_surface) look_at_surface(index);
      connect(c.a, c.b, c.fixed_a);
    });
  }
  graph_.for_each_coloured_joint([&](const Joint& joint) { connect(joint.a, joint.b, joint.fixed_a); });
}

void Islands::connect(std::uint32_t body_a, std::uint32_t body_b, bool fixed_a) {
  if (fixed_a) {
    // A body pushed by a moving one stays awake.
    if (is_moving(state_.velocities[body_a])) state_.slow_time[body_b] = 0;
    return;
  }
  if (!(state_.flags[body_a] & state_.flags[body_b] & awake)) return;  // one of them is quarantined
  const std::uint32_t a = root(body_a), b = root(body_b);
  if (a < b)
    parent_[b] = a;
  else
    parent_[a] = b;
}

/// Bodies that a moving surface carries along stay awake, however slow; so do bodies that drive along on their own.
void Islands::look_at_surface(std::uint32_t index) {
  const Contact& c = graph_[index];
  const Vec3 velocity = state_.velocities[c.b].linear - state_.velocities[c.a].linear;
  if (!goes_with_surface(graph_.surface_slide(index), velocity)) return;
  for (const std::uint32_t slot : {c.a, c.b})
    if (bodies_[slot].motion == MotionType::dynamic) state_.slow_time[slot] = 0;
}

bool Islands::put_to_sleep(std::span<const std::uint32_t> active) {
  find_islands(active);
  count_ = 0;
  for (const std::uint32_t slot : active) slow_time_[slot] = def_.sleep.time * 2;
  for (const std::uint32_t slot : active) {
    const std::uint32_t r = root(slot);
    count_ += r == slot;
    slow_time_[r] = min(slow_time_[r], state_.slow_time[slot]);
  }
  members_.clear();
  for (const std::uint32_t slot : active)
    if (bodies_[slot].motion == MotionType::dynamic && slow_time_[root(slot)] >= def_.sleep.time)
      members_.push_back(slot);
  if (members_.empty()) return false;
  bool any = false;
  std::stable_sort(members_.begin(), members_.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return root(a) < root(b); });
  for (auto begin = members_.begin(); begin != members_.end();) {
    const std::uint32_t island = root(*begin);
    const auto end = std::find_if(begin, members_.end(), [&](std::uint32_t slot) { return root(slot) != island; });
    const std::vector<std::uint32_t> members(begin, end);
    begin = end;
    if (is_at_rest(members)) {
      sleep(members);
      any = true;
    } else {
      for (const std::uint32_t slot : members) state_.slow_time[slot] = 0;  // tested again after that time
    }
  }
  return any;
}

bool Islands::is_at_rest(std::span<const std::uint32_t> members) {
  bool is_supported = false, is_still = true;
  for (const std::uint32_t slot : members) {
    const bool still = speed_of(state_.velocities[slot], bodies_[slot].radius) <= still_share * def_.sleep.linear_speed;
    is_still = is_still && still;
    bool is_carried = false;
    graph_.for_each_of(slot, [&](std::uint32_t index) {
      const Contact& c = graph_[index];
      if (!c.touching() || !(graph_.manifold(c).step_impulse > 0)) return;
      is_carried = true;
      is_supported = is_supported || !can_be_pushed(c.a == slot ? c.b : c.a);
    });
    for (const std::uint32_t joint : joints_.of(slot)) {
      is_carried = true;
      const Joint& j = graph_.joint(joint);
      is_supported = is_supported || !can_be_pushed(j.a == slot ? j.b : j.a);
    }
    if (!is_carried && !still) return false;
  }
  return is_supported || is_still;
}

/// A body that can be pushed needs support itself.
bool Islands::can_be_pushed(std::uint32_t slot) const {
  return bodies_[slot].motion == MotionType::dynamic && state_.flags[slot] & awake;
}

void Islands::sleep(const std::vector<std::uint32_t>& members) {
  std::uint32_t island;
  if (free_.empty()) {
    island = static_cast<std::uint32_t>(sleeping_.size());
    sleeping_.emplace_back();
  } else {
    island = free_.back();
    free_.pop_back();
  }
  sleeping_[island] = members;
  sleeping_in_.resize(state_.size(), none);
  for (const std::uint32_t slot : members) {
    sleeping_in_[slot] = island;
    state_.flags[slot] &= static_cast<std::uint8_t>(~awake);
    state_.velocities[slot] = {};
    state_.solver_bodies()[slot] = {};
    graph_.for_each_of(slot, [&](std::uint32_t index) {
      if (graph_[index].colour != no_colour) graph_.uncolour(index);
    });
    for (const std::uint32_t joint : joints_.of(slot))
      if (graph_.joint(joint).colour != no_colour) graph_.uncolour_joint(joint);
  }
}

void Islands::wake(std::uint32_t slot) {
  if (slot >= sleeping_in_.size() || sleeping_in_[slot] == none) return;
  const std::uint32_t island = sleeping_in_[slot];
  const std::vector<std::uint32_t> members = std::move(sleeping_[island]);
  sleeping_[island].clear();
  free_.push_back(island);
  for (const std::uint32_t member : members) {
    sleeping_in_[member] = none;
    state_.flags[member] |= awake;
    state_.slow_time[member] = 0;
    graph_.for_each_of(member, [&](std::uint32_t index) {
      if (graph_[index].touching() && graph_[index].colour == no_colour) graph_.colour(index);
    });
    for (const std::uint32_t joint : joints_.of(member))
      if (graph_.joint(joint).colour == no_colour) graph_.colour_joint(joint);
  }
}

void Islands::forget(std::uint32_t slot) {
  if (slot >= sleeping_in_.size() || sleeping_in_[slot] == none) return;
  const std::uint32_t island = std::exchange(sleeping_in_[slot], none);
  std::erase(sleeping_[island], slot);
  if (sleeping_[island].empty()) free_.push_back(island);
}

}  // namespace fathom::native
