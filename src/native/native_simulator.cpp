#include "native/native_simulator.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstring>
#include <iterator>
#include <thread>
#include <utility>

#include "check/check.hpp"
#include "dynamics/move_to.hpp"
#include "geometry/compound_query.hpp"
#include "geometry/query.hpp"
#include "geometry/support.hpp"
#include "native/move_bodies.hpp"
#include "native/prefetch.hpp"
#include "native/tuning.hpp"
#include "world/growth.hpp"

namespace fathom {

std::unique_ptr<Simulator> make_native_simulator(const WorldDef& def) {
  return std::make_unique<native::NativeSimulator>(def);
}

namespace native {

namespace {

int thread_count(const WorldDef& def) {
  return def.threads > 0 ? def.threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

std::unique_ptr<BroadPhase> make_broad_phase(const WorldDef& def) {
  return def.broad_phase == fathom::BroadPhase::sweep ? make_sweep_broad_phase(def.sweep_axis)
                                                      : make_tree_broad_phase();
}

/// Runs `verb` and returns the milliseconds it took.
template <class Verb>
double timed(const Verb& verb) {
  const auto start = std::chrono::steady_clock::now();
  verb();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

NativeSimulator::NativeSimulator(const WorldDef& definition)
    : NativeSimulator(definition, make_broad_phase(definition)) {}

NativeSimulator::NativeSimulator(const WorldDef& definition, std::unique_ptr<BroadPhase> broad_phase)
    : Simulator(definition),
      graph_(bodies, state_),
      pool_(thread_count(def)),
      broad_phase_(std::move(broad_phase)),
      solver_(def, bodies, joints, state_, graph_, pool_),
      islands_(def, bodies, joints, state_, graph_) {
  state_.resize(0);
  if (def.partition == Partition::cells) cell_solver_.emplace(def, bodies, state_, graph_, pool_, solver_);
}

// --- the step ------------------------------------------------------------------------------------------------

void NativeSimulator::step() {
  pool_.use(threads_worth_while());
  StageTimes& times = profile.times;
  times.find_pairs = timed([&] { find_pairs(); });
  times.update_manifolds = timed([&] { update_manifolds(); });
  times.build_constraints = timed([&] { build_constraints(); });
  times.solve = timed([&] { solve(); });
  times.finish = timed([&] { finish(); });
  if (pool_.size() > 1) thread_choice_.took(1e-3 * times.total());
  note_moved(MotionType::dynamic);
  profile.step = ++steps;
  count();
  if constexpr (check::validates) validate();
}

// Small scenes are faster on fewer threads than there are: what one thread wrote, the next has to fetch, and threads
// wait for each other at the end of every loop. This is judged by the last step, and then by measuring.
int NativeSimulator::threads_worth_while() {
  if (pool_.size() == 1) return 1;
  const std::uint32_t active = profile.step == 0 ? bodies.count() : profile.counts.active;
  const double work = work_of_body * active + work_of_manifold * profile.counts.manifolds;  // s, about
  const double guess = std::max(1.0, work / ThreadChoice::worth_a_thread);
  const bool alone = work < std::max(min_work_to_share, 2 * waiting_in_a_heap());
  const int most = std::clamp(static_cast<int>(work / hopeless_a_thread), 1, pool_.size());
  return thread_choice_.next(guess, alone ? 1 : guess, most);
}

// What threads would wait for each other (s), were the last step's contacts a heap solved colour by colour, in a
// hundred loops or so. Islands and domains have few.
double NativeSimulator::waiting_in_a_heap() const {
  if (graph_.between() < in_contact_.size() || graph_.domains().in_use()) return 0;
  const std::uint32_t colours = profile.counts.colours;
  return waiting_a_loop * (2.0 * def.solver.substeps * (colours + 1) + colours);
}

void NativeSimulator::isolate_on_request() {
  active_is_current_ = in_contact_is_current_ = false;
  for (const BodyId id : bodies.living())
    if (bodies[id.index].filter.category == body_fault.category && state_.is_dynamic(bodies, id.index))
      isolate(id.index);
}

void NativeSimulator::find_pairs() {
  ended_.clear();
  grow_to(ended_, ended_by_removal_.size());
  std::copy(ended_by_removal_.begin(), ended_by_removal_.end(), ended_.begin());
  ended_by_removal_.clear();
  begun_.clear();
  hits_.clear();
  quarantined_.clear();
  if (!active_is_current_) list_active();
  collect_changed();
  const std::size_t lists = broad_phase_->find(broad_phase_input(), pool_, new_pairs_);
  set_changed_ = false;
  const std::span<const Pair> pairs = joined(std::span(new_pairs_).first(lists));
  added_.clear();
  std::vector<std::uint32_t>* const added = lists_added_ ? &added_ : nullptr;
  if (broad_phase_->lists_pairs_once())
    graph_.add_new(pairs, pool_, added);
  else
    graph_.add(pairs, added);
  wake_below_fixed();
}

std::span<const Pair> NativeSimulator::joined(std::span<const std::vector<Pair>> lists) {
  if (lists.size() == 1) return lists[0];
  std::size_t count = 0;
  for (const std::vector<Pair>& list : lists) count += list.size();
  give_back_room(pairs_to_add_, count);
  make_room(pairs_to_add_, count);
  for (const std::vector<Pair>& list : lists) pairs_to_add_.insert(pairs_to_add_.end(), list.begin(), list.end());
  return pairs_to_add_;
}

void NativeSimulator::make_room_for_changes() {
  // Few enough blocks to be looked through by one thread, enough to be shared out.
  constexpr std::size_t max_blocks = 512, max_chunks = 8;
  const std::size_t chunks = (graph_.size() + contact_grain - 1) / contact_grain;
  block_size_ = std::clamp<std::size_t>(chunks / max_blocks, 1, max_chunks) * contact_grain;
  const std::size_t blocks = (graph_.size() + block_size_ - 1) / block_size_;
  grow_to(blocks_, blocks);
  grow_to(block_counts_, blocks);
}

NativeSimulator::BlockOfChanges& NativeSimulator::begin_block(std::size_t first_contact) {
  BlockOfChanges& block = blocks_[first_contact / block_size_];
  block.begun.clear();
  block.ended.clear();
  block.gone.clear();
  block.fast.clear();
  block.recycled = 0;
  block.has_new_parts = false;
  return block;
}

void NativeSimulator::end_block(std::size_t first_contact) {
  const std::size_t number = first_contact / block_size_;
  const BlockOfChanges& block = blocks_[number];
  const auto counted = [](std::size_t n) { return static_cast<std::uint16_t>(n); };
  // Written once: those of other threads' blocks lie beside them.
  block_counts_[number] = {counted(block.recycled),    counted(block.begun.size()), counted(block.ended.size()),
                           counted(block.gone.size()), counted(block.fast.size()),  block.has_new_parts};
}

void NativeSimulator::update_manifolds() {
  const auto size = static_cast<std::uint32_t>(graph_.size());
  make_room_for_changes();
  const Constrained constrained = graph_.constrained();
  pool_.for_each_chunk(size, block_size_, [&](std::size_t begin, std::size_t end) {
    BlockOfChanges& block = begin_block(begin);
    for (std::size_t chunk = begin; chunk < end; chunk += contact_grain) {
      const auto first = static_cast<std::uint32_t>(chunk);
      const auto last = static_cast<std::uint32_t>(std::min(chunk + contact_grain, end));
      Change changes[contact_grain];
      update_contacts({constrained.contacts, size}, first, last, constrained.manifolds, narrow_phase(block), changes);
      for (std::uint32_t i = first; i < last; ++i) note(block, i, changes[i - first]);
    }
    end_block(begin);
  });
}

void NativeSimulator::build_constraints() {
  take_over_changes();
  if (body_fault.is_due(SolverStage::before_step, 0)) isolate_on_request();
  if (!active_is_current_) list_active();
  if (!in_contact_is_current_) list_in_contact();
  if (!cell_solver_) divide_if_worth_while();
  // Most of the laying out is one thread's work. Meanwhile the others move bodies without contacts, which nothing else
  // looks at any more. One thread does that when it no longer needs the other bodies in its cache.
  are_free_moved_ = pool_.thread_count() > 1 && 2 * in_contact_.size() < active_.size();
  if (are_free_moved_)
    move_free([&] { lay_out_constraints(); });
  else
    lay_out_constraints();
  if (cell_solver_)
    cell_solver_->build(in_contact_);
  else
    solver_.build();
}

void NativeSimulator::lay_out_constraints() {
  if (cell_solver_) return;
  if (pool_.thread_count() > 1 && !solver_.may_use_domains()) neighbourhood_.update(*broad_phase_, state_.size());
  solver_.lay_out({in_contact_, contact_sorting_, kinematic_}, neighbourhood_, steps + 1);
}

void NativeSimulator::solve() {
  const auto move = [&](std::span<const std::uint32_t> slots) {
    if (quarantined_.empty()) return move_part<true>(slots);
    std::vector<std::uint32_t> others;
    for (const std::uint32_t slot : slots)
      if (!(state_.flags[slot] & isolated)) others.push_back(slot);
    move_part<true>(others);
  };
  const Isolate isolate_all = [&](std::span<const std::uint32_t> slots) {
    for (const std::uint32_t slot : slots) isolate(slot);
  };
  if (!cell_solver_) {
    solver_.solve(move, isolate_all);
    return solver_.supports().end_step(steps + 1, !quarantined_.empty());
  }
  for (;;) {
    cell_solver_->solve(in_contact_);
    const std::span<const std::uint32_t> failed = solver_.find_failed(in_contact_);
    if (failed.empty()) break;
    isolate_all(failed);
    std::erase_if(in_contact_, [&](std::uint32_t slot) { return state_.flags[slot] & isolated; });
    cell_solver_->build(in_contact_);
  }
  cell_solver_->store();
  pool_.for_each_part(in_contact_.size(), bodies_a_thread, [&](std::size_t begin, std::size_t end) {
    move(std::span(in_contact_).subspan(begin, end - begin));
  });
}

void NativeSimulator::finish() {
  if (!are_free_moved_) move_free([] {});
  if (failed_.exchange(0, std::memory_order_relaxed) > 0) isolate_moved();
  hold_back_fast();
  report_touches();
  if (!active_is_current_) list_active();
  for (const std::uint32_t slot : forced_) {
    state_.forces[slot] = {};
    state_.flags[slot] &= static_cast<std::uint8_t>(~has_force);
  }
  forced_.clear();
  if (def.sleep.enabled && islands_.put_to_sleep(active_)) active_is_current_ = in_contact_is_current_ = false;
  arrive();
}

// --- parts of the step ---------------------------------------------------------------------------------------

template <bool in_contact>
void NativeSimulator::move_part(std::span<const std::uint32_t> slots) {
  const float h = def.dt / static_cast<float>(def.solver.substeps);
  const MoveParameters parameters{.gravity = def.gravity,
                                  .dt = def.dt,
                                  .substeps = def.solver.substeps,
                                  .limits = speed_limits(def.solver.max_linear_speed, h),
                                  .sleeping = def.sleep.enabled,
                                  .slow_below = def.sleep.linear_speed,
                                  .forced = !forced_.empty(),
                                  .scattered = pool_.thread_count() > 1 || graph_.domains().in_use(),
                                  .strays = &strays_};
  if (const std::size_t failed = move_bodies<in_contact>(slots, bodies, state_, parameters)) failed_ += failed;
}

void NativeSimulator::list_active() {
  active_.clear();
  for (const BodyId id : bodies.living())
    if (state_.flags[id.index] & awake) active_.push_back(id.index);
  active_is_current_ = true;
  in_contact_is_current_ = false;
}

BroadPhaseInput NativeSimulator::broad_phase_input() const {
  return {bodies, state_, graph_.pairs(), changed(), changed_at_rest_, set_changed_};
}

// Large heaps have domains, which are drawn anew when bodies have moved so much that a sweep has become a quarter
// longer, or there are twice or half as many contacts.
void NativeSimulator::divide_if_worth_while() {
  const std::size_t contacts = graph_.between();
  if (!graph_.domains().in_use()) {
    if (contacts >= min_to_divide && contacts >= in_contact_.size()) divide();
    return;
  }
  if (2 * contacts < min_to_divide || 2 * contacts < in_contact_.size()) {
    graph_.divide({}, pool_);
    return;
  }
  const Cost now = cost_of_domains(), then = cost_when_divided_;
  if (now.contacts > 2 * then.contacts || 2 * now.contacts < then.contacts ||
      4 * now.sweep * then.contacts > 5 * then.sweep * now.contacts)
    divide();
}

void NativeSimulator::divide() {
  std::vector<std::uint32_t> dynamic;
  dynamic.reserve(active_.size());
  std::ranges::copy_if(active_, std::back_inserter(dynamic),
                       [this](std::uint32_t slot) { return !(state_.flags[slot] & kinematic); });
  graph_.divide(dynamic, pool_);
  cost_when_divided_ = cost_of_domains();
}

// A sweep's length in contacts of one thread, were there as many threads as domains, times their number.
NativeSimulator::Cost NativeSimulator::cost_of_domains() const {
  const Domains& domains = graph_.domains();
  Cost cost{0, graph_.between()};
  for (std::size_t division = 0; division < Domains::divisions; ++division) {
    std::size_t largest = 0;
    for (std::size_t i = 0; i < domains.count(division); ++i)
      largest = std::max(largest, graph_.size_of_unit(domains.first_unit(division) + i));
    cost.sweep += largest * domains.count(0);
  }
  cost.sweep += graph_.size_of_unit(domains.remainder()) * domains.count(0);
  return cost;
}

// Awake bodies that the solver moves, ascending.
void NativeSimulator::list_in_contact() {
  ++contact_sorting_;
  in_contact_is_current_ = true;
  in_contact_.clear();
  kinematic_.clear();
  for (std::size_t i = 0; i < state_.to_solve.size(); ++i)
    for (std::uint64_t bits = state_.to_solve[i]; bits != 0; bits &= bits - 1) {
      const auto slot = static_cast<std::uint32_t>(64 * i) + static_cast<std::uint32_t>(std::countr_zero(bits));
      if (!(state_.flags[slot] & awake)) continue;
      in_contact_.push_back(slot);
      if (state_.flags[slot] & kinematic) kinematic_.push_back(slot);
    }
}

template <class Alone>
void NativeSimulator::move_free(const Alone& alone) {
  pool_.for_each_chunk_beside(alone, active_.size(), free_grain, [&](std::size_t begin, std::size_t end) {
    std::array<std::uint32_t, bodies_a_thread> free;
    while (begin < end) {
      std::size_t count = 0;
      for (; begin < end && count < free.size(); ++begin) {
        free[count] = active_[begin];
        count += !state_.is_to_solve(active_[begin]);
      }
      move_part<false>({free.data(), count});
    }
  });
}

// All bodies flagged `box_changed`, ascending: those the last step moved out of their boxes and those edited since.
void NativeSimulator::collect_changed() {
  const std::vector<std::uint8_t>& flags = state_.flags;
  const std::size_t chunks = (flags.size() + flags_grain - 1) / flags_grain;
  if (changed_.size() < flags.size()) {
    grow_to(changed_, flags.size());
    grow_to(changed_in_chunk_, chunks);
  }
  pool_.for_each_chunk(flags.size(), flags_grain, [&](std::size_t begin, std::size_t end) {
    ChangedBodies found;
    std::uint32_t* const slots = &changed_[begin];
    // Without branches, which nobody could predict.
    const auto look_at = [&](std::size_t first, std::size_t last) {
      for (std::size_t slot = first; slot < last; ++slot) {
        const std::uint8_t f = flags[slot];
        slots[found.count] = static_cast<std::uint32_t>(slot);
        found.count += (f & box_changed) != 0;
        found.at_rest |= (f & (box_changed | awake)) == box_changed;
      }
    };
    // Eight at a time, because mostly none of them has.
    constexpr std::uint64_t any_changed = box_changed * 0x0101010101010101u;
    std::size_t slot = begin;
    for (; slot + 8 <= end; slot += 8) {
      std::uint64_t eight;
      std::memcpy(&eight, &flags[slot], 8);
      if (eight & any_changed) look_at(slot, slot + 8);
    }
    look_at(slot, end);
    changed_in_chunk_[begin / flags_grain] = found;
  });
  std::size_t count = 0;
  changed_at_rest_ = false;
  for (std::size_t i = 0; i < chunks; ++i) {
    const auto first = changed_.begin() + static_cast<std::ptrdiff_t>(i * flags_grain);
    std::copy_n(first, changed_in_chunk_[i].count, changed_.begin() + static_cast<std::ptrdiff_t>(count));
    count += changed_in_chunk_[i].count;
    changed_at_rest_ |= changed_in_chunk_[i].at_rest;
  }
  changed_count_ = count;
}

std::span<const Pose> NativeSimulator::refresh_queries() {
  tree_.refresh(bodies, state_.bounds.data(), pool_);
  return state_.poses;
}

void NativeSimulator::note_moved(MotionType motion) {
  outdate_queries();
  tree_.note_moved(motion);
}

void NativeSimulator::note_set(std::uint32_t slot) {
  outdate_queries();
  tree_.note_set(bodies[slot].motion);
  set_changed_ = true;
  active_is_current_ = false;
}

void NativeSimulator::place(std::uint32_t slot, const Pose& pose, const Velocity& v) {
  const BodyInfo& info = bodies[slot];
  state_.poses[slot] = pose;
  state_.velocities[slot] = v;
  BodyBounds& bounds = state_.bounds[slot];
  bounds.box = motion_box(info, pose, v, def.dt);
  if (!contains(bounds.fat_box, bounds.box)) {
    bounds.fat_box = fat_box(info, bounds.box, v.linear, def.dt);
    state_.flags[slot] |= box_changed;
  }
}

// The body stays where it is, a fixed obstacle, until it is moved by hand.
void NativeSimulator::isolate(std::uint32_t slot) {
  state_.flags[slot] = static_cast<std::uint8_t>((state_.flags[slot] | isolated) & ~awake);
  Pose pose = state_.poses[slot];
  pose.reserved = 0;
  place(slot, pose, {});
  state_.solver_bodies()[slot] = {};
  graph_.for_each_of(slot, [&](std::uint32_t index) {
    if (!graph_[index].touching()) return;
    ContactManifold& m = graph_.manifold(graph_[index]);
    for (float& impulse : m.impulses) impulse = 0;
    m.friction_impulse[0] = m.friction_impulse[1] = m.twist_impulse = 0;
    if (graph_[index].round) m.set_rolling_impulse({});
  });
  for (const std::uint32_t joint : joints.of(slot)) graph_.forget_joint_impulse(joint);
  if (state_.flags[slot] & jointed) graph_.note_obstacle();
  quarantined_.push_back({bodies.id(slot), steps + 1});
}

void NativeSimulator::arrive() {
  for (auto target = targets_.rbegin(); target != targets_.rend(); ++target) {
    std::uint8_t& flags = state_.flags[target->slot];
    if ((flags & (targeted | awake)) == (targeted | awake)) place(target->slot, target->pose, {});
    flags &= static_cast<std::uint8_t>(~targeted);
  }
  targets_.clear();
  active_is_current_ = false;
}

/// Those that failed when they were moved, where nothing can have noticed them.
void NativeSimulator::isolate_moved() {
  for (const std::uint32_t slot : active_)
    if ((state_.flags[slot] & (isolated | awake)) == (isolated | awake)) isolate(slot);
}

std::size_t NativeSimulator::list_bytes() const {
  const auto bytes_of = [](const auto&... array) { return (... + (array.capacity() * sizeof(*array.begin()))); };
  std::size_t bytes = bytes_of(blocks_, block_counts_, changed_blocks_, edges_begun_, edges_ended_, pairs_gone_,
                               first_manifolds_, begun_, ended_, hits_, pairs_to_add_) +
                      neighbourhood_.memory_bytes();
  if (!new_pairs_.empty()) bytes += bytes_of(new_pairs_[0]);
  for (const auto* list : {&active_, &in_contact_, &kinematic_, &changed_, &forced_, &added_})
    bytes += list->capacity() * sizeof(std::uint32_t);
  return bytes;
}

void NativeSimulator::count() {
  StepCounts& counts = profile.counts;
  counts.bodies = bodies.count();
  counts.active = static_cast<std::uint32_t>(active_.size());
  counts.pairs = static_cast<std::uint32_t>(graph_.pair_count());
  counts.manifolds = 0;
  for (int colour = 0; colour <= overflow_colour; ++colour)
    counts.manifolds += static_cast<std::uint32_t>(graph_.size_of(colour));
  if (cell_solver_) {
    counts.points = static_cast<std::uint32_t>(cell_solver_->point_count());
    counts.work_groups = static_cast<std::uint32_t>(cell_solver_->cell_count());
  } else {
    counts.points = static_cast<std::uint32_t>(solver_.point_count());
    counts.colours = static_cast<std::uint32_t>(solver_.colours_in_use());
    counts.overflow = static_cast<std::uint32_t>(graph_.size_of(overflow_colour));
  }
  counts.islands = islands_.count();
  counts.quarantined = static_cast<std::uint32_t>(quarantined_.size());
  counts.memory_bytes = bodies.memory_bytes() + state_.memory_bytes() + graph_.memory_bytes() +
                        broad_phase_->memory_bytes() + tree_.memory_bytes() + solver_.memory_bytes() +
                        (cell_solver_ ? cell_solver_->memory_bytes() : 0) + list_bytes();
}

// --- changes by the application --------------------------------------------------------------------------------

void NativeSimulator::body_added(std::uint32_t slot, const Pose& pose, const Velocity& velocity) {
  if (slot >= state_.size()) {
    state_.resize(slot + 1);
    graph_.resize(slot + 1);
  }
  state_.clear(slot);
  const BodyInfo& info = bodies[slot];
  state_.poses[slot] = pose;
  state_.velocities[slot] = velocity;
  state_.bounds[slot] = bounds_of(info, pose, velocity, def.dt);
  state_.flight[slot] = flight_data(info);
  state_.flags[slot] = static_cast<std::uint8_t>(box_changed | (info.motion == MotionType::fixed ? 0 : awake) |
                                                 (info.motion == MotionType::kinematic ? kinematic : 0));
  state_.note_filter(slot, info);
  state_.note_to_solve(slot);
  note_set(slot);
}

void NativeSimulator::body_removed(std::uint32_t slot) {
  graph_.for_each_of(slot, [&](std::uint32_t index) {
    const Contact& c = graph_[index];
    const std::uint32_t other = c.a == slot ? c.b : c.a;
    if (c.touching()) wake_island(other);
  });
  graph_.for_each_of(slot, [&](std::uint32_t index) { drop_contact(index, ended_by_removal_); });
  islands_.forget(slot);
  solver_.supports().overloads().forget(slot);
  state_.clear(slot);
  std::erase(forced_, slot);
  note_set(slot);
}

void NativeSimulator::set_pose(std::uint32_t slot, const Pose& pose) {
  note_moved(bodies[slot].motion);
  wake(slot);
  wake_neighbours(slot);
  state_.flags[slot] &= static_cast<std::uint8_t>(~targeted);
  state_.poses[slot] = pose;
  state_.bounds[slot] = bounds_of(bodies[slot], pose, state_.velocities[slot], def.dt);
  state_.flags[slot] |= box_changed;
}

void NativeSimulator::set_velocity(std::uint32_t slot, const Velocity& velocity) {
  note_moved(bodies[slot].motion);
  wake(slot);
  if (state_.flags[slot] & kinematic) {
    state_.flags[slot] &= static_cast<std::uint8_t>(~targeted);
    if (is_moving(velocity)) wake_neighbours(slot);
  }
  place(slot, state_.poses[slot], velocity);
}

void NativeSimulator::move_to(std::uint32_t slot, const Pose& pose) {
  set_velocity(slot, velocity_between(state_.poses[slot], pose, def.dt));
  state_.flags[slot] |= targeted;
  targets_.push_back({pose, slot});
}

void NativeSimulator::material_changed(std::uint32_t slot) {
  wake(slot);
  wake_neighbours(slot);
  graph_.for_each_of(slot, [&](std::uint32_t index) { graph_.mix_materials(graph_[index]); });
}

void NativeSimulator::info_changed(std::uint32_t slot) {
  state_.flight[slot] = flight_data(bodies[slot]);
  wake(slot);
}

void NativeSimulator::filter_changed(std::uint32_t slot) {
  state_.note_filter(slot, bodies[slot]);
  wake(slot);
  wake_neighbours(slot);
  graph_.for_each_of(slot, [&](std::uint32_t index) { drop_contact(index, ended_by_removal_); });
  state_.flags[slot] |= box_changed;  // so that it looks for pairs again
}

void NativeSimulator::wake(std::uint32_t slot) {
  state_.slow_time[slot] = 0;
  if (bodies[slot].motion == MotionType::fixed || state_.flags[slot] & awake) return;
  if (state_.flags[slot] & isolated) {
    state_.flags[slot] = static_cast<std::uint8_t>((state_.flags[slot] & ~isolated) | awake);
    if (state_.flags[slot] & jointed) graph_.note_obstacle();
  } else {
    islands_.wake(slot);
  }
  active_is_current_ = false;
}

// What happens to others does not free a quarantined body.
void NativeSimulator::wake_island(std::uint32_t slot) {
  state_.slow_time[slot] = 0;
  if (!is_asleep(slot)) return;
  islands_.wake(slot);
  active_is_current_ = false;
}

void NativeSimulator::wake_neighbours(std::uint32_t slot) {
  if (!islands_.any_asleep()) return;
  for (const std::uint32_t joint : joints.of(slot)) wake_joined(joint);
  graph_.for_each_of(slot, [&](std::uint32_t index) {
    const Contact& c = graph_[index];
    if (c.touching()) wake_island(c.a == slot ? c.b : c.a);
  });
}

// Nobody else looks at a pair of which neither body is awake.
void NativeSimulator::wake_below_fixed() {
  if (!changed_at_rest_ || !islands_.any_asleep()) return;
  for (const std::uint32_t slot : changed()) {
    if (bodies[slot].motion != MotionType::fixed) continue;
    graph_.for_each_of(slot, [&](std::uint32_t index) {
      const std::uint32_t other = graph_[index].a == slot ? graph_[index].b : graph_[index].a;
      if (overlaps(state_.bounds[slot].box, state_.bounds[other].box)) wake_island(other);
    });
  }
}

void NativeSimulator::gravity_changed() {
  std::vector<std::uint32_t> slots;
  islands_.for_each_with([&](std::uint32_t slot) { return bodies[slot].gravity_scale != 0; },
                         [&](std::uint32_t slot) { slots.push_back(slot); });
  for (const std::uint32_t slot : slots) wake_island(slot);
}

void NativeSimulator::apply(std::uint32_t slot, Vec3 force, Vec3 torque) {
  wake(slot);
  if (!(state_.flags[slot] & has_force)) forced_.push_back(slot);
  state_.flags[slot] |= has_force;
  state_.forces[slot].force += force;
  state_.forces[slot].torque += torque;
}

// --- results and queries -----------------------------------------------------------------------------------------

Aabb NativeSimulator::bounds(std::uint32_t slot) const {
  return tight_bounds(bodies[slot].geometry, state_.poses[slot]);
}

void NativeSimulator::for_each_contact(const std::function<void(const ContactInfo&)>& visit) const {
  for (std::uint32_t i = 0; i < graph_.size(); ++i)
    if (graph_[i].in_use && graph_[i].in_touch) visit(contact_info(i));
}

void NativeSimulator::for_each_contact_of(std::uint32_t slot, const std::function<void(const ContactInfo&)>& visit) {
  graph_.for_each_of(slot, [&](std::uint32_t i) {
    if (graph_[i].in_touch) visit(contact_info(i));
  });
}

ContactInfo NativeSimulator::contact_info(std::uint32_t i) const {
  const Contact& c = graph_[i];
  const ContactManifold& m = graph_.manifold(c);
  const Pose &pa = state_.poses[c.a], &pb = state_.poses[c.b];
  const ContactEvent ids = event(c.a, c.b);
  const Vec3 normal = rotate(pa.rotation, m.normal);
  ContactInfo info{ids.a, ids.b, c.b < c.a ? -normal : normal, m.point_count(), {}};
  if (c.colour < colour_count) info.colour = c.colour;
  const Children children = graph_.children(i);
  info.child_a = c.b < c.a ? children.b : children.a;
  info.child_b = c.b < c.a ? children.a : children.b;
  for (int p = 0; p < info.point_count; ++p) {
    const Vec3 on_a = transform(pa, m.points[p].anchor_a), on_b = transform(pb, m.points[p].anchor_b);
    info.points[p] = {0.5f * (on_a + on_b), dot(on_b - on_a, normal), m.step_impulse_of(p)};
  }
  return info;
}

}  // namespace native
}  // namespace fathom
