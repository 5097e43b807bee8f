#include "native/native_simulator.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <thread>
#include <utility>

#include "check/check.hpp"
#include "geometry/compound_query.hpp"
#include "native/move_bodies.hpp"
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
      islands_(def, bodies, joints, state_, graph_),
      pre_solve_(bodies, state_, graph_, callbacks) {
  state_.resize(0);
  if (def.partition == Partition::cells) cell_solver_.emplace(def, bodies, state_, graph_, pool_, solver_);
}

// --- the step ------------------------------------------------------------------------------------------------

void NativeSimulator::step() {
  pool_.use(threads_worth_while());
  StageTimes& times = profile.times;
  times.find_pairs = timed([&] { find_pairs(); });
  times.update_manifolds = timed([&] {
    update_manifolds();
    pre_solve_.ask(changes_);
  });
  times.build_constraints = timed([&] { build_constraints(); });
  times.solve = timed([&] { solve(); });
  times.finish = timed([&] { finish(); });
  if (pool_.size() > 1) threads_.took(1e-3 * times.total());
  outdate_queries();
  tree_.note_others_moved();
  profile.step = ++steps;
  count();
  if constexpr (check::validates) validate();
}

int NativeSimulator::threads_worth_while() {
  StepCounts counts = profile.counts;
  if (profile.step == 0) counts.active = bodies.count();
  const double waiting = ThreadBudget::waiting_in_a_heap(graph_, active_.in_contact().size(), counts.colours,
                                                         static_cast<std::uint32_t>(def.solver.substeps));
  return threads_.next(counts, {graph_.coloured_joints(), solver_.mechanisms().links()}, waiting, pool_.size());
}

void NativeSimulator::isolate_on_request() {
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
  find_new_pairs();
}

void NativeSimulator::find_new_pairs() {
  active_.refresh(bodies, state_);
  changed_.collect(state_.flags, pool_);
  const std::size_t lists = broad_phase_->find(broad_phase_input(), pool_, new_pairs_);
  set_changes_.clear();
  const std::span<const Pair> pairs = let_collide(joined(std::span(new_pairs_).first(lists)));
  added_.clear();
  std::vector<std::uint32_t>* const added = lists_added_ ? &added_ : nullptr;
  if (broad_phase_->lists_pairs_once())
    graph_.add_new(pairs, pool_, added);
  else
    graph_.add(pairs, added);
  wake_below_fixed();
}

