// Solves contacts cell by cell, as the dissertation's native simulator does (its section 3.4): one thread solves all
// constraints of a cell of a uniform grid, one by one, and cells are distributed among threads. Cells within one of 2³
// cell groups share no body; the groups are processed one after another (Le Grand 2007).
//
// As on a device (device/published/cells.hpp), a constraint belongs to the lower of its bodies' cells along each axis,
// and a cell is as large as the largest box of a dynamic body. Unlike there, the number of constraints is known before
// they are partitioned: none is ever left out, and empty cells cost nothing.
#pragma once

#include <atomic>
#include <vector>

#include "dynamics/contact_rows.hpp"
#include "dynamics/rolling.hpp"
#include "native/solver.hpp"

namespace fathom::native {

class CellSolver {
 public:
  /// `bodies` loads and integrates the bodies.
  CellSolver(const WorldDef& def, const BodyTable& table, BodyState& state, ContactGraph& graph, ThreadPool& pool,
             ContactSolver& bodies);

  // Like ContactSolver's.
  void build(std::span<const std::uint32_t> in_contact);
  void solve(std::span<const std::uint32_t> in_contact);
  void store();  ///< also fades overlaps

  std::size_t cell_count() const { return cells_.empty() ? 0 : cells_.size() - 1; }
  std::size_t point_count() const { return point_count_; }
  std::size_t memory_bytes() const;

 private:
  static constexpr std::uint32_t groups = 8;

  struct Entry {
    std::uint64_t cell;  // its group in the highest bits
    std::uint32_t contact;
  };
  struct Row {
    ContactRows rows;
    RollRow roll;
    ContactSurface surface;  ///< where `has_surface`
    std::uint32_t contact, a, b;
    float nearest;  ///< m, smallest separation of the points at the start of the step
    bool isotropic, pushes_fixed, has_surface;

    SurfaceEffect surface_effect() const { return {has_surface ? &surface : nullptr}; }
  };
  enum class Pass { warm_start, clear, push, relax, bounce };

  void partition(std::span<const std::uint32_t> in_contact);
  void prepare(Row& row, std::uint32_t contact);
  template <class Inertia>
  void prepare_as(Row& row, Contact& contact, const ContactManifold& manifold);
  void bounce();
  void fail(std::span<const std::uint32_t> in_contact, SolverStage stage, int substep);
  template <Pass pass>
  void sweep();
  template <Pass pass, class Inertia>
  void sweep_row(Row& row);
  template <class Inertia>
  ContactBodies<Inertia> bodies_of(const Row& row) const;
  template <class Inertia>
  ContactBody<Inertia> body(std::uint32_t slot) const;

  void note_touch(const Row& row, Contact& c, const TouchWatch& watch) const;

  const WorldDef& def_;
  const BodyTable& bodies_;
  BodyState& state_;
  ContactGraph& graph_;
  ThreadPool& pool_;
  ContactSolver& body_solver_;
  std::vector<Entry> entries_;
  std::vector<Row> rows_;
  std::vector<std::size_t> cells_;  // where each cell's rows begin; the last entry is the end
  std::size_t first_cell_[groups + 1] = {};
  std::atomic<std::size_t> point_count_ = 0;
  ContactSoftness contacts_;
  std::atomic<bool> bounced_ = false;
  bool ends_substep_ = false;  // the current sweep is the substep's last
};

}  // namespace fathom::native
