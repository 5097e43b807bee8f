// The native simulator: rigid bodies on the CPU's cores and vector lanes.
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <vector>

#include "native/active_set.hpp"
#include "native/body_state.hpp"
#include "native/body_tree.hpp"
#include "native/broad_phase.hpp"
#include "native/cell_solver.hpp"
#include "native/changed_bodies.hpp"
#include "native/contact_changes.hpp"
#include "native/contact_graph.hpp"
#include "native/heap_division.hpp"
#include "native/islands.hpp"
#include "native/move_bodies.hpp"
#include "native/narrow_phase.hpp"
#include "native/neighbourhood.hpp"
#include "native/pre_solve.hpp"
#include "native/solver.hpp"
#include "native/thread_budget.hpp"
#include "threads/thread_pool.hpp"
#include "world/simulator.hpp"

namespace fathom {
enum class HoldBack : std::uint8_t;  // dynamics/free_way.hpp
}  // namespace fathom

namespace fathom::native {

class NativeSimulator : public Simulator {
 public:
  explicit NativeSimulator(const WorldDef& definition);

  void step() override;
  void save(ByteWriter& write) const override;
  void restore(ByteReader& in) override;

  void reserve(std::uint32_t count) override { state_.reserve(count); }
  void optimize_broad_phase() override;
  void body_added(std::uint32_t slot, const Pose& pose, const Velocity& velocity) override;
  void body_removed(std::uint32_t slot) override;
  void set_pose(std::uint32_t slot, const Pose& pose) override;
  void set_velocity(std::uint32_t slot, const Velocity& velocity) override;
  void move_to(std::uint32_t slot, const Pose& pose) override;
  void material_changed(std::uint32_t slot) override;
  void filter_changed(std::uint32_t slot) override;
  void info_changed(std::uint32_t slot) override;
  void mass_changed(std::uint32_t slot) override;
  void gravity_changed() override;
  void wake(std::uint32_t slot) override;
  bool is_awake(std::uint32_t slot) const override { return state_.flags[slot] & awake; }
  void apply(std::uint32_t slot, Vec3 force, Vec3 torque) override;

  void joint_added(std::uint32_t slot) override;
  void pair_excluded(std::uint32_t a, std::uint32_t b) override;
  void pair_included(std::uint32_t a, std::uint32_t b) override;
  void joint_removed(std::uint32_t slot) override;
  void joint_changed(std::uint32_t slot) override;
  JointReaction joint_impulse(std::uint32_t slot) const override;

  std::span<const Pose> poses() const override { return state_.poses; }
  std::span<const Velocity> velocities() const override { return state_.velocities; }
  Aabb bounds(std::uint32_t slot) const override;

  std::span<const ContactEvent> contacts_begun() const override { return {begun_.begin(), begun_.size()}; }
  std::span<const ContactEvent> contacts_ended() const override { return {ended_.begin(), ended_.size()}; }
  std::span<const HitEvent> hits() const override { return {hits_.begin(), hits_.size()}; }
  std::span<const Quarantine> quarantined() const override { return quarantined_; }
  void for_each_contact(const std::function<void(const ContactInfo&)>& visit) const override;
  void for_each_contact_of(std::uint32_t slot, const std::function<void(const ContactInfo&)>& visit) override;

  void visit_bodies(const MovingBox& box, BodyVisitor& visitor) const override { tree_.visit(box, visitor); }
  void divide_query(std::size_t count, const std::function<void(std::size_t, std::size_t)>& run) const override;

 protected:
  /// Without a broad phase, `set_broad_phase` must be called before anything else.
  NativeSimulator(const WorldDef& definition, std::unique_ptr<BroadPhase> broad_phase);
  void set_broad_phase(std::unique_ptr<BroadPhase> broad_phase) { broad_phase_ = std::move(broad_phase); }

  // The verbs of a step.
  void find_pairs();
  void find_new_pairs();
  virtual void update_manifolds();
  void find_seams();

  NarrowPhase narrow_phase(ContactChanges::Block& block) {
    return {bodies, state_,      def.dt,     block.begun,         block.fast,
            graph_, block.ended, block.gone, block.has_new_parts, seams_};
  }
  bool is_active(const Contact& c) const { return (state_.flags[c.a] | state_.flags[c.b]) & awake; }

  BodyState state_;
  ContactGraph graph_;
  ContactChanges changes_;  // what this step's narrow phase found
  mutable ThreadPool pool_;
  bool lists_added_ = false;          // for derived classes that ask for it
  std::vector<std::uint32_t> added_;  // contacts found by this step's search

 private:
  void build_constraints();
  void solve();
  void finish();

