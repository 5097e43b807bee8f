#include "native/solver.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <type_traits>

#include "check/check.hpp"
#include "dynamics/lift.hpp"
#include "dynamics/overlap.hpp"
#include "dynamics/softness.hpp"
#include "dynamics/tuning.hpp"
#include "native/integrate_bodies.hpp"
#include "native/prefetch.hpp"
#include "native/tuning.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

constexpr std::size_t alignment = 64;

}  // namespace

ContactSolver::ContactSolver(const WorldDef& def, const BodyTable& bodies, const JointTable& joints, BodyState& state,
                             ContactGraph& graph, ThreadPool& pool)
    : def_(def),
      bodies_(bodies),
      joints_(joints),
      state_(state),
      graph_(graph),
      pool_(pool),
      wide_(wide_kernels()),
      single_(single_kernels()),
      layout_(state, graph, pool, static_cast<std::size_t>(wide_.width)),
      stand_ins_(state),
      supports_(def, bodies, state, graph, pool),
      mechanisms_(def, bodies, state, graph) {}

// --- what a solver iterates over -----------------------------------------------------------------------------

/// Does the work that `act` has postponed to the end of its loop.
template <class Act>
static void end_loop(const Act& act) {
  if constexpr (requires { act.end(); }) act.end();
}

/// Calls act(slot) for bodies moved by other threads, with prefetching.
template <class Act>
void ContactSolver::for_each_fetched(std::span<const std::uint32_t> slots, const Act& act) {
  constexpr std::size_t ahead = 8;
  const Act mine = act;  // a local copy: the compiler knows that no other thread can see it
  const bool turns_freely = bodies_.any_anisotropic();
  const auto fetch = [&](std::uint32_t slot) {
    prefetch_to_write(&state_.solver_bodies()[slot]);
    prefetch_to_write(&state_.warm[slot]);
    prefetch_to_read(&state_.motion[slot]);
    if (!turns_freely) return;  // spinning reads more
    prefetch_to_write(&state_.inertia[slot]);
    prefetch_to_read(&state_.poses[slot]);
    prefetch_to_read(&bodies_[slot].inertia);
    prefetch_to_read(&bodies_[slot].inverse_inertia);
  };
  for (std::size_t i = 0; i < std::min(ahead, slots.size()); ++i) fetch(slots[i]);
  for (std::size_t i = 0; i < slots.size(); ++i) {
    if (i + ahead < slots.size()) fetch(slots[i + ahead]);
    mine(slots[i]);
  }
  end_loop(mine);
}

class ContactSolver::Everything {
 public:
  explicit Everything(ContactSolver& solver) : s_(solver) {}

  template <class Act>
  void bodies(const Act& act) const {
    const std::span<const std::uint32_t> slots = s_.layout_.bodies();
    s_.layout_.for_each_part_of_bodies([&](std::size_t begin, std::size_t end) {
      if (s_.pool_.thread_count() > 1) return s_.for_each_fetched(slots.subspan(begin, end - begin), act);
      const Act mine = act;  // a local copy that, as the compiler knows, nothing else writes
      for (std::size_t i = begin; i < end; ++i) mine(slots[i]);  // in memory order
      end_loop(mine);
    });
  }

  /// Does the postponed work.
  void complete() const {}
  /// Stand-ins are among the bodies themselves.
  void move_stand_ins(float) const {}

  /// The overflow, then colour by colour.
  template <class Kernel>
  void colours(const Kernel& kernel) const {
    if (s_.single_count_ > 0) kernel(s_.single_, s_.single_blocks_, 0, s_.single_count_);
    for (std::size_t i = 0; i < s_.layout_.stretches().size(); ++i)
      s_.layout_.for_each_part(i, [&](std::size_t begin, std::size_t end, std::size_t share_end) {
        BlockArray blocks = s_.wide_blocks_;
        blocks.fetch_end = share_end;
        kernel(s_.wide_, blocks, begin, end);
      });
  }
  /// Calls act(structure) for structures held by their supports.
  template <class Act>
  void structures(const Act& act) const {
    s_.for_each_number(s_.supports_.all(), act);
  }
  template <class Act>
  void mechanisms(const Act& act) const {
    s_.for_each_number(s_.mechanisms_.all(), act);
  }

 private:
  ContactSolver& s_;
};

/// A sweep is a loop over the domains of each division. Two kinds of work wait for the next loop over the first
/// division: that on single bodies, and contacts with non-dynamic ones, which come last in a sweep because that is the
/// firmer side.
class ContactSolver::InDomains {
 public:
  explicit InDomains(ContactSolver& solver) : s_(solver), layout_(solver.layout_), domains_(solver.graph_.domains()) {}

