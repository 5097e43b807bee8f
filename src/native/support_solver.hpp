// Structures at rest, held by a direct solution after every relax sweep (dynamics/support.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "dynamics/support.hpp"
#include "native/constraint_fields.hpp"
#include "native/constraint_layout.hpp"
#include "native/solver_kernels.hpp"
#include "native/support_graph.hpp"

namespace fathom::native {

class SupportSolver {
 public:
  SupportSolver(const WorldDef& def, const BodyTable& bodies, BodyState& state, const ContactGraph& graph,
                ThreadPool& pool)
      : def_(def), bodies_(bodies), state_(state), graph_(graph), support_graph_(bodies, state, graph, pool) {}

  Overloads& overloads() { return overloads_; }
  const Overloads& overloads() const { return overloads_; }
  /// ω² / g of contacts in this step, as for `sweep_load` (1/m); 0 without gravity.
  float stiffness() const { return stiffness_; }

  /// Finds structures among the bodies in contact, and their constraints in the layout. `has_moved`: the layout has
  /// changed since the last step.
  void update(std::span<const std::uint32_t> in_contact, const ConstraintLayout& layout, bool has_moved,
              std::uint64_t step);

  /// Bodies get back momentum that their added inertia has taken up; before the solver loads bodies, and once all
  /// inertia of the step is known.
  void give_back_momentum() {
    if (overloads_.may_owe()) give_back();
  }

  bool empty() const { return structures_.empty(); }
  /// Structure numbers: all, or those of a group.
  std::span<const std::uint32_t> all() const { return order_; }
  std::span<const std::uint32_t> of_group(std::size_t group) const {
    if (order_.empty()) return {};
    return {order_.data() + first_of_group_[group], order_.data() + first_of_group_[group + 1]};
  }
  /// By slot, how far a body's structure was held in the last step; below 0 for bodies in none. Null if there are none.
  const float* held() const { return empty() ? nullptr : held_.data(); }

  const std::uint16_t* levels() const { return support_graph_.levels(); }
  std::span<const float> heaviest() const { return support_graph_.heaviest(); }

  /// Reads what a step's solutions share, once blocks are prepared. `h`: a substep (s).
  void prepare(std::uint32_t structure, const SolverKernels& kernels, BlockArray blocks, float h);
  /// Brings the structure to its common motion, as far as its contacts can.
  void solve(std::uint32_t structure);
  /// The step is solved again without these bodies, which have just been isolated. Their structures are not held, as in
  /// later steps.
  void let_go(std::span<const std::uint32_t> isolated_slots);
  /// After the last substep.
  void finish(std::uint32_t structure);
  /// After all structures of the step with this number; bodies may have been isolated in it.
  void end_step(std::uint64_t step, bool any_isolated) {
    if (overloads_.any_scaled()) take_up();
    if (any_isolated || !empty()) rest_if_none_is_held(step, any_isolated);
  }

  std::size_t memory_bytes() const;

  template <class Self, class Archive>
  static void archive(Self& s, Archive& a) {
    Overloads::archive(s.overloads_, a);
    SupportGraph::archive(s.support_graph_, a);
    a(s.held_);
  }
  void restore(ByteReader& in, std::size_t slots);

 private:
  struct Body {
    Vec3 target_linear, target_angular;  ///< the structure's common motion
    Vec3 linear_change, angular_change;  ///< of velocity, by the last solution
    Vec3 carried;                        ///< `CarriedAlong::acceleration`
    Mat3 inertia;                        ///< world axes
    SymMat3 inverse_inertia;
    float mass = 0;
    bool is_held = false;
    Triangle6 factor;
    Wrench gained;  ///< N·s and N·m·s about the centre
  };
  struct Contact {
    LaneFields fields;
    SupportRows rows;
    SupportChange change;
    Wrench given;  ///< to the upper body, about the contact
    int count = 0;
    bool acts = false;
  };
  /// The common motion of what a structure stands on.
  struct Base {
    Vec3 position, linear, angular;
  };
  class SupportsOf;

  const SupportGraph::Member& member(std::uint32_t i) const { return support_graph_.members()[i]; }
  float inverse_mass(std::uint32_t i) const { return state_.solver_bodies()[member(i).slot].inverse_mass; }
  /// Awake and without joints.
  bool is_free(std::uint32_t slot) const { return (state_.flags[slot] & (awake | jointed)) == awake; }
  void give_back();
  void take_up();
  void rest_if_none_is_held(std::uint64_t step, bool any_isolated);
  float contact_stiffness() const;  ///< see `stiffness`
  void find_bases();
  void carry_along(std::uint64_t step);
  void choose_held();
  void find_lanes(const ConstraintLayout& layout);
  void order_by_group(const ConstraintLayout& layout);
  bool may_move() const;
  bool is_press(const SupportGraph::Support& support) const;
  static bool moves_along(const Base& a, const Base& b);
  bool find_base(const SupportGraph::Structure& s, Base& base) const;
  bool goes_along(std::uint32_t contact, Base& base) const;
  Vec3 velocity_against(const Base& base, std::uint32_t slot) const;
  bool is_calm(const SupportGraph::Structure& s, const Base& base) const;
  void load_body(std::uint32_t i, const Base& base);
  float speed_of(std::uint32_t i, Vec3 arm) const;
  void load_supports(std::uint32_t i, float fall, float h);
  bool load_rows(std::uint32_t support, float body_weight);
  static ContactImpulses impulses(const LaneFields& fields, int count);

  const WorldDef& def_;
  const BodyTable& bodies_;
  BodyState& state_;
  const ContactGraph& graph_;
  Overloads overloads_;
  SupportGraph support_graph_;
  std::vector<float> held_;                // by slot
  std::vector<std::uint32_t> held_slots_;  // whose `held_` may differ from `not_a_member`
  std::vector<float> last_held_;           // by member, in the last step
  struct StructureState {
    bool has_base = false;  ///< all that it rests on moves as one
    bool is_held = false;
    bool was_made = false;       ///< a solution of this step was worth making
    bool is_left_alone = false;  ///< the step's first was not: there are no others
    float part = 0;              ///< of the last possible solution
    float held = 0;              ///< see `part_held`
    float fall = 0;              ///< m/s, velocity from gravity in a substep
    Base base;
  };
  float stiffness_ = 0;  ///< see `stiffness`
  std::vector<StructureState> structures_;
  std::vector<Body> body_;              // by member
  std::vector<Contact> contact_;        // by support
  std::vector<std::uint32_t> lane_of_;  // by contact
  std::vector<std::uint32_t> lanes_;    // by support
  std::vector<std::uint32_t> order_, first_of_group_;
};

}  // namespace fathom::native
