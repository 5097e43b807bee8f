// Mechanisms: bodies that rigid joints connect to a tree, solved directly (dynamics/joint_tree.hpp) where sweeps would
// give way. A joint that closes a loop is left to the sweeps, and so is a net, where such joints are many.
//
// A direct solution takes the place of the joints' rows in a sweep, after the contacts': bodies leave it with
// velocities that all joints agree with. Its substep is that of the rows (dynamics/ball_joint-inl.hpp).
#pragma once

#include <cstdint>
#include <fathom/world.hpp>
#include <span>
#include <vector>

#include "dynamics/ball_joint.hpp"
#include "dynamics/joint_tree.hpp"
#include "native/body_state.hpp"
#include "native/constraint_layout.hpp"
#include "native/contact_graph.hpp"
#include "native/joint_links.hpp"

namespace fathom::native {

class Mechanisms {
 public:
  static constexpr std::uint8_t driven = 1, undriven = 2;

  Mechanisms(const WorldDef& def, const BodyTable& bodies, BodyState& state, ContactGraph& graph)
      : def_(def), bodies_(bodies), state_(state), graph_(graph) {}

  /// Follows the joints that have colours, and the layout's groups. `has_moved`: the layout is new.
  void update(const ConstraintLayout& layout, bool has_moved);
  /// Some bodies have been isolated: they are obstacles now.
  void find_again(const ConstraintLayout& layout) {
    find();
    order_by_group(layout);
  }

  bool empty() const { return mechanisms_.empty(); }
  /// By number, all of them, or those of a group.
  std::span<const std::uint32_t> all() const { return order_; }
  std::span<const std::uint32_t> of_group(std::size_t group) const {
    if (order_.empty()) return {};
    return {order_.data() + first_of_group_[group], order_.data() + first_of_group_[group + 1]};
  }
  /// By slot of a joint, above 0: it is solved here; `undriven` where no drive moves its mechanism. Null where none is.
  const std::uint8_t* direct() const { return empty() ? nullptr : direct_.data(); }

  /// Reads joints and bodies as the step begins.
  void prepare(std::uint32_t mechanism);
  /// The last step's impulses act again, or are forgotten.
  void warm_start(std::uint32_t mechanism, bool forget);
  /// Before positions move, and after.
  void pull_together(std::uint32_t mechanism, float h) { solve<true>(mechanism, h); }
  void relax(std::uint32_t mechanism, float h) {
    move_obstacles(mechanisms_[mechanism], h);
    solve<false>(mechanism, h);
  }
  void store(std::uint32_t mechanism);

  /// Whether the next step goes on with the trees that there are, of which some may have parted since they were found.
  /// That is all that snapshots hold of them.
  bool keeps_trees() const { return !is_stale() && !any_parted_; }
  void restore(bool keeps_trees);

  std::size_t memory_bytes() const;

 private:
  /// A body of a tree, and the joint to its parent.
  struct Link {
    std::uint32_t slot;      ///< of the body
    std::uint32_t joint;     ///< none: the root of a tree that hangs on nothing
    std::uint32_t parent;    ///< link, or none where that is an obstacle
    std::uint32_t obstacle;  ///< slot of it
    std::uint32_t generic;   ///< of `generic_`, or none: a ball joint, or no joint
    bool is_b;               ///< the body is the joint's B
    std::uint32_t joints;    ///< of the tree, at the body
  };
  struct Mechanism {
    std::uint32_t first, end;  ///< links, parents before children
  };
  /// Of a link, in a step.
  struct LinkState {
    BallJointRow<float> row;  ///< of a ball joint; A: the parent, B: the body; impulses on B
    float mass;               ///< kg
    float inertia;            ///< kg·m², the largest moment, about
    UnitQuat<float> turned;   ///< since the step began
    UnitQuat<float> spin;     ///< from the axes in which the body's spin is written to the world's
    LinkMotion motion;
    LinkMotion obstacle;         ///< of what the link hangs on, which other threads may have moved on or not
    Vec3 arm, parent_arm;        ///< m, now
    Vec3 moment, parent_moment;  ///< N·m·s that the joint has given so far, as the body and, reversed, its parent spin
    TreeInertia of_body;
    TreeLink link;
    TreeLoad load;
    Vec3 error;               ///< m/s
    TreeChange step, change;  ///< of a round, and of all of them
    Vec3 impulse;             ///< N·s, of all rounds
  };