  template <class Act>
  void bodies(const Act& act) const {
    put_off([this, act](const Unit& unit) { s_.for_each_fetched(layout_.bodies(unit), act); });
  }

  template <class Kernel>
  void colours(const Kernel& kernel) const {
    for_each_first([&](const Unit& unit) { run(kernel, unit.between); });
    for (std::size_t division = 1; division < Domains::divisions; ++division)
      for_each_unit(division, [&](const Unit& unit) { run(kernel, unit.between); });
    run(kernel, layout_.units()[domains_.remainder()].between);
    put_off([this, kernel](const Unit& unit) { run(kernel, unit.on_fixed); });
  }

  template <class Act>
  void structures(const Act& act) const {
    if (s_.supports_.empty()) return;
    complete();  // structures span domains, and follow a complete sweep
    s_.for_each_number(s_.supports_.all(), act);
  }
  template <class Act>
  void mechanisms(const Act& act) const {
    if (s_.mechanisms_.empty()) return;
    complete();
    s_.for_each_number(s_.mechanisms_.all(), act);
  }

  void complete() const {
    for_each_first([](const Unit&) {});
  }
  void move_stand_ins(float h) const {
    if (s_.stand_ins_.any()) put_off([this, h](const Unit& unit) { s_.stand_ins_.move(s_.number_of(unit), h); });
  }

  /// Does the postponed work, then act(unit), for each unit of the first division.
  template <class Act>
  void for_each_first(const Act& act) const {
    for_each_unit(0, [&](const Unit& unit) {
      for (std::size_t i = 0; i < waiting_; ++i) put_off_[i].call(put_off_[i].closure, unit);
      act(unit);
    });
    waiting_ = 0;
  }

 private:
  // A closure of the solver; no std::function, because steps do not allocate.
  struct PutOff {
    alignas(16) std::byte closure[160];
    void (*call)(const void* closure, const Unit& unit);
  };

  template <class Closure>
  void put_off(const Closure& closure) const {
    static_assert(std::is_trivially_copyable_v<Closure> && sizeof closure <= sizeof PutOff::closure);
    PutOff& slot = put_off_.at(waiting_++);
    std::memcpy(slot.closure, &closure, sizeof closure);
    slot.call = [](const void* of, const Unit& unit) { (*static_cast<const Closure*>(of))(unit); };
  }

  template <class Kernel>
  void run(const Kernel& kernel, const ConstraintLayout::Range& range) const {
    const std::span<const ConstraintLayout::Stretch> stretches = layout_.stretches(range);
    if (stretches.empty()) return;
    BlockArray blocks = s_.wide_blocks_;
    blocks.fetch_end = stretches.back().end;  // stretches are short
    for (const auto& stretch : stretches) kernel(s_.wide_, blocks, stretch.first, stretch.end);
  }

  template <class Act>
  void for_each_unit(std::size_t division, const Act& act) const {
    const std::span<const Unit> units =
        layout_.units().subspan(domains_.first_unit(division), domains_.count(division));
    s_.pool_.for_each_part(units.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) act(units[i]);
    });
  }

  ContactSolver& s_;
  const ConstraintLayout& layout_;
  const Domains& domains_;
  mutable std::array<PutOff, 8> put_off_;
  mutable std::size_t waiting_ = 0;
};

class ContactSolver::OneGroup {
 public:
  OneGroup(ContactSolver& solver, const Group& group) : s_(solver), group_(group) {}

  template <class Act>
  void bodies(const Act& act) const {
    const Act mine = act;
    for (const std::uint32_t slot : s_.layout_.bodies(group_)) mine(slot);
    end_loop(mine);
  }
  void complete() const {}
  void move_stand_ins(float h) const { s_.stand_ins_.move(s_.number_of(group_), h); }
  template <class Kernel>
  void colours(const Kernel& kernel) const {
    for (const auto& stretch : s_.layout_.stretches(group_))
      kernel(s_.wide_, s_.wide_blocks_, stretch.first, stretch.end);
  }
  template <class Act>
  void structures(const Act& act) const {
    for (const std::uint32_t structure : s_.supports_.of_group(s_.number_of(group_))) act(structure);
  }
  template <class Act>
  void mechanisms(const Act& act) const {
    for (const std::uint32_t mechanism : s_.mechanisms_.of_group(s_.number_of(group_))) act(mechanism);
  }

 private:
  ContactSolver& s_;
  const Group& group_;
};

