// Resolves contacts and moves the bodies in contact through one step.
//
// Soft step (Catto, "Solver2D", box2d.org 2024; Box2D v3): in every substep velocities are integrated, last step's
// impulses act, one sweep pushes bodies apart softly, positions are integrated, and one sweep without bias takes
// the push-out velocity away again. Two things are ours:
//
// * Warm starting costs one sweep a step, not one a substep. The impulses that a contact would apply again in
//   the next substep are the accumulated ones, so all contacts of a body together would change its velocity by what
//   they changed it by in this substep. That sum is carried per body (`WarmStart`) and added as if it were an
//   acceleration. For a body without contacts it is exactly zero.
// * Sweeps are in the manifold's own frame (see solver_kernels.cpp).
#pragma once

#include <atomic>
#include <cstddef>
#include <fathom/world.hpp>
#include <vector>

#include "native/contact_graph.hpp"
#include "native/neighbourhood.hpp"
#include "native/solver_kernels.hpp"
#include "threads/thread_pool.hpp"

namespace fathom::native {

class ContactSolver {
 public:
  ContactSolver(const WorldDef& def, const BodyTable& bodies, BodyState& state, ContactGraph& graph, ThreadPool& pool);

  /// Gathers what the sweeps read: bodies `in_contact` and blocks of constraints by colour, neighbours together.
  void build(std::span<const std::uint32_t> in_contact, const Neighbourhood& neighbourhood);
  /// All substeps. Afterwards `BodyState::solver` holds velocities and movement of the step.
  void solve(std::span<const std::uint32_t> in_contact);
  /// Hands the impulses back to the contacts.
  void store();

  int colours_in_use() const { return colours_in_use_; }
  std::size_t point_count() const { return point_count_; }
  std::size_t memory_bytes() const {
    return blocks_.capacity() + bounces_.capacity() * sizeof(float) + lanes_.capacity() * sizeof(std::uint32_t) +
           offsets_.capacity() * sizeof(Neighbourhood::Offsets) + cuts_.capacity() * sizeof(std::size_t);
  }

 private:
  struct Stretch {  // blocks of one colour
    std::size_t first, end;
    int colour;
    std::size_t shares = 1;  // threads it is shared out to
  };
  using Sweep = void (*)(BlockArray, std::size_t, std::size_t, SolverBody*, const SweepParameters&);

  std::size_t least_blocks() const;
  void lay_out_blocks(const Neighbourhood& neighbourhood);
  void fill_lanes(const Neighbourhood& neighbourhood);
  void share_out_bodies(std::span<const std::uint32_t> in_contact, const Neighbourhood& neighbourhood);
  void share_out();
  std::size_t* cuts(std::size_t stretch) {
    return cuts_.data() + stretch * (static_cast<std::size_t>(pool_.thread_count()) + 1);
  }
  /// Calls act(begin, end) for blocks of all colours, by the threads that will sweep them.
  template <class Act>
  void for_each_share(const Act& act);
  /// Calls act(slot) for bodies, by the threads that have most of their contacts.
  template <class Act>
  void for_each_body(std::span<const std::uint32_t> in_contact, const Act& act);
  void load_body(std::uint32_t slot);
  void solve_soft(std::span<const std::uint32_t> in_contact, float h);
  void solve_impulse(std::span<const std::uint32_t> in_contact, float h);
  void integrate_velocities(std::span<const std::uint32_t> in_contact, float h, bool first);
  void integrate_positions(std::span<const std::uint32_t> in_contact, float h);
  /// Calls kernel(kernels, blocks, begin, end) over the overflow, then colour by colour.
  template <class Kernel>
  void for_each_colour(const Kernel& kernel);
  void sweep(Sweep SolverKernels::*pass, const SweepParameters& parameters);

  const WorldDef& def_;
  const BodyTable& bodies_;
  BodyState& state_;
  ContactGraph& graph_;
  ThreadPool& pool_;
  const SolverKernels& wide_;
  const SolverKernels& single_;
  // Blocks of constraints; alignment by hand because std::vector<std::byte> gives 16 bytes.
  std::vector<std::byte> blocks_;
  std::vector<float> bounces_;
  BlockArray wide_blocks_, single_blocks_;
  std::size_t wide_count_ = 0, single_count_ = 0;
  std::vector<std::uint32_t> lanes_;
  std::vector<Stretch> stretches_;
  std::vector<Neighbourhood::Offsets> offsets_;  // of each stretch's lanes
  // Who does what, for cache's sake: by stretch the blocks, by thread the bodies, where each thread's begin.
  std::vector<std::size_t> cuts_, body_cuts_;
  std::vector<std::size_t> place_cuts_;
  int colours_in_use_ = 0;
  std::uint64_t laid_out_ = 0;  // the colouring that the blocks follow
  std::atomic<std::size_t> point_count_ = 0;
};

}  // namespace fathom::native
