#include "native/cell_solver.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <type_traits>

#include "dynamics/look_ahead.hpp"
#include "dynamics/overlap.hpp"
#include "dynamics/tuning.hpp"

namespace fathom::native {

namespace {

constexpr std::size_t row_grain = 64;
constexpr std::size_t cell_grain = 4;

}  // namespace

CellSolver::CellSolver(const WorldDef& def, const BodyTable& table, BodyState& state, ContactGraph& graph,
                       ThreadPool& pool, ContactSolver& bodies)
    : def_(def), bodies_(table), state_(state), graph_(graph), pool_(pool), body_solver_(bodies) {}

std::size_t CellSolver::memory_bytes() const {
  return entries_.capacity() * sizeof(Entry) + rows_.capacity() * sizeof(Row) + cells_.capacity() * sizeof(std::size_t);
}

// --- build ---------------------------------------------------------------------------------------------------

void CellSolver::build(std::span<const std::uint32_t> in_contact) {
  body_solver_.load_bodies(in_contact);
  partition(in_contact);
  point_count_ = 0;
  pool_.for_each_chunk(rows_.size(), row_grain, [&](std::size_t begin, std::size_t end) {
    std::size_t points = 0;
    for (std::size_t i = begin; i < end; ++i) {
      prepare(rows_[i], entries_[i].contact);
      points += static_cast<std::size_t>(rows_[i].rows.count);
    }
    point_count_ += points;
  });
}

void CellSolver::partition(std::span<const std::uint32_t> in_contact) {
  Vec3 lower{3e38f, 3e38f, 3e38f}, largest{1e-3f, 1e-3f, 1e-3f};
  for (const std::uint32_t slot : in_contact) {
    if (bodies_[slot].motion != MotionType::dynamic) continue;
    const Aabb& box = state_.bounds[slot].fat_box;
    lower = min(lower, box.lower);
    largest = max(largest, box.upper - box.lower);
  }
  // One per cent more, because centres are rounded.
  const Vec3 inverse{1.0f / (1.01f * largest.x), 1.0f / (1.01f * largest.y), 1.0f / (1.01f * largest.z)};
  constexpr float most = 1048575;  // 20 bits; bodies more than a million cells away share the last one
  struct Part {
    std::uint64_t x, y, z;
  };
  const auto part_of = [&](std::uint32_t slot) {
    const Vec3 p = centre(state_.bounds[slot].fat_box) - lower;
    const auto coordinate = [](float x) { return static_cast<std::uint64_t>(clamp(x, 0.0f, most)); };
    return Part{coordinate(p.x * inverse.x), coordinate(p.y * inverse.y), coordinate(p.z * inverse.z)};
  };
  entries_.clear();
  for (int colour = 0; colour <= overflow_colour; ++colour)
    graph_.for_each_of_colour(colour, [&](std::uint32_t contact) { entries_.push_back({0, contact}); });
  pool_.for_each_chunk(entries_.size(), row_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Contact& c = graph_[entries_[i].contact];
      Part p = part_of(c.b);
      if (!c.fixed_a) {
        const Part a = part_of(c.a);
        p = {std::min(p.x, a.x), std::min(p.y, a.y), std::min(p.z, a.z)};
      }
      const std::uint64_t group = (p.x & 1) | (p.y & 1) << 1 | (p.z & 1) << 2;
      entries_[i].cell = group << 60 | p.z << 40 | p.y << 20 | p.x;
    }
  });
  std::sort(entries_.begin(), entries_.end(),
            [](const Entry& x, const Entry& y) { return x.cell != y.cell ? x.cell < y.cell : x.contact < y.contact; });
  rows_.resize(entries_.size());
  cells_.clear();
  std::uint32_t group = 0;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (i > 0 && entries_[i].cell == entries_[i - 1].cell) continue;
    for (; group <= entries_[i].cell >> 60; ++group) first_cell_[group] = cells_.size();
    cells_.push_back(i);
  }
  for (; group <= groups; ++group) first_cell_[group] = cells_.size();
  cells_.push_back(entries_.size());
}

template <class Inertia>
ContactBody<Inertia> CellSolver::body(std::uint32_t slot) const {
  const SolverBody& s = state_.solver[slot + 1];
  return {s.linear,       s.angular,
          s.inverse_mass, world_inertia<Inertia>(state_.inertia.data(), slot, s.inverse_mass, s.inverse_inertia),
          s.moved,        s.turned};
}

template <class Inertia>
ContactBodies<Inertia> CellSolver::bodies_of(const Row& row) const {
  return {body<Inertia>(row.a), body<Inertia>(row.b)};
}