template <class Act>
void ContactSolver::for_each_number(std::span<const std::uint32_t> numbers, const Act& act) {
  if (numbers.empty()) return;
  pool_.for_each_part(numbers.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) act(numbers[i]);
  });
}

template <class Act>
void ContactSolver::for_each_group(const Act& act) {
  const std::span<const Group> groups = layout_.groups();
  pool_.for_each_part(groups.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) act(groups[i]);
  });
}

/// Calls act(slots) for parts of the bodies with stand-ins.
template <class Act>
void ContactSolver::for_each_part_of_kinematic(const Act& act) {
  const std::span<const std::uint32_t> slots = layout_.kinematic();
  if (slots.empty()) return;
  pool_.for_each_part(slots.size(), bodies_a_thread,
                      [&](std::size_t begin, std::size_t end) { act(slots.subspan(begin, end - begin)); });
}

// --- build ---------------------------------------------------------------------------------------------------

void ContactSolver::lay_out(const BodiesInContact& in_contact, const Neighbourhood& neighbourhood, std::uint64_t step) {
  const bool has_moved = layout_.update(in_contact, neighbourhood);
  stand_ins_.lay_out(layout_);
  if (def_.solver.method == Solver::soft) {
    supports_.update(in_contact.slots, layout_, has_moved, step);
    mechanisms_.update(layout_, has_moved, pool_.size());
    for_each_number(mechanisms_.all(), [this](std::uint32_t mechanism) { mechanisms_.note_torn(mechanism); });
    mechanisms_.for_each_inertia(
        [this](std::uint32_t slot, float inertia) { supports_.overloads().require(slot, inertia); });
    supports_.give_back_momentum();
    note_swings();
  }
  const bool bounces = wide_blocks_.bounces != nullptr;
  if (has_moved || bounces != graph_.may_bounce() || block_bytes(wide_) != wide_blocks_.stride) make_room_for_blocks();
  const bool several = pool_.thread_count() > 1;
  wide_blocks_.scattered = several || graph_.domains().in_use();
  wide_blocks_.shared = several && layout_.groups().empty();
}

void ContactSolver::note_swings() {
  for_each_number(mechanisms_.all(), [this](std::uint32_t mechanism) { mechanisms_.note_swings(mechanism); });
}

void ContactSolver::build() {
  any_isolated_ = false;
  any_fast_ = false;
  point_count_ = 0;
  if (layout_.groups().empty() || !layout_.units().empty()) prepare_all();
}

void ContactSolver::prepare_all() {
  point_count_ = 0;
  if (!layout_.units().empty()) return build_in_domains();
  Everything(*this).bodies([&](std::uint32_t slot) { load_body(slot); });
  hold_isolated(layout_.bodies());
  layout_.for_each_part_of_all([&](std::size_t begin, std::size_t end) { point_count_ += prepare(begin, end); });
  point_count_ += single_.prepare(single_blocks_, 0, single_count_, overflow_.data(), constrained(), view());
}

void ContactSolver::build_in_domains() {
  const InDomains work(*this);
  load_kinematic();
  work.for_each_first([&](const Unit& unit) {
    load_group(layout_.bodies(unit));
    hold_isolated(layout_.bodies(unit));
    point_count_ += prepare(unit.blocks.begin, unit.blocks.end);
    stand_ins_.make(number_of(unit), wide_blocks_);
  });
  const std::size_t first = layout_.units()[graph_.domains().first_unit(1)].blocks.begin;
  pool_.for_each_part(layout_.blocks() - first, blocks_a_thread,
                      [&](std::size_t begin, std::size_t end) { point_count_ += prepare(first + begin, first + end); });
}

void ContactSolver::load_group(std::span<const std::uint32_t> slots) {
  const bool any_anisotropic = bodies_.any_anisotropic();
  for (std::size_t i = 0; i < slots.size(); ++i) {
    constexpr std::size_t ahead = 4;
    if (i + ahead < slots.size()) {
      const std::uint32_t slot = slots[i + ahead];
      prefetch_to_read(&bodies_[slot]);
      prefetch_to_read(&state_.velocities[slot]);
      prefetch_to_write(&state_.solver_bodies()[slot]);
      prefetch_to_write(&state_.motion[slot]);
      if (any_anisotropic) {
        prefetch_to_read(&bodies_[slot].inverse_inertia);
        prefetch_to_read(&state_.poses[slot]);
        prefetch_to_write(&state_.inertia[slot]);
      }
    }
    load_body(slots[i]);
  }
}

