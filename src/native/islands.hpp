// Islands: bodies connected by touching contacts and joints. They fall asleep and wake together.
#pragma once

#include <algorithm>
#include <cstdint>
#include <fathom/world.hpp>
#include <span>
#include <vector>

#include "native/contact_graph.hpp"
#include "world/joint_table.hpp"

namespace fathom::native {

class Islands {
 public:
  Islands(const WorldDef& def, BodyTable& bodies, const JointTable& joints, BodyState& state, ContactGraph& graph)
      : def_(def), bodies_(bodies), joints_(joints), state_(state), graph_(graph) {}

  /// Puts to sleep every island whose bodies have all been slow for long enough and are supported or do not move at
  /// all; returns true if any fell asleep.
  bool put_to_sleep(std::span<const std::uint32_t> active);
  /// Wakes the island of a sleeping body and gives its contacts back their colours.
  void wake(std::uint32_t slot);
  void forget(std::uint32_t slot);
  bool any_asleep() const { return free_.size() < sleeping_.size(); }
  /// Calls act(slot) for the first member with is_one(slot) of each sleeping island that has one.
  template <class IsOne, class Act>
  void for_each_with(const IsOne& is_one, const Act& act) const {
    for (const std::vector<std::uint32_t>& members : sleeping_) {
      const auto one = std::find_if(members.begin(), members.end(), is_one);
      if (one != members.end()) act(*one);
    }
  }
  std::uint32_t count() const { return count_; }

  template <class Self, class Archive>
  static void archive(Self& s, Archive& a) {
    a(s.sleeping_in_, s.sleeping_, s.free_, s.count_);
  }
  void restore(ByteReader& in);

 private:
  std::uint32_t root(std::uint32_t slot);
  void find_islands(std::span<const std::uint32_t> active);
  void look_at_surface(std::uint32_t index);
  void connect(std::uint32_t body_a, std::uint32_t body_b, bool fixed_a);
  bool is_at_rest(std::span<const std::uint32_t> members);
  bool can_be_pushed(std::uint32_t slot) const;
  void sleep(const std::vector<std::uint32_t>& members);

  const WorldDef& def_;
  BodyTable& bodies_;
  const JointTable& joints_;
  BodyState& state_;
  ContactGraph& graph_;
  std::vector<std::uint32_t> parent_;       // by slot; the lowest slot of an island is its root
  std::vector<float> slow_time_;            // by root: the smallest of its bodies'
  std::vector<std::uint32_t> sleeping_in_;  // by slot: index into sleeping_, or none
  std::vector<std::vector<std::uint32_t>> sleeping_;
  std::vector<std::uint32_t> free_;
  std::vector<std::uint32_t> members_;
  std::uint32_t count_ = 0;
};

}  // namespace fathom::native