void NativeSimulator::optimize_broad_phase() {
  std::vector<std::uint32_t> found;
  for (const std::uint32_t slot : set_changes_) {
    bool is_fresh = bodies.alive(slot) && bodies[slot].motion == MotionType::fixed;
    graph_.for_each_of(slot, [&](std::uint32_t) { is_fresh = false; });
    if (is_fresh) found.push_back(slot);
  }
  pool_.use(pool_.size());
  find_new_pairs();
  // The next step need not find them again. But bodies with existing contacts must still be tested for having parted.
  for (const std::uint32_t slot : found) state_.flags[slot] &= static_cast<std::uint8_t>(~box_changed);
  tree_.refresh(bodies, state_.bounds.data(), pool_);
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

bool NativeSimulator::lets_collide(std::uint32_t a, std::uint32_t b) {
  if (!callbacks.filter || !(bodies[a].custom_filter || bodies[b].custom_filter)) return true;
  return callbacks.lets_collide(bodies.id(std::min(a, b)), bodies.id(std::max(a, b)));
}

std::span<const Pair> NativeSimulator::let_collide(std::span<const Pair> pairs) {
  if (!callbacks.filter || !bodies.any_custom_filter()) return pairs;
  pairs_let_.clear();
  make_room(pairs_let_, pairs.size());
  for (const Pair pair : pairs)
    if (graph_.pairs().contains(pair.a, pair.b) || lets_collide(pair.a, pair.b)) pairs_let_.push_back(pair);
  return pairs_let_;
}

void NativeSimulator::find_seams() {
  const FixedTree* tree = broad_phase_->fixed();
  if (tree == nullptr) {
    tree_.refresh_fixed(bodies, state_.bounds.data(), pool_);
    tree = &tree_.fixed();
  }
  seams_.find(*tree, pool_);
}

void NativeSimulator::update_manifolds() {
  find_seams();
  const auto size = static_cast<std::uint32_t>(graph_.size());
  changes_.make_room(graph_);
  const Constrained constrained = graph_.constrained();
  pool_.for_each_chunk(size, changes_.block_size(), [&](std::size_t begin, std::size_t end) {
    ContactChanges::Block& block = changes_.begin_block(begin);
    for (std::size_t chunk = begin; chunk < end; chunk += contact_grain) {
      const auto first = static_cast<std::uint32_t>(chunk);
      const auto last = static_cast<std::uint32_t>(std::min(chunk + contact_grain, end));
      Change changes[contact_grain];
      update_contacts({constrained.contacts, size}, first, last, constrained.manifolds, narrow_phase(block), changes);
      for (std::uint32_t i = first; i < last; ++i) block.note(graph_, i, changes[i - first]);
    }
    changes_.end_block(begin);
  });
}

void NativeSimulator::build_constraints() {
  apply_changes();
  if (body_fault.is_due(SolverStage::before_step, 0)) isolate_on_request();
  active_.refresh_in_contact(bodies, state_);
  const std::size_t in_contact = active_.in_contact().size(), active = active_.active().size();
  if (!cell_solver_) division_.update(graph_, active_.active(), in_contact, state_, pool_);
  // Most of the layout is one thread's work. Meanwhile the others move free bodies, which nothing else reads any more.
  // A single thread does that once it no longer needs the other bodies in its cache. So do several where free bodies
  // may get back momentum, which belongs to the layout.
  are_free_moved_ = pool_.thread_count() > 1 && 2 * in_contact < active && !solver_.supports().overloads().any_listed();
  if (are_free_moved_)
    move_free([&] { lay_out_constraints(); });
  else
    lay_out_constraints();
  if (cell_solver_)
    cell_solver_->build(active_.in_contact());
  else
    solver_.build();
}

void NativeSimulator::lay_out_constraints() {
  if (cell_solver_) return;
  if (pool_.thread_count() > 1 && !solver_.may_use_domains()) neighbourhood_.update(*broad_phase_, state_.size());
  solver_.lay_out({active_.in_contact(), active_.sorting(), active_.kinematic()}, neighbourhood_, steps + 1);
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
    cell_solver_->solve(active_.in_contact());
    const std::span<const std::uint32_t> failed = solver_.find_failed(active_.in_contact());
    if (failed.empty()) break;
    isolate_all(failed);
    active_.drop_isolated(state_);
    cell_solver_->build(active_.in_contact());
  }
  cell_solver_->store();
  pool_.for_each_part(active_.in_contact().size(), bodies_a_thread, [&](std::size_t begin, std::size_t end) {
    move(active_.in_contact().subspan(begin, end - begin));
  });
}

void NativeSimulator::finish() {
  if (!are_free_moved_) move_free([] {});
  if (failed_.exchange(0, std::memory_order_relaxed) > 0) isolate_moved();
  hold_back_fast();
  report_touches();
  active_.refresh(bodies, state_);
  for (const std::uint32_t slot : forced_) {
    state_.forces[slot] = {};
    state_.flags[slot] &= static_cast<std::uint8_t>(~has_force);
  }
  forced_.clear();
  if (def.sleep.enabled && islands_.put_to_sleep(active_.active())) active_.outdate();
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
                                  .jointed = joints.count() > 0,
                                  .scattered = pool_.thread_count() > 1 || graph_.domains().in_use(),
                                  .strays = &strays_};
  if (const std::size_t failed = move_bodies<in_contact>(slots, bodies, state_, parameters)) failed_ += failed;
}