// Stand-ins move through the step. The bodies themselves are already at its end, for code that reads their targets.
void ContactSolver::load_kinematic() {
  const BodyIntegration integrate = integration(def_.dt / static_cast<float>(def_.solver.substeps));
  for_each_part_of_kinematic([&](std::span<const std::uint32_t> slots) {
    for (const std::uint32_t slot : slots) {
      load_body(slot);
      for (int substep = 0; substep < def_.solver.substeps; ++substep) integrate.position(slot);
    }
  });
}

void ContactSolver::load_bodies(std::span<const std::uint32_t> in_contact) {
  pool_.for_each_part(in_contact.size(), bodies_a_thread, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) load_body(in_contact[i]);
  });
}

void ContactSolver::carry_impulses(std::span<const std::uint32_t> in_contact, float h) {
  const BodyIntegration integrate = integration(h);
  pool_.for_each_part(in_contact.size(), bodies_a_thread, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) integrate.carry(in_contact[i]);
  });
}

void ContactSolver::integrate_velocities(std::span<const std::uint32_t> in_contact, float h, Carry carry) {
  const BodyIntegration integrate = integration(h);
  pool_.for_each_part(in_contact.size(), bodies_a_thread, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) integrate.velocity(in_contact[i], carry);
  });
}

void ContactSolver::integrate_positions(std::span<const std::uint32_t> in_contact, float h) {
  const BodyIntegration integrate = integration(h);
  pool_.for_each_part(in_contact.size(), bodies_a_thread, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) integrate.position(in_contact[i]);
  });
}

Constrained ContactSolver::constrained() {
  Constrained all = graph_.constrained();
  all.touches = {&graph_.touch_changes(),           state_.poses.data(),
                 state_.velocities.data(),          state_.solver_bodies(),
                 def_.solver.restitution_threshold, def_.dt};
  return all;
}

BodiesView ContactSolver::view() {
  return {state_.poses.data(),
          state_.solver_bodies(),
          state_.inertia.data(),
          state_.motion.data(),
          supports_.held(),
          supports_.levels(),
          supports_.overloads().any_scaled() ? &supports_.overloads() : nullptr,
          state_.flags.data(),
          &def_,
          swings(),
          &mechanisms_.contacts(),
          mechanisms_.direct(),
          any_fast_.load(std::memory_order_relaxed),
          0.5f * def_.dt,
          static_cast<float>(def_.solver.substeps),
          watches_loads() ? lasting_depth(bodies_.min_half_thickness()) : 1e30f};
}

std::size_t ContactSolver::prepare(std::size_t begin, std::size_t end) {
  const BodiesView bodies = view();
  FATHOM_ASSERT(!bodies.may_differ() || wide_blocks_.stride >= wide_.own_block_bytes);
  return wide_.prepare(wide_blocks_, begin, end, layout_.lanes(), constrained(), bodies);
}

void ContactSolver::load_body(std::uint32_t slot) {
  const BodyInfo& info = bodies_[slot];
  const Velocity& v = state_.velocities[slot];
  SolverBody& body = state_.solver_bodies()[slot];
  body = {v.linear, 0, v.angular, 0, {}, info.inverse_mass, {}, info.isotropic ? info.inverse_inertia.xx : 0};
  const float threshold = def_.solver.restitution_threshold, turning = info.radius * info.radius;
  if (fma(turning, length_squared(v.angular), length_squared(v.linear)) > 0.125f * threshold * threshold)
    any_fast_.store(true, std::memory_order_relaxed);
  const float h = def_.dt / static_cast<float>(def_.solver.substeps);
  if (info.motion != MotionType::dynamic) {
    state_.motion[slot] = {};
    // Slightly below the limits, so that no substep clamps it again: stand-ins keep their initial velocity.
    const SpeedLimits limits = speed_limits(def_.solver.max_linear_speed, h);
    body.linear = limited(v.linear, 0.99999f * limits.linear);
    body.angular = limited(v.angular, 0.99999f * limits.angular);
    return;
  }
  state_.motion[slot] = motion_under(info.gravity_scale * def_.gravity, info.linear_damping, info.angular_damping, h);
  if (state_.flags[slot] & has_force || !info.isotropic || supports_.overloads().any_scaled()) load_extras(slot);
}