  /// Of a body's joints.
  struct JointColours {
    std::uint32_t mask = 0, overflow = 0;
    bool is_coupled = false;
  };

  bool is_stale() const;
  void find();
  std::vector<std::uint32_t> free_roots() const;
  void count_joints();
  bool is_in_contact(std::uint32_t slot) const;
  bool leans_on_light_bodies(std::uint32_t first_link) const;
  bool has_parted(std::uint32_t first_link) const;
  bool is_coupled(std::uint32_t first_link) const;
  bool can_be_direct(std::uint32_t joint) const;
  void grow_tree(std::uint32_t root_slot, std::uint32_t root_joint);
  bool is_obstacle(std::uint32_t slot) const;
  void order_by_group(const ConstraintLayout& layout);
  template <bool soft>
  void solve(std::uint32_t mechanism, float h);
  void prepare_ball(std::uint32_t link);
  void prepare_generic(std::uint32_t link);
  /// What the link's joint has given its body in this substep.
  Vec3 force_of(std::uint32_t link) const;
  Vec3 torque_of(std::uint32_t link) const;
  /// Whether the pull of its joint may swing the link's body.
  bool may_swing(std::uint32_t link) const;
  void turn(LinkState& s, const Link& link) const;
  void move_obstacles(const Mechanism& m, float h);
  JointBodies<SymMat3> bodies_of(std::uint32_t link) const;
  const LinkMotion& parent_of(std::uint32_t link) const;
  static Vec3 speed_apart(const LinkState& s, const LinkMotion& parent);
  static Vec3 gap(const LinkState& s, const LinkMotion& parent);
  static Vec3 gap_ahead(const LinkState& s, const LinkMotion& parent, float h);
  void load_carried(const Mechanism& m);
  void stiffen(const Mechanism& m, float h);
  void stiffen_load(const Mechanism& m, float h);
  void turn_all(const Mechanism& m, float h, bool relaxes);
  void eliminate(const Mechanism& m);
  void substitute(const Mechanism& m);
  void take_back(const Mechanism& m);
  bool can_follow(const Mechanism& m, float h) const;
  bool do_meet(const Mechanism& m, float h) const;
  bool revise(const Mechanism& m, float h);
  void aim_ahead(const Mechanism& m, float h);
  void aim_at_rest(const Mechanism& m, float gap_share, float h);
  template <bool soft>
  void solve_once(const Mechanism& m, float h, bool follows);
  template <bool soft>
  void apply(const Mechanism& m, float h, bool follows);
  void forget(const Mechanism& m);

  const WorldDef& def_;
  const BodyTable& bodies_;
  BodyState& state_;
  ContactGraph& graph_;
  std::uint64_t colouring_ = 0, joint_definitions_ = 0;
  bool any_parted_ = false;   // of trees that would be solved directly
  bool is_restored_ = false;  // the trees have to be found as they were
  bool keeps_parted_ = false;
  std::vector<Link> links_;
  std::vector<LinkState> states_;
  std::vector<JointLink> generic_;  // of links with generic joints
  std::vector<Mechanism> mechanisms_;
  std::vector<std::uint32_t> order_, first_of_group_;
  std::vector<std::uint8_t> direct_;         // by joint
  std::vector<std::uint32_t> link_of_;       // by slot of a body, or none
  std::vector<std::uint32_t> joints_first_;  // by slot of a body: where its joints begin in `joints_of_`
  std::vector<std::uint32_t> joints_of_;
  std::vector<std::uint32_t> group_of_;
  std::vector<JointColours> joint_colours_;  // by slot of a body
};

}  // namespace fathom::native