BroadPhaseInput NativeSimulator::broad_phase_input() const {
  return {bodies, state_, graph_.pairs(), changed_.slots(), changed_.any_at_rest(), set_changes_};
}

template <class Alone>
void NativeSimulator::move_free(const Alone& alone) {
  const std::span<const std::uint32_t> active = active_.active();
  pool_.for_each_chunk_beside(alone, active.size(), free_grain, [&](std::size_t begin, std::size_t end) {
    std::array<std::uint32_t, bodies_a_thread> free;
    while (begin < end) {
      std::size_t count = 0;
      for (; begin < end && count < free.size(); ++begin) {
        free[count] = active[begin];
        count += !state_.is_to_solve(active[begin]);
      }
      move_part<false>({free.data(), count});
    }
  });
}

std::span<const Pose> NativeSimulator::refresh_queries() {
  tree_.refresh(bodies, state_.bounds.data(), pool_);
  return state_.poses;
}

/// On the world's threads, unless another query is using them.
void NativeSimulator::divide_query(std::size_t count, const std::function<void(std::size_t, std::size_t)>& run) const {
  const std::unique_lock lock(dividing_, std::try_to_lock);
  if (!lock) return run(0, count);
  const int before = pool_.thread_count();
  pool_.use(pool_.size());
  pool_.for_each_part(count, min_queries_of_part, run);
  pool_.use(before);
}

void NativeSimulator::note_moved(std::uint32_t slot) {
  outdate_queries();
  if (bodies[slot].motion == MotionType::fixed)
    tree_.note_fixed_moved(slot);
  else
    tree_.note_others_moved();
}

void NativeSimulator::note_set(std::uint32_t slot) {
  outdate_queries();
  tree_.note_set(slot);
  set_changes_.push_back(slot);
  active_.outdate();
}

void NativeSimulator::set_state(std::uint32_t slot, const Pose& pose, const Velocity& v) {
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

// The body stays where it is, as a fixed obstacle, until the application moves it.
void NativeSimulator::isolate(std::uint32_t slot) {
  state_.flags[slot] = static_cast<std::uint8_t>((state_.flags[slot] | isolated) & ~awake);
  Pose pose = state_.poses[slot];
  pose.reserved = 0;
  set_state(slot, pose, {});
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
  active_.outdate();
}

void NativeSimulator::arrive() {
  for (auto target = targets_.rbegin(); target != targets_.rend(); ++target) {
    std::uint8_t& flags = state_.flags[target->slot];
    if ((flags & (targeted | awake)) == (targeted | awake)) set_state(target->slot, target->pose, {});
    flags &= static_cast<std::uint8_t>(~targeted);
  }
  targets_.clear();
}

/// Isolates bodies that failed as they were moved, before anything has seen them.
void NativeSimulator::isolate_moved() {
  for (const std::uint32_t slot : active_.active())
    if ((state_.flags[slot] & (isolated | awake)) == (isolated | awake)) isolate(slot);
}

std::size_t NativeSimulator::list_bytes() const {
  const auto bytes_of = [](const auto&... array) { return (... + (array.capacity() * sizeof(*array.begin()))); };
  const std::size_t of_pairs = new_pairs_.empty() ? 0 : bytes_of(new_pairs_[0]);
  return of_pairs + bytes_of(begun_, ended_, hits_, pairs_to_add_, pairs_let_, forced_, added_) +
         pre_solve_.memory_bytes() + changes_.memory_bytes() + active_.memory_bytes() + changed_.memory_bytes() +
         neighbourhood_.memory_bytes();
}

void NativeSimulator::count() {
  StepCounts& counts = profile.counts;
  counts.bodies = bodies.count();
  counts.active = static_cast<std::uint32_t>(active_.active().size());
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
                        broad_phase_->memory_bytes() + tree_.memory_bytes() + seams_.memory_bytes() +
                        solver_.memory_bytes() + (cell_solver_ ? cell_solver_->memory_bytes() : 0) + list_bytes();
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