// Out of line: most bodies do not need it, and it would cost registers.
HWY_NOINLINE void ContactSolver::load_extras(std::uint32_t slot) {
  const BodyInfo& info = bodies_[slot];
  const Quat q = state_.poses[slot].rotation;
  if (state_.flags[slot] & has_force) {
    BodyMotion& motion = state_.motion[slot];
    const Acceleration a = forced_acceleration(info, q, state_.forces[slot], motion.acceleration);
    motion.acceleration = a.linear;
    motion.angular_acceleration = a.angular;
  }
  if (!info.isotropic) {
    const SymMat3 world = rotated(to_matrix(q), info.inverse_inertia);
    state_.inertia[slot] = {world.xx, world.yy, world.zz, world.xy, world.xz, world.yz, 0, 0, q};
  }
  if (supports_.overloads().any_scaled()) add_inertia(slot, 1 / supports_.overloads().inertia_scale(slot));
}

// Forces do not change, so accelerations shrink.
void ContactSolver::add_inertia(std::uint32_t slot, float inverse_scale) {
  SolverBody& body = state_.solver_bodies()[slot];
  body.inverse_mass *= inverse_scale;
  body.inverse_inertia *= inverse_scale;
  BodyMotion& motion = state_.motion[slot];
  motion.acceleration *= inverse_scale;
  motion.angular_acceleration *= inverse_scale;
  if (bodies_[slot].isotropic) return;
  WorldInertia& w = state_.inertia[slot];
  for (float* element : {&w.xx, &w.yy, &w.zz, &w.xy, &w.xz, &w.yz}) *element *= inverse_scale;
}

bool ContactSolver::watches_loads() const { return def_.solver.method == Solver::soft && supports_.stiffness() > 0; }

LoadWatch ContactSolver::load_watch() {
  if (!watches_loads()) return {};
  LoadWatch watch;
  watch.stiffness = supports_.stiffness();
  watch.overloads = &supports_.overloads(), watch.table = &bodies_, watch.bodies = state_.solver_bodies(),
  watch.before = state_.velocities.data(), watch.heaviest = supports_.heaviest();
  watch.unit = length(def_.gravity) * def_.dt;
  watch.dt = def_.dt;
  // With inertia added by loads, rows do not reflect true masses.
  if (!supports_.overloads().any_scaled())
    watch.least = sweep_load(bodies_.min_half_thickness(), watch.stiffness) * watch.unit;
  if (mechanisms_.contacts().empty()) return watch;
  watch.link_contacts = &mechanisms_.contacts();
  watch.least = min(watch.least, pressing_load * watch.unit);
  return watch;
}

std::size_t ContactSolver::block_bytes(const SolverKernels& kernels) const {
  if (graph_.any_generic_joints()) return kernels.joint_block_bytes;
  if (graph_.may_roll() || graph_.any_moving_surface() || graph_.any_by_direction()) return kernels.surface_block_bytes;
  if (bodies_.any_anisotropic()) return kernels.block_bytes;
  // As `BodiesView::may_differ`.
  const bool may_differ = supports_.held() || supports_.overloads().any_scaled() || swings();
  return may_differ ? kernels.own_block_bytes : kernels.isotropic_block_bytes;
}

void ContactSolver::make_room_for_blocks() {
  const std::size_t wide_count = layout_.blocks();
  overflow_.clear();
  graph_.for_each_of_colour(overflow_colour, [&](std::uint32_t index) { overflow_.push_back(index); });
  for (std::size_t unit = 0; unit < graph_.domains().units(); ++unit)
    for (const ConstraintKind kind :
         {ConstraintKind::ball_joint, ConstraintKind::generic_joint, ConstraintKind::coupling})
      for (const std::uint32_t slot : graph_.joints_of(kind, unit, overflow_colour))
        overflow_.push_back(constraint_ref(kind, slot));
  single_count_ = overflow_.size();
  wide_blocks_.stride = block_bytes(wide_);
  single_blocks_.stride = block_bytes(single_);
  const std::size_t bytes = wide_count * wide_blocks_.stride + single_count_ * single_blocks_.stride;
  if (block_memory_.capacity() < bytes)
    block_memory_.reserve(std::max(bytes, block_memory_.capacity() + block_memory_.capacity() / 4));
  wide_blocks_.blocks = block_memory_.data();
  single_blocks_.blocks = wide_blocks_.blocks + wide_count * wide_blocks_.stride;
  if (!graph_.may_bounce()) {
    wide_blocks_.bounces = single_blocks_.bounces = nullptr;
    return;
  }
  const std::size_t floats =
      wide_count * wide_.bounce_floats + single_count_ * single_.bounce_floats + alignment / sizeof(float);
  if (bounces_.size() < floats) grow_to(bounces_, floats);
  const std::size_t off = reinterpret_cast<std::uintptr_t>(bounces_.data()) % alignment;
  wide_blocks_.bounces = bounces_.data() + (off ? alignment - off : 0) / sizeof(float);
  single_blocks_.bounces = wide_blocks_.bounces + wide_count * wide_.bounce_floats;
}

