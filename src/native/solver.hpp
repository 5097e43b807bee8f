// Resolves contacts and moves the bodies in contact through one step.
//
// Soft step (Catto, "Solver2D", box2d.org 2024; Box2D v3): in every substep velocities are integrated, last step's
// impulses act, one sweep pushes bodies apart softly, positions are integrated, and one sweep without bias takes
// the push-out velocity away again. Three things are ours:
//
// * Warm starting costs one sweep a step, not one a substep. The impulses that a contact would apply again in
//   the next substep are the accumulated ones, so all contacts of a body together would change its velocity by what
//   they changed it by in this substep. That sum is carried per body (`WarmStart`) and added as if it were an
//   acceleration. For a body without contacts it is exactly zero.
// * Sweeps are in the manifold's own frame (see solver_kernels.cpp).
// * After every sweep, columns are braced by a direct solution (dynamics/columns.hpp).
#pragma once

#include <atomic>
#include <cstddef>
#include <fathom/world.hpp>
#include <functional>
#include <vector>

#include "native/columns.hpp"
#include "native/constraint_layout.hpp"
#include "native/solver_kernels.hpp"
#include "threads/thread_pool.hpp"
#include "world/large_array.hpp"

namespace fathom::native {

struct BodyIntegration;

/// What a substep carries over of the impulses before it: nothing, W brought up to date, or W as it is.
enum class Carry { nothing, to_date, as_is };

/// Part of a penetration that a substep's bias takes away (Catto, "Iterative Dynamics with Temporal Coherence", 2005).
inline constexpr float baumgarte = 0.2f;

class ContactSolver {
 public:
  ContactSolver(const WorldDef& def, const BodyTable& bodies, BodyState& state, ContactGraph& graph, ThreadPool& pool);

  // What other ways to go through the contacts share: bodies `in_contact` to and from `BodyState::solver`.
  void load_bodies(std::span<const std::uint32_t> in_contact);
  void carry_impulses(std::span<const std::uint32_t> in_contact, float h);
  void integrate_velocities(std::span<const std::uint32_t> in_contact, float h, Carry carry);
  void integrate_positions(std::span<const std::uint32_t> in_contact, float h);

  /// Lays out blocks of constraints, neighbours together, and finds columns.
  void lay_out(const BodiesInContact& in_contact, const Neighbourhood& neighbourhood);
  /// Gathers what the sweeps read, unless `solve` will do that group by group.
  void build();
  /// All substeps; hands the impulses back to the contacts and calls act(slots), by any thread, for parts of the bodies
  /// in contact, for which `BodyState::solver` then holds velocities and movement of the step.
  void solve(const std::function<void(std::span<const std::uint32_t>)>& act);

  int colours_in_use() const { return layout_.colours(); }
  std::size_t point_count() const { return point_count_; }
  std::size_t memory_bytes() const {
    return block_memory_.capacity() + bounces_.capacity() * sizeof(float) + layout_.memory_bytes() +
           columns_.memory_bytes();
  }

 private:
  using Sweep = void (*)(BlockArray, std::size_t, std::size_t, SolverBody*, const SweepParameters&);
  using Group = ConstraintLayout::Group;
  using Unit = ConstraintLayout::Unit;

  /// What a solver goes over in every substep: all bodies and colours, by all threads, in domains or colour by colour,
  /// or those of a group.
  class Everything;
  class InDomains;
  class OneGroup;

  template <class Act>
  void for_each_fetched(std::span<const std::uint32_t> slots, const Act& act);
  template <class Act>
  void for_each_group(const Act& act);
  std::size_t block_bytes(const SolverKernels& kernels) const;
  void make_room_for_blocks();
  BodiesView view();
  void load_body(std::uint32_t slot);
  void load_group(std::span<const std::uint32_t> slots);
  void prepare(std::size_t begin, std::size_t end);
  void build_in_domains();
  template <class Act>
  void solve_in_domains(const Act& act);
  template <class Work>
  void substeps(const Work& work);
  template <class Work>
  void solve_soft(const Work& work, float h);
  template <class Work>
  void solve_impulse(const Work& work, float h);
  /// Strikes, and velocities integrated.
  template <class Work>
  void begin_substep(const Work& work, const BodyIntegration& integrate, SweepParameters parameters, bool first);
  /// Impulses of a substep's beginning: those of the step before, or none without warm starting.
  template <class Work>
  void begin_impulses(const Work& work, bool first_substep);
  template <class Work>
  void sweep(const Work& work, Sweep SolverKernels::*pass, const SweepParameters& parameters);
  template <class Work>
  void brace(const Work& work, bool pushes_out, const SweepParameters& parameters);
  BodyIntegration integration(float h);

  const WorldDef& def_;
  const BodyTable& bodies_;
  BodyState& state_;
  ContactGraph& graph_;
  ThreadPool& pool_;
  const SolverKernels& wide_;
  const SolverKernels& single_;
  LargeArray<std::byte> block_memory_;  // whoever prepares a block touches it first
  std::vector<float> bounces_;
  BlockArray wide_blocks_, single_blocks_;
  std::size_t single_count_ = 0;
  std::vector<std::uint32_t> overflow_;
  ConstraintLayout layout_;
  Columns columns_;
  // Counted by all threads, who read what is above.
  alignas(2 * 64) std::atomic<std::size_t> point_count_ = 0;
};

}  // namespace fathom::native