void CellSolver::prepare(Row& row, std::uint32_t contact) {
  Contact& c = graph_[contact];
  const ContactManifold& m = graph_.manifold(c);
  row.contact = contact;
  row.a = c.a;
  row.b = c.b;
  row.rows.bounce = {m.restitution, 0};
  row.pushes_fixed = c.fixed_a;
  row.has_surface = c.on_moving_surface || c.by_direction;
  row.surface = {c.on_moving_surface ? graph_.surface_slide(contact) : Vec3{}};
  row.isotropic = !is_anisotropic(state_.solver[c.a + 1]) && !is_anisotropic(state_.solver[c.b + 1]);
  if (row.isotropic)
    prepare_as<float>(row, c, m);
  else
    prepare_as<SymMat3>(row, c, m);
}

template <class Inertia>
void CellSolver::prepare_as(Row& row, Contact& c, const ContactManifold& m) {
  const auto bodies = bodies_of<Inertia>(row);
  const Pose &pose_a = state_.poses[row.a], &pose_b = state_.poses[row.b];
  const ContactOccasion occasion{c.slack.offset(), c.round, 0.5f * def_.dt, static_cast<float>(def_.solver.substeps)};
  row.nearest = c.ahead ? prepare_contact_ahead(m, pose_a, pose_b, m.step_impulse, c.round, bodies, row.rows)
                        : prepare_contact(m, pose_a, pose_b, occasion, bodies, row.rows);
  const ContactAxes axes = row.rows.axes();
  if (c.by_direction) {
    const FrictionEllipse ellipse = graph_.friction_ellipse(row.contact, axes.n);
    row.rows.frame.friction.coefficient = ellipse.coefficient;
    row.surface.set_grain(ellipse, axes);
  }
  row.roll = c.round ? roll_row(m, axes) : RollRow{};
  if (m.restitution == 0) return;
  const auto pull = [&](std::uint32_t slot, float inverse_mass) {
    return inverse_mass > 0 ? dot(axes.n, state_.motion[slot].acceleration) : 0.0f;
  };
  row.rows.bounce.pull = pull(row.b, bodies.b.inverse_mass) - pull(row.a, bodies.a.inverse_mass);
}

// --- solve ---------------------------------------------------------------------------------------------------

void CellSolver::solve(std::span<const std::uint32_t> in_contact) {
  const SolverSettings& s = def_.solver;
  const float h = def_.dt / static_cast<float>(s.substeps);
  const bool soft = s.method == Solver::soft;
  if (soft) {
    contacts_ = contact_softness(s, h);
  } else {
    contacts_.dynamic = contacts_.fixed = {baumgarte / h};
  }
  for (int substep = 0; substep < s.substeps; ++substep) {
    Carry carry = substep == 0 || !s.warm_start ? Carry::nothing : Carry::to_date;
    if (graph_.may_bounce()) {
      if (carry == Carry::to_date) {
        body_solver_.carry_impulses(in_contact, h);
        carry = Carry::as_is;
      }
      bounce();
    }
    body_solver_.integrate_velocities(in_contact, h, carry);
    fail(in_contact, SolverStage::velocities, substep);
    if (!s.warm_start)
      sweep<Pass::clear>();
    else if (substep == 0)
      sweep<Pass::warm_start>();
    fail(in_contact, SolverStage::warm_start, substep);
    ends_substep_ = false;
    for (int i = soft ? 1 : s.iterations; i > 0; --i) {
      ends_substep_ = !soft && i == 1;
      sweep<Pass::push>();
    }
    fail(in_contact, SolverStage::pushes, substep);
    body_solver_.integrate_positions(in_contact, h);
    fail(in_contact, SolverStage::positions, substep);
    ends_substep_ = true;
    if (soft) sweep<Pass::relax>();
    fail(in_contact, SolverStage::relaxes, substep);
  }
}

void CellSolver::fail(std::span<const std::uint32_t> in_contact, SolverStage stage, int substep) {
  if (!body_fault.is_due(stage, static_cast<std::uint32_t>(substep))) return;
  for (const std::uint32_t slot : in_contact) {
    SolverBody& body = state_.solver_bodies()[slot];
    if (body.inverse_mass > 0 && bodies_[slot].filter.category == body_fault.category)
      body_fault.act(body.linear, body.angular);
  }
}

void CellSolver::bounce() {
  bounced_ = true;
  for (std::uint32_t i = 0; i < max_bounce_sweeps && bounced_; ++i) {
    bounced_ = false;
    sweep<Pass::bounce>();
  }
}

template <CellSolver::Pass pass>
void CellSolver::sweep() {
  for (std::uint32_t g = 0; g < groups; ++g)
    pool_.for_each_chunk(first_cell_[g + 1] - first_cell_[g], cell_grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = cells_[first_cell_[g] + begin]; i < cells_[first_cell_[g] + end]; ++i) {
        if (rows_[i].isotropic)
          sweep_row<pass, float>(rows_[i]);
        else
          sweep_row<pass, SymMat3>(rows_[i]);
      }
    });
}