// --- solve ---------------------------------------------------------------------------------------------------

BodyIntegration ContactSolver::integration(float h) {
  return {bodies_,
          state_.solver_bodies(),
          state_.motion.data(),
          state_.warm.data(),
          state_.inertia.data(),
          state_.poses.data(),
          h,
          speed_limits(def_.solver.max_linear_speed, h),
          swings(),
          state_.flags.data()};
}

void ContactSolver::solve(const std::function<void(std::span<const std::uint32_t>)>& act, const Isolate& isolate) {
  const bool in_domains = !layout_.units().empty();
  if (!in_domains && !layout_.groups().empty()) {
    solve_groups(act, isolate);
    return for_each_part_of_kinematic(act);
  }
  while (!solve_all() && isolate_failed(layout_.bodies(), isolate)) prepare_all();
  for_each_number(supports_.all(), [this](std::uint32_t structure) { supports_.finish(structure); });
  for_each_number(mechanisms_.all(), [this](std::uint32_t mechanism) { mechanisms_.store(mechanism); });
  if (in_domains)
    finish_domains(act);
  else
    finish_all(act);
  for_each_part_of_kinematic(act);
}

bool ContactSolver::solve_all() {
  std::atomic<bool> finite = true;
  const auto look_at = [&](std::span<const std::uint32_t> slots) {
    if (!all_finite(slots)) finite = false;
  };
  if (layout_.units().empty()) {
    substeps(Everything(*this));
    layout_.for_each_part_of_bodies(
        [&](std::size_t begin, std::size_t end) { look_at(layout_.bodies().subspan(begin, end - begin)); });
  } else {
    const InDomains work(*this);
    substeps(work);
    work.for_each_first([&](const Unit& unit) { look_at(layout_.bodies(unit)); });
  }
  return finite;
}

template <class Act>
void ContactSolver::finish_all(const Act& act) {
  const Constrained constrained = this->constrained();
  const float kept = overlap_kept(def_.dt);
  const LoadWatch watch = load_watch();
  layout_.for_each_part_of_all([&](std::size_t begin, std::size_t end) {
    wide_.store(wide_blocks_, begin, end, layout_.lanes(), constrained, kept, watch);
  });
  single_.store(single_blocks_, 0, single_count_, overflow_.data(), constrained, kept, watch);
  layout_.for_each_part_of_bodies(
      [&](std::size_t begin, std::size_t end) { act(layout_.bodies().subspan(begin, end - begin)); });
}

template <class Act>
void ContactSolver::finish_domains(const Act& act) {
  // Each domain of the first division stores its own impulses, and a share of those that cross borders.
  const std::size_t count = graph_.domains().count(0);
  const Unit* const units = layout_.units().data();
  const std::size_t first = units[count].blocks.begin, across = layout_.blocks() - first;
  const Constrained constrained = this->constrained();
  const auto store = [&, kept = overlap_kept(def_.dt), watch = load_watch()](std::size_t begin, std::size_t end) {
    wide_.store(wide_blocks_, begin, end, layout_.lanes(), constrained, kept, watch);
  };
  const InDomains work(*this);
  work.for_each_first([&](const Unit& unit) {
    const std::size_t i = number_of(unit);
    stand_ins_.remove(i, wide_blocks_);
    store(unit.blocks.begin, unit.blocks.end);
    store(first + i * across / count, first + (i + 1) * across / count);
  });
  // Only after all impulses are stored: that needs the initial velocities of bodies on both sides of a border.
  work.for_each_first([&](const Unit& unit) { act(layout_.bodies(unit)); });
}

// One thread solves a group completely while it is in its cache. Groups with a body that is not finite wait for the
// others and are solved again.
template <class Act>
void ContactSolver::solve_groups(const Act& act, const Isolate& isolate) {
  load_kinematic();
  for_each_group([&](const Group& group) {
    point_count_ += prepare_group(group);
    substeps(OneGroup(*this, group));
    if (all_finite(layout_.bodies(group))) return finish_group(group, act);
    const std::lock_guard lock(failed_mutex_);
    failed_groups_.push_back(&group);
  });
  for (const Group* group : failed_groups_) {
    while (!all_finite(layout_.bodies(*group)) && isolate_failed(layout_.bodies(*group), isolate)) {
      prepare_group(*group);
      substeps(OneGroup(*this, *group));
    }
    finish_group(*group, act);
  }
  failed_groups_.clear();
}

