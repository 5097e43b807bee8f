// Resolves contacts and moves the bodies in contact through one step.
//
// Soft step (Catto, "Solver2D", box2d.org 2024; Box2D v3): in every substep velocities are integrated, the last step's
// impulses act, one sweep pushes bodies apart softly, positions are integrated, and one sweep without bias removes the
// push-out velocity. Three things are ours:
//
// * Warm starting costs one sweep per step, not per substep. A contact would apply its accumulated impulses again in
//   the next substep, so all contacts of a body together would repeat the velocity change of this substep. That sum is
//   carried per body (`WarmStart`) and added like an acceleration. For a body without contacts it is exactly zero.
// * Sweeps work in the manifold's own frame (see solver_kernels.cpp).
// * Where sweeps are too soft, structures are held by a direct solution (dynamics/support.hpp).
#pragma once

#include <atomic>
#include <cstddef>
#include <fathom/world.hpp>
#include <functional>
#include <mutex>
#include <span>
#include <vector>

#include "dynamics/body_fault.hpp"
#include "native/constraint_layout.hpp"
#include "native/mechanisms.hpp"
#include "native/solver_kernels.hpp"
#include "native/stand_ins.hpp"
#include "native/support_solver.hpp"
#include "threads/thread_pool.hpp"
#include "world/joint_table.hpp"
#include "world/large_array.hpp"

namespace fathom::native {

struct BodyIntegration;

/// What a substep carries over from earlier impulses: nothing, W brought up to date, or W as it is.
enum class Carry { nothing, to_date, as_is };

using Isolate = std::function<void(std::span<const std::uint32_t>)>;

class ContactSolver {
 public:
  ContactSolver(const WorldDef& def, const BodyTable& bodies, const JointTable& joints, BodyState& state,
                ContactGraph& graph, ThreadPool& pool);

  /// The constraints and their persistent data, including what touch detection needs.
  Constrained constrained();

  // Shared with other ways to iterate over contacts: bodies `in_contact` to and from `BodyState::solver`.
  void load_bodies(std::span<const std::uint32_t> in_contact);
  void carry_impulses(std::span<const std::uint32_t> in_contact, float h);
  void integrate_velocities(std::span<const std::uint32_t> in_contact, float h, Carry carry);
  void integrate_positions(std::span<const std::uint32_t> in_contact, float h);

  /// Whether contacts are laid out by domains, which needs no neighbourhood.
  bool may_use_domains() const { return layout_.may_use_domains(); }
  /// Lays out blocks of constraints, neighbours together, and finds structures that sweeps are too soft for. `step`:
  /// number of the step.
  void lay_out(const BodiesInContact& in_contact, const Neighbourhood& neighbourhood, std::uint64_t step);
  /// Gathers what the sweeps read, unless `solve` will do that group by group.
  void build();
  /// Solves all substeps and stores the impulses to the contacts. Calls act(slots), on any thread, for parts of the
  /// bodies in contact, for which `BodyState::solver` then contains the step's velocities and movement.
  ///
  /// If any body comes out not finite, the result is discarded: isolate(slots) turns such bodies into obstacles that
  /// stay where they are, and everything they could have affected is solved again from the beginning of the step, until
  /// every body is finite. The result is as if they had been removed before.
  void solve(const std::function<void(std::span<const std::uint32_t>)>& act, const Isolate& isolate);

  /// The bodies whose solver state is not finite and that have not been isolated.
  std::span<const std::uint32_t> find_failed(std::span<const std::uint32_t> slots);

  /// For snapshots.
  SupportSolver& supports() { return supports_; }
  const SupportSolver& supports() const { return supports_; }
  Mechanisms& mechanisms() { return mechanisms_; }
  const Mechanisms& mechanisms() const { return mechanisms_; }

  int colours_in_use() const { return layout_.colours(); }
  std::size_t point_count() const { return point_count_; }
  std::size_t memory_bytes() const {
    return block_memory_.capacity() + bounces_.capacity() * sizeof(float) + layout_.memory_bytes() +
           stand_ins_.memory_bytes() + supports_.memory_bytes() + mechanisms_.memory_bytes();
  }

 private:
  using Sweep = void (*)(BlockArray, std::size_t, std::size_t, SolverBody*, const SweepParameters&);
  using Group = ConstraintLayout::Group;
  using Unit = ConstraintLayout::Unit;