template <CellSolver::Pass pass, class Inertia>
void CellSolver::sweep_row(Row& row) {
  if constexpr (pass == Pass::clear) {
    row.rows.impulses = row.rows.impulses.cleared();
    row.roll.impulse = {};
    return;
  }
  ContactRows& rows = row.rows;
  if (pass == Pass::bounce && !rows.may_bounce()) return;
  auto bodies = bodies_of<Inertia>(row);
  const float h = def_.dt / static_cast<float>(def_.solver.substeps);
  if constexpr (pass == Pass::warm_start) {
    warm_start_contact<float>(rows, bodies);
    if (row.roll.length > 0) twist_apart(bodies, row.roll.impulse);
  } else if constexpr (pass == Pass::bounce) {
    const Bounce<float> bounce = bounce_contact(rows, bodies, h, bounce_threshold(def_, h), row.surface_effect());
    if (!bounce.any) return;
    rows.impulses.step += bounce.impulse;
    bounced_.store(true, std::memory_order_relaxed);
  } else {
    const ContactAxes axes = rows.axes();
    const SolverBody& body_a = state_.solver[row.a + 1];
    const bool moves_as_told = row.pushes_fixed && !(body_a.linear == Vec3{} && body_a.angular == Vec3{});
    const CarriedBySides<Inertia> carried(row.surface_effect(), bodies, axes, moves_as_told,
                                          friction_lead(def_.solver, h));
    ContactStep step =
        contact_step(1 / h, row.pushes_fixed ? contacts_.fixed : contacts_.dynamic, def_.solver.push_out_velocity);
    stiffen_uneven(bodies.a.inverse_mass, bodies.b.inverse_mass, step);
    // Rolling resistance comes last, so that it uses the impulse that carries the load.
    const bool rolls = pass == Pass::relax || def_.solver.method == Solver::impulse;
    if constexpr (pass == Pass::relax)
      sweep_contact<ContactPass::relax, false>(rows, axes, bodies, step, carried);
    else if (def_.solver.method == Solver::soft)
      sweep_contact<ContactPass::soft, false>(rows, axes, bodies, step, carried);
    else
      sweep_contact<ContactPass::iterate, false>(rows, axes, bodies, step, carried);
    if (row.roll.length > 0 && rolls)
      row.roll.impulse = solve_rolling(bodies, row.roll.length, rows.impulses.sum(), row.roll.impulse);
    if (ends_substep_) rows.impulses.step += rows.impulses.sum();
  }
  // As in native/solver_kernels.cpp: a contact that is not finite passes nothing on.
  if (!is_sound(bodies, rows.impulses)) {
    rows.impulses = {};
    return;
  }
  const auto put = [&](std::uint32_t slot, const ContactBody<Inertia>& from) {
    SolverBody& to = state_.solver[slot + 1];
    to.linear = from.linear;
    to.angular = from.angular;
  };
  put(row.b, bodies.b);
  if (!row.pushes_fixed) put(row.a, bodies.a);
}

void CellSolver::note_touch(const Row& row, Contact& c, const TouchWatch& watch) const {
  const bool pressed = row.rows.impulses.step > 0;
  const bool touches = pressed || row.nearest + c.slack.offset() <= touch_distance(c.touch_halvings, c.in_touch);
  if (touches != c.in_touch) watch.changes->note(row.contact, touches);
  if (pressed || c.hits)
    watch.note_hit(row.contact, c, graph_.manifold(c), row.rows.frame, row.rows.points, row.rows.impulses.normal,
                   pressed);
}

void CellSolver::store() {
  const Constrained constrained = body_solver_.constrained();
  pool_.for_each_chunk(rows_.size(), row_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Row& row = rows_[i];
      Contact& c = graph_[row.contact];
      ContactManifold& m = graph_.manifold(c);
      for (int k = 0; k < max_manifold_points; ++k) m.impulses[k] = row.rows.impulses.normal[k];
      m.friction_impulse[0] = row.rows.impulses.slide_1;
      m.friction_impulse[1] = row.rows.impulses.slide_2;
      m.twist_impulse = row.rows.impulses.twist;
      m.step_impulse = row.rows.impulses.step;
      note_touch(row, c, constrained.touches);
      if (const float overlap = c.slack.overlap(); overlap > 0)
        c.slack = Slack::of_overlap(faded_overlap(overlap, row.nearest, overlap_kept(def_.dt)));
      if (row.roll.length > 0) m.set_rolling_impulse(kept_impulse(row.roll, row.rows.axes()));
    }
  });
}

}  // namespace fathom::native