std::size_t ContactSolver::prepare_group(const Group& group) {
  load_group(layout_.bodies(group));
  hold_isolated(layout_.bodies(group));
  const std::size_t count = prepare(group.blocks.begin, group.blocks.end);
  stand_ins_.make(number_of(group), wide_blocks_);
  return count;
}

template <class Act>
void ContactSolver::finish_group(const Group& group, const Act& act) {
  const OneGroup work(*this, group);
  work.structures([this](std::uint32_t structure) { supports_.finish(structure); });
  work.mechanisms([this](std::uint32_t mechanism) { mechanisms_.store(mechanism); });
  stand_ins_.remove(number_of(group), wide_blocks_);
  wide_.store(wide_blocks_, group.blocks.begin, group.blocks.end, layout_.lanes(), constrained(), overlap_kept(def_.dt),
              load_watch());
  act(layout_.bodies(group));
}

// --- what is not finite --------------------------------------------------------------------------------------

bool ContactSolver::all_finite(std::span<const std::uint32_t> slots) const {
  const SolverBody* const bodies = state_.solver.data() + 1;
  Quad sum = hn::Zero(QuadTag());  // NaN if any body is not finite
  for (const std::uint32_t slot : slots) sum = hn::Add(sum, not_finite(bodies[slot]));
  return hn::AllTrue(QuadTag(), hn::Eq(sum, hn::Zero(QuadTag())));
}

std::span<const std::uint32_t> ContactSolver::find_failed(std::span<const std::uint32_t> slots) {
  failed_.clear();
  for (const std::uint32_t slot : slots)
    if (!(state_.flags[slot] & isolated) && !all_finite({&slot, 1})) failed_.push_back(slot);
  return failed_;
}

bool ContactSolver::isolate_failed(std::span<const std::uint32_t> slots, const Isolate& isolate) {
  const std::span<const std::uint32_t> failed = find_failed(slots);
  if (failed.empty()) return false;
  isolate(failed);
  any_isolated_ = true;
  supports_.let_go(failed);
  if (mechanisms_.empty()) return true;
  mechanisms_.find_again(layout_, pool_.size());
  note_swings();
  return true;
}

// Bodies isolated in this step have been loaded like all others.
void ContactSolver::hold_isolated(std::span<const std::uint32_t> slots) {
  if (!any_isolated_) return;
  for (const std::uint32_t slot : slots) {
    if (!(state_.flags[slot] & isolated)) continue;
    state_.solver_bodies()[slot] = {};
    state_.motion[slot] = {};
  }
}

// --- substeps ------------------------------------------------------------------------------------------------

// Fault injection for tests is compiled separately, so that it costs nothing otherwise.
template <class Work>
void ContactSolver::substeps(const Work& work) {
  const float h = def_.dt / static_cast<float>(def_.solver.substeps);
  const bool fails = body_fault.is_armed.load(std::memory_order_relaxed);
  if (def_.solver.method == Solver::soft)
    fails ? solve_soft<true>(work, h) : solve_soft<false>(work, h);
  else
    fails ? solve_impulse<true>(work, h) : solve_impulse<false>(work, h);
}

template <bool fails, class Work>
void ContactSolver::solve_soft(const Work& work, float h) {
  const SolverSettings& settings = def_.solver;
  SweepParameters soft;
  soft.substep = h;
  soft.inverse_substep = 1 / h;
  soft.contacts = contact_softness(settings, h);
  soft.push_out_velocity = settings.push_out_velocity;
  soft.restitution_threshold = bounce_threshold(def_, h);
  soft.friction_lead = friction_lead(settings, h);
  soft.couplings_follow = couplings_follow();
  const BodyIntegration integrate = integration(h);
  work.structures([&](std::uint32_t structure) { supports_.prepare(structure, wide_, wide_blocks_, h); });
  work.mechanisms([&](std::uint32_t mechanism) { mechanisms_.prepare(mechanism, wide_blocks_, h); });
  for (int substep = 0; substep < settings.substeps; ++substep) {
    begin_substep(work, integrate, soft, substep == 0 || !def_.solver.warm_start);
    if constexpr (fails) fail(work, SolverStage::velocities, substep);
    begin_impulses(work, h, substep == 0);
    if constexpr (fails) fail(work, SolverStage::warm_start, substep);
    sweep(work, &SolverKernels::solve, soft);
    if (soft.couplings_follow) sweep(work, &SolverKernels::solve_couplings, soft);
    work.mechanisms([&](std::uint32_t mechanism) { mechanisms_.pull_together(mechanism, h); });
    if constexpr (fails) fail(work, SolverStage::pushes, substep);
    work.bodies(PositionIntegration(integrate));
    work.move_stand_ins(h);
    if constexpr (fails) fail(work, SolverStage::positions, substep);
    sweep(work, &SolverKernels::relax, soft);
    if (soft.couplings_follow) sweep(work, &SolverKernels::relax_couplings, soft);
    work.mechanisms([&](std::uint32_t mechanism) { mechanisms_.relax(mechanism, h); });
    if constexpr (fails) fail(work, SolverStage::relaxes, substep);
    work.structures([this](std::uint32_t structure) { supports_.solve(structure); });
    if constexpr (fails) fail(work, SolverStage::supports, substep);
  }
}