  /// What a solver iterates over in every substep: all bodies and colours, on all threads, by domain or colour by
  /// colour, or those of a group.
  class Everything;
  class InDomains;
  class OneGroup;

  template <class Act>
  void for_each_fetched(std::span<const std::uint32_t> slots, const Act& act);
  template <class Act>
  void for_each_number(std::span<const std::uint32_t> numbers, const Act& act);
  template <class Act>
  void for_each_group(const Act& act);
  std::size_t number_of(const Group& group) const { return static_cast<std::size_t>(&group - layout_.groups().data()); }
  std::size_t number_of(const Unit& unit) const { return static_cast<std::size_t>(&unit - layout_.units().data()); }
  template <class Act>
  void for_each_part_of_kinematic(const Act& act);
  /// Whether contacts may be overloaded and have lifts.
  bool watches_loads() const;
  LoadWatch load_watch();
  std::size_t block_bytes(const SolverKernels& kernels) const;
  void make_room_for_blocks();
  BodiesView view();
  /// In a sweep, joints to fixed bodies (axles with their drives) come after those between moving ones (gears). Unless
  /// a gear has the last word, it yields to them, and what it drives never reaches an even speed.
  bool couplings_follow() const { return joints_.coupling_count() > 0; }
  const std::uint8_t* swings() const { return joints_.count() > 0 ? state_.swings.data() : nullptr; }
  void load_body(std::uint32_t slot);
  void load_extras(std::uint32_t slot);
  void load_kinematic();
  void note_swings();
  void add_inertia(std::uint32_t slot, float inverse_scale);
  void load_group(std::span<const std::uint32_t> slots);
  std::size_t prepare(std::size_t begin, std::size_t end);
  void build_in_domains();
  void prepare_all();
  std::size_t prepare_group(const Group& group);
  /// All substeps of all bodies; returns whether all came out finite.
  bool solve_all();
  template <class Act>
  void solve_groups(const Act& act, const Isolate& isolate);
  template <class Act>
  void finish_group(const Group& group, const Act& act);
  template <class Act>
  void finish_all(const Act& act);
  template <class Act>
  void finish_domains(const Act& act);
  bool all_finite(std::span<const std::uint32_t> slots) const;
  /// Whether there were any. Isolated bodies may stay non-finite where their constraints are: they do not move.
  bool isolate_failed(std::span<const std::uint32_t> slots, const Isolate& isolate);
  void hold_isolated(std::span<const std::uint32_t> slots);
  template <class Work>
  void substeps(const Work& work);
  template <bool fails, class Work>
  void solve_soft(const Work& work, float h);
  template <bool fails, class Work>
  void solve_impulse(const Work& work, float h);
  /// Bounces, then integrates velocities.
  template <class Work>
  void begin_substep(const Work& work, const BodyIntegration& integrate, SweepParameters parameters, bool first);
  /// Applies the impulses at the start of a substep: the last step's, or none without warm starting.
  template <class Work>
  void begin_impulses(const Work& work, float h, bool first_substep);
  template <class Work>
  void sweep(const Work& work, Sweep SolverKernels::*pass, const SweepParameters& parameters);
  template <class Work>
  void fail(const Work& work, SolverStage stage, int substep);
  BodyIntegration integration(float h);

  const WorldDef& def_;
  const BodyTable& bodies_;
  const JointTable& joints_;
  BodyState& state_;
  ContactGraph& graph_;
  ThreadPool& pool_;
  const SolverKernels& wide_;
  const SolverKernels& single_;
  LargeArray<std::byte> block_memory_;  // first touched by the thread that prepares each block
  std::vector<float> bounces_;
  BlockArray wide_blocks_, single_blocks_;
  std::size_t single_count_ = 0;
  std::vector<std::uint32_t> overflow_;
  ConstraintLayout layout_;
  StandIns stand_ins_;
  SupportSolver supports_;
  Mechanisms mechanisms_;
  std::vector<std::uint32_t> failed_;  // bodies
  std::vector<const Group*> failed_groups_;
  std::mutex failed_mutex_;
  bool any_isolated_ = false;           // in this step
  std::atomic<bool> any_fast_ = false;  // of the bodies loaded so far in this step
  // Counted by all threads, which read the members above.
  alignas(2 * 64) std::atomic<std::size_t> point_count_ = 0;
};

}  // namespace fathom::native