  /// Moves bodies by the solver's result, or by gravity alone.
  template <bool in_contact>
  void move_part(std::span<const std::uint32_t> slots);
  /// Moves all bodies that the solver does not, while the calling thread begins with alone().
  template <class Alone>
  void move_free(const Alone& alone);
  void lay_out_constraints();
  int threads_worth_while();
  BroadPhaseInput broad_phase_input() const;
  std::span<const Pose> refresh_queries() override;
  void note_moved(std::uint32_t slot);
  void note_set(std::uint32_t slot);
  std::span<const Pair> joined(std::span<const std::vector<Pair>> lists);
  /// The new pairs that the application lets collide, if it is asked.
  std::span<const Pair> let_collide(std::span<const Pair> pairs);
  bool lets_collide(std::uint32_t a, std::uint32_t b);
  /// apply_changes.cpp
  void apply_changes();
  void begin_one_by_one();
  void make_first_manifolds(std::size_t part, std::size_t parts, bool wakes_any);
  bool is_asleep(std::uint32_t slot) const;
  void first_manifold(const NewManifold& fresh, ContactManifold& manifold);
  void drop_contact(std::uint32_t index, std::vector<ContactEvent>& ended);
  void keep_apart(std::uint32_t a, std::uint32_t b);
  void keep_apart_no_more(std::uint32_t a, std::uint32_t b);
  ContactInfo contact_info(std::uint32_t index) const;
  ContactEvent event(std::uint32_t a, std::uint32_t b) const;
  /// touch_events.cpp
  void report_touches();
  void report_parts(TouchChanges& changes);
  void report_touches(std::span<std::uint64_t> bits, LargeArray<ContactEvent>& events, bool touch);
  void report_hits();
  void set_state(std::uint32_t slot, const Pose& pose, const Velocity& velocity);
  void isolate(std::uint32_t slot);
  void isolate_moved();
  // fast_pairs.cpp
  void hold_back_fast();
  bool is_free(const FastPair& pair) const;
  void hold_back_free(const FastPair& pair, bool heavier);
  void hold_back_strays();
  void hold_back_stray(const Strays::Stray& stray, const std::vector<std::uint32_t>& kinematic_bodies);
  std::vector<std::uint32_t> obstacles_of(const Strays::Stray& stray,
                                          const std::vector<std::uint32_t>& kinematic_bodies);
  Pose begin_of_obstacle(std::uint32_t slot) const;
  bool hold_back(const Strays::Stray& stray, std::uint32_t obstacle, HoldBack how);
  bool hold_back(const FastPair& pair, HoldBack how);
  void put_back(std::uint32_t slot, const Pose& pose, Velocity v);
  bool hold_back_from_surface(const FastPair& pair);  // parted_pairs.cpp
  void forget_build(std::uint32_t first);
  void isolate_on_request();
  /// checks.cpp
  void validate() const;
  void validate_bodies() const;
  void validate_contacts() const;
  void validate_colours() const;
  bool was_solved(const Contact& c) const;
  /// Kinematic bodies moved by `move_to` stop at their targets.
  void arrive();
  /// Wakes the island of a sleeping body.
  void wake_island(std::uint32_t slot);
  /// Wakes sleeping bodies that touch the body or are joined to it.
  void wake_neighbours(std::uint32_t slot);
  /// joints.cpp
  void define_joint(std::uint32_t slot, std::uint32_t ignoring = none);
  /// Redefines couplings whose exclusive use of their bodies may have changed.
  void define_couplings_beside(std::uint32_t joint, std::uint32_t ignoring = none);
  void wake_joined(std::uint32_t joint);
  void restore_joints(ByteReader& in);
  /// Wakes sleeping bodies that a fixed body was added to or moved into.
  void wake_below_fixed();
  void count();
  std::size_t list_bytes() const;

  ThreadBudget threads_;
  HeapDivision division_;
  std::unique_ptr<BroadPhase> broad_phase_;
  BodyTree tree_;                // for queries
  mutable std::mutex dividing_;  // held by the query that uses the threads
  Seams seams_{bodies, state_, joints, excluded, def.dt};
  ContactSolver solver_;
  std::optional<CellSolver> cell_solver_;  // replaces `solver_` with the partition `cells`
  Islands islands_;
  PreSolve pre_solve_;

  ActiveSet active_;
  ChangedBodies changed_;
  Neighbourhood neighbourhood_;
  Strays strays_;
  std::atomic<std::size_t> failed_ = 0;     // bodies whose new state is not finite
  bool are_free_moved_ = false;             // in this step, before `finish`
  std::vector<std::uint32_t> set_changes_;  // bodies added or removed since the broad phase last ran
  /// Target of a kinematic body at the end of the next step.
  struct Target {
    Pose pose;
    std::uint32_t slot = none;
    std::uint32_t unused[3] = {};  // in place of padding, which snapshots would include
  };
  std::vector<Target> targets_;               // a body's last target counts
  std::vector<std::uint32_t> forced_;         // bodies with a force
  std::vector<std::vector<Pair>> new_pairs_;  // per chunk of the broad phase
  std::vector<Pair> pairs_to_add_, pairs_let_;

  std::vector<ContactEvent> ended_by_removal_;
  LargeArray<ContactEvent> begun_, ended_;
  LargeArray<HitEvent> hits_;
  std::vector<std::size_t> event_offsets_;  // of each thread's part; kept for its memory
  std::vector<Quarantine> quarantined_;
};

}  // namespace fathom::native