// Sequential impulses: λ' = −K⁻¹(Jv + b), accumulated and clamped, b from the penetration (dissertation, equations
// 3.20–3.23; Catto 2005 for the factor 0.2 of Baumgarte's b = β/Δt·C). Restitution follows as in the soft step.
template <bool fails, class Work>
void ContactSolver::solve_impulse(const Work& work, float h) {
  SweepParameters p;
  p.substep = h;
  p.inverse_substep = 1 / h;
  p.contacts.dynamic.bias_rate = p.contacts.fixed.bias_rate = baumgarte / h;
  p.push_out_velocity = def_.solver.push_out_velocity;
  p.restitution_threshold = bounce_threshold(def_, h);
  p.friction_lead = friction_lead(def_.solver, h);
  p.couplings_follow = couplings_follow();
  const BodyIntegration integrate = integration(h);
  for (int substep = 0; substep < def_.solver.substeps; ++substep) {
    begin_substep(work, integrate, p, substep == 0 || !def_.solver.warm_start);
    if constexpr (fails) fail(work, SolverStage::velocities, substep);
    begin_impulses(work, h, substep == 0);
    if constexpr (fails) fail(work, SolverStage::warm_start, substep);
    for (int i = 1; i <= def_.solver.iterations; ++i) {
      p.ends_substep = i == def_.solver.iterations;
      sweep(work, &SolverKernels::iterate, p);
      if (p.couplings_follow) sweep(work, &SolverKernels::iterate_couplings, p);
    }
    if constexpr (fails) fail(work, SolverStage::pushes, substep);
    work.bodies(PositionIntegration(integrate));
    work.move_stand_ins(h);
    if constexpr (fails) fail(work, SolverStage::positions, substep);
  }
}

template <class Work>
void ContactSolver::begin_substep(const Work& work, const BodyIntegration& integrate, SweepParameters parameters,
                                  bool first) {
  const Carry carry = first ? Carry::nothing : graph_.may_bounce() ? Carry::as_is : Carry::to_date;
  if (carry == Carry::as_is) work.bodies([integrate](std::uint32_t slot) { integrate.carry(slot); });
  if (graph_.may_bounce()) {
    std::atomic<bool> bounced = true;
    parameters.bounced = &bounced;
    for (int i = 0; i < bounce_sweeps && bounced; ++i) {
      bounced = false;
      sweep(work, &SolverKernels::bounce, parameters);
      work.complete();
    }
  }
  work.bodies([integrate, carry](std::uint32_t slot) { integrate.velocity(slot, carry); });
}

template <class Work>
void ContactSolver::begin_impulses(const Work& work, float h, bool first_substep) {
  if (def_.solver.warm_start && !first_substep) return;
  work.colours([this](const SolverKernels& k, BlockArray blocks, std::size_t begin, std::size_t end) {
    if (def_.solver.warm_start)
      k.warm_start(blocks, begin, end, state_.solver_bodies());
    else
      k.clear(blocks, begin, end);
  });
  work.mechanisms(
      [this, h](std::uint32_t mechanism) { mechanisms_.warm_start(mechanism, h, !def_.solver.warm_start); });
}

template <class Work>
void ContactSolver::sweep(const Work& work, Sweep SolverKernels::*pass, const SweepParameters& parameters) {
  work.colours([this, pass, parameters](const SolverKernels& k, BlockArray blocks, std::size_t begin, std::size_t end) {
    (k.*pass)(blocks, begin, end, state_.solver_bodies(), parameters);
  });
}

template <class Work>
void ContactSolver::fail(const Work& work, SolverStage stage, int substep) {
  if (!body_fault.is_due(stage, static_cast<std::uint32_t>(substep))) return;
  work.bodies([this](std::uint32_t slot) {
    SolverBody& body = state_.solver_bodies()[slot];
    if (body.inverse_mass > 0 && bodies_[slot].filter.category == body_fault.category)
      body_fault.act(body.linear, body.angular);
  });
}

}  // namespace fathom::native
