// Which trees of joints (world/joint_trees.hpp) the native simulator solves directly, and on which thread: a mechanism
// belongs to one thread, that of its group.
#pragma once

#include <cstdint>
#include <fathom/world.hpp>
#include <span>
#include <vector>

#include "dynamics/mechanism.hpp"
#include "native/body_state.hpp"
#include "native/constraint_layout.hpp"
#include "native/contact_graph.hpp"
#include "native/link_contacts.hpp"
#include "native/mechanism_lanes.hpp"
#include "world/joint_trees.hpp"

namespace fathom::native {

class Mechanisms {
 public:
  Mechanisms(const WorldDef& def, const BodyTable& bodies, BodyState& state, ContactGraph& graph)
      : def_(def), bodies_(bodies), state_(state), graph_(graph), contacts_(def, bodies, state, graph) {}

  /// Follows coloured joints and the layout's groups. `has_moved`: the layout is new. Without groups, the mechanisms
  /// are divided among `threads`.
  void update(const ConstraintLayout& layout, bool has_moved, std::size_t threads);
  /// Some bodies have been isolated and are obstacles from now on.
  void find_again(const ConstraintLayout& layout, std::size_t threads) {
    if (!def_.solver.direct_joints) return;
    find();
    divide(layout, threads);
  }

  bool empty() const { return trees_.mechanisms().empty(); }
  /// Bodies that are solved directly.
  std::size_t links() const { return trees_.links().size(); }
  /// Batch numbers: all, or those of a group; each batch is solved by one thread.
  std::span<const std::uint32_t> all() const { return batch_numbers_; }
  std::span<const std::uint32_t> of_group(std::size_t group) const {
    if (batches_.empty()) return {};
    return all().subspan(first_of_group_[group], first_of_group_[group + 1] - first_of_group_[group]);
  }
  /// By slot of a joint, see JointTrees. Null if none is solved directly.
  const std::uint8_t* direct() const { return empty() ? nullptr : trees_.direct().data(); }

  /// Notes which of their bodies swing in this step (`BodyState::swings`).
  void note_swings(std::uint32_t batch);
  /// Notes the inertia that torn joints of bodies with contacts require (dynamics/torn_joint.hpp).
  void note_torn(std::uint32_t batch);

  const LinkContacts& contacts() const { return contacts_; }

  /// Calls act(slot, inertia) for bodies that need more than their own inertia, as a multiple of it: those with
  /// contacts that the mechanism does not solve (`MechanismLink::min_inertia`), and those at torn joints.
  template <class Act>
  void for_each_inertia(const Act& act) const {
    for (const Leaning& l : leaning_)
      if (!contacts_.is_loaded(l.slot)) act(l.slot, l.inertia);
    for (std::size_t i = 0; i < torn_.size(); ++i)
      if (torn_[i] > 1) act(trees_.links()[i].body, torn_[i]);
  }

  /// Like those of MechanismSolver.
  void prepare(std::uint32_t batch, const BlockArray& blocks, float h);
  void warm_start(std::uint32_t batch, float h, bool forgets);
  void pull_together(std::uint32_t batch, float h);
  void relax(std::uint32_t batch, float h);
  void store(std::uint32_t batch);

  /// Another state has been restored. The trees follow from its joints.
  void find_anew() { is_to_find_ = true; }

  std::size_t memory_bytes() const;

 private:
  struct Access;
  struct Source;

  struct Leaning {
    std::uint32_t slot;
    float inertia;  ///< as a multiple of the body's own
  };
  /// A body's joints.
  struct Joints {
    std::uint32_t count = 0;
    bool is_coupled = false;
  };

  bool is_stale() const;
  std::uint32_t constraints_of(std::uint32_t slot) const;
  bool is_in_contact(std::uint32_t slot) const;
  bool does_swing(const Mechanism& mechanism) const;
  void find();
  void count_joints();
  void find_leaning();
  bool accepts(std::span<const MechanismLink> tree) const;
  void find_shapes();
  std::vector<std::uint32_t> shape_of(const Mechanism& mechanism) const;
  /// Mechanisms that push the same bodies are solved alone.
  std::uint32_t shape_in_lanes(std::uint32_t number) const {
    return contacts_.cluster(number).size > 1 ? no_shape : shapes_[number];
  }
  void divide(const ConstraintLayout& layout, std::size_t threads);
  void form_batches(const ConstraintLayout& layout, std::size_t threads);
  void give_memory();
  MechanismSolver<Access> solver();
  MechanismLanes lanes(const MechanismBatch& batch, float h = 1);
  const Mechanism& mechanism(std::uint32_t number) const { return trees_.mechanisms()[number]; }
  /// Calls act(mechanism) for each mechanism of the batch.
  template <class Act>
  void each(const MechanismBatch& batch, const Act& act) const {
    for (const std::uint32_t number : batch.numbers) act(mechanism(number));
  }
  /// Solves alone what lanes leave.
  template <class Act>
  void do_alone(const MechanismLanes& lanes, const MechanismBatch& batch, LaneBits which, const Act& act) const;

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
  // Mechanisms in the order of batches, and where each group's batches begin.
  std::vector<std::uint32_t> order_, first_of_group_, batch_numbers_;
  std::vector<MechanismBatch> batches_;
  struct alignas(64) Line {
    unsigned char bytes[64];
  };
  std::vector<Line> batch_memory_;
  static constexpr std::uint32_t no_shape = 0xffffffffu;
  std::vector<std::uint32_t> shapes_;  // by mechanism: equal shapes do the same work in lanes; or no_shape
  std::vector<std::uint32_t> group_of_;
  std::vector<Joints> joints_;  // by slot of a body: its coloured joints
  std::vector<Leaning> leaning_;
  LinkContacts contacts_;
  std::vector<LinkPushes> pushes_;  // by link
  std::vector<float> torn_;         // by link: the inertia that torn joints require
};

}  // namespace fathom::native
