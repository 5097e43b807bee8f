// Which trees of joints (world/joint_trees.hpp) the native simulator solves directly, and with whom: a mechanism is one
// thread's, that of its group.
#pragma once

#include <cstdint>
#include <fathom/world.hpp>
#include <span>
#include <vector>

#include "dynamics/mechanism.hpp"
#include "native/body_state.hpp"
#include "native/constraint_layout.hpp"
#include "native/contact_graph.hpp"
#include "world/joint_trees.hpp"

namespace fathom::native {

class Mechanisms {
 public:
  Mechanisms(const WorldDef& def, const BodyTable& bodies, BodyState& state, ContactGraph& graph)
      : def_(def), bodies_(bodies), state_(state), graph_(graph) {}

  /// Follows the joints that have colours, and the layout's groups. `has_moved`: the layout is new.
  void update(const ConstraintLayout& layout, bool has_moved);
  /// Some bodies have been isolated: they are obstacles now.
  void find_again(const ConstraintLayout& layout) {
    if (!def_.solver.direct_joints) return;
    find();
    order_by_group(layout);
  }

  bool empty() const { return trees_.mechanisms().empty(); }
  /// Bodies that are solved directly.
  std::size_t links() const { return trees_.links().size(); }
  /// By number, all of them, or those of a group.
  std::span<const std::uint32_t> all() const { return order_; }
  std::span<const std::uint32_t> of_group(std::size_t group) const {
    if (order_.empty()) return {};
    return {order_.data() + first_of_group_[group], order_.data() + first_of_group_[group + 1]};
  }
  /// By slot of a joint, see JointTrees. Null where none is solved directly.
  const std::uint8_t* direct() const { return empty() ? nullptr : trees_.direct().data(); }

  /// Which of its bodies swing in this step (`BodyState::swings`).
  void note_swings(std::uint32_t mechanism);

  /// Bodies that touch something, and how inert that wants them (`MechanismLink::min_inertia`).
  struct Leaning {
    std::uint32_t slot;
    float inertia;  ///< in parts of the body's own
  };
  std::span<const Leaning> leaning() const { return leaning_; }

  /// Those of MechanismSolver.
  void prepare(std::uint32_t mechanism);
  void warm_start(std::uint32_t mechanism, float h, bool forgets);
  void pull_together(std::uint32_t mechanism, float h);
  void relax(std::uint32_t mechanism, float h);
  void store(std::uint32_t mechanism);

  /// Another state has been restored; the trees follow from its joints.
  void find_anew() { is_to_find_ = true; }

  std::size_t memory_bytes() const;

 private:
  struct Access;
  struct Source;

  /// Of a body.
  struct Joints {
    std::uint32_t count = 0;
    bool is_coupled = false;
  };

  bool is_stale() const;
  std::uint32_t constraints_of(std::uint32_t slot) const;
  bool does_swing(const Mechanism& mechanism) const;
  void find();
  void count_joints();
  void find_leaning();
  bool accepts(std::span<const MechanismLink> tree) const;
  void order_by_group(const ConstraintLayout& layout);
  MechanismSolver<Access> solver();
  const Mechanism& mechanism(std::uint32_t number) const { return trees_.mechanisms()[number]; }

  const WorldDef& def_;
  const BodyTable& bodies_;
  BodyState& state_;
  ContactGraph& graph_;
  std::uint64_t colouring_ = 0, joint_definitions_ = 0;
  bool is_to_find_ = false;
  JointTrees trees_;
  std::vector<LinkState> states_;
  std::vector<JointLink> generic_;  // of links with generic joints
  std::vector<float> closures_;     // of LoopClosures
  std::vector<std::uint32_t> order_, first_of_group_;
  std::vector<std::uint32_t> group_of_;
  std::vector<Joints> joints_;  // by slot of a body: those with colours
  std::vector<Leaning> leaning_;
};

}  // namespace fathom::native
