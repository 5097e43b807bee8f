#include "native/native_simulator.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include "dynamics/manifold_update.hpp"
#include "geometry/query.hpp"
#include "geometry/support.hpp"
#include "native/move_bodies.hpp"
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
      solver_(def, bodies, state_, graph_, pool_),
      islands_(def, bodies, state_, graph_) {
  state_.resize(0);
  if (def.partition == Partition::cells) cell_solver_.emplace(def, bodies, state_, graph_, pool_, solver_);
}

// --- the step ------------------------------------------------------------------------------------------------

void NativeSimulator::step() {
  StageTimes& times = profile.times;
  times.find_pairs = timed([&] { find_pairs(); });
  times.update_manifolds = timed([&] { update_manifolds(); });
  times.build_constraints = timed([&] { build_constraints(); });
  times.solve = timed([&] { solve(); });
  times.finish = timed([&] { finish(); });
  queries_are_current_ = false;
  profile.step = ++steps;
  count();
}

void NativeSimulator::find_pairs() {
  ended_.clear();
  ended_.swap(ended_by_removal_);
  begun_.clear();
  hits_.clear();
  quarantined_.clear();
  if (!active_is_current_) list_active();
  collect_changed();
  broad_phase_->find(broad_phase_input(), pool_, new_pairs_);
  edited_.clear();
  set_changed_ = false;
  added_.clear();
  for (const std::vector<Pair>& list : new_pairs_)
    for (const Pair pair : list)
      if (!graph_.pairs().contains(pair.a, pair.b)) added_.push_back(graph_.add(pair));
}

void NativeSimulator::make_room_for_changes() {
  grow_to(changes_, graph_.size());
  chunks_of_changes_.resize(std::max(chunks_of_changes_.size(), graph_.size() / contact_grain + 1));
}

void NativeSimulator::update_manifolds() {
  make_room_for_changes();
  pool_.for_each_chunk(graph_.size(), contact_grain, [&](std::size_t begin, std::size_t end) {
    ChunkOfChanges& chunk = chunks_of_changes_[begin / contact_grain];
    chunk.begun.clear();
    chunk.recycled = 0;
    chunk.any_ended = false;
    for (auto i = static_cast<std::uint32_t>(begin); i < end; ++i) {
      Contact& c = graph_[i];
      changes_[i] = Change::nothing;
      if (!c.in_use || !is_active(c)) continue;
      ContactManifold* manifold = c.touching() ? &graph_.manifold(c) : nullptr;
      changes_[i] = update_contact(i, c, manifold, bodies, state_, def.dt, chunk.begun);
      chunk.note(changes_[i]);
    }
  });
}

void NativeSimulator::build_constraints() {
  take_over_changes();
  for (const std::uint32_t slot : changed_) state_.flags[slot] &= static_cast<std::uint8_t>(~box_changed);
  if (!active_is_current_) list_active();
  if (!in_contact_is_current_) {
    in_contact_.clear();
    free_.clear();
    for (const std::uint32_t slot : active_) {
      // Kinematic bodies go with the solver, which must see them move.
      const bool solved = graph_.in_contact(slot) || bodies[slot].motion == MotionType::kinematic;
      (solved ? in_contact_ : free_).push_back(slot);
    }
    in_contact_is_current_ = true;
  }
  if (cell_solver_)
    cell_solver_->build(in_contact_);
  else
    solver_.build(in_contact_);
}

void NativeSimulator::solve() {
  if (cell_solver_) {
    cell_solver_->solve(in_contact_);
    cell_solver_->store();
  } else {
    solver_.solve(in_contact_);
    solver_.store();
  }
}

void NativeSimulator::finish() {
  const MoveParameters parameters{
      def.gravity, def.dt, def.solver.substeps, def.solver.max_linear_speed, def.sleep.enabled, def.sleep.linear_speed};
  changed_chunks_.assign(state_.size() / body_grain + 1, 0);
  std::atomic<std::size_t> failed = 0;
  const auto move = [&](std::span<const std::uint32_t> slots, auto move_chunk) {
    pool_.for_each_chunk(slots.size(), body_grain, [&](std::size_t begin, std::size_t end) {
      const auto chunk = slots.subspan(begin, end - begin);
      if (const std::size_t count = move_chunk(chunk, bodies, state_, parameters)) failed += count;
      mark_changed(chunk);
    });
  };
  move(in_contact_, move_bodies<true>);
  move(free_, move_bodies<false>);
  if (failed > 0) quarantine_failed();
  for (const std::uint32_t slot : forced_) {
    state_.forces[slot] = {};
    state_.flags[slot] &= static_cast<std::uint8_t>(~has_force);
  }
  forced_.clear();
  if (def.sleep.enabled && islands_.put_to_sleep(active_)) active_is_current_ = in_contact_is_current_ = false;
}

// --- parts of the step ---------------------------------------------------------------------------------------

void NativeSimulator::list_active() {
  active_.clear();
  for (const BodyId id : bodies.living())
    if (state_.flags[id.index] & awake) active_.push_back(id.index);
  active_is_current_ = true;
  in_contact_is_current_ = false;
}

BroadPhaseInput NativeSimulator::broad_phase_input() const {
  return {bodies, state_, graph_.pairs(), changed_, set_changed_};
}

// Chunks of slots that hold bodies with new fat boxes, so that only these are searched for them.
void NativeSimulator::mark_changed(std::span<const std::uint32_t> slots) {
  for (const std::uint32_t slot : slots)
    if (state_.flags[slot] & box_changed)
      std::atomic_ref(changed_chunks_[slot / body_grain]).store(1, std::memory_order_relaxed);
}

// All bodies flagged `box_changed`, ascending: those the last step moved out of their boxes and those edited since.
void NativeSimulator::collect_changed() {
  changed_.clear();
  for (std::size_t chunk = 0; chunk < changed_chunks_.size(); ++chunk) {
    if (!changed_chunks_[chunk]) continue;
    const auto end = static_cast<std::uint32_t>(std::min(state_.size(), (chunk + 1) * body_grain));
    for (auto slot = static_cast<std::uint32_t>(chunk * body_grain); slot < end; ++slot)
      if (state_.flags[slot] & box_changed) changed_.push_back(slot);
  }
  if (edited_.empty()) return;
  for (const std::uint32_t slot : edited_)
    if (bodies.alive(slot) && state_.flags[slot] & box_changed) changed_.push_back(slot);
  std::sort(changed_.begin(), changed_.end());
  changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
}

// Between steps the tree may not know of boxes that the last step or the application changed.
void NativeSimulator::refresh_for_queries() {
  if (queries_are_current_) return;
  if (!active_is_current_) list_active();
  collect_changed();
  broad_phase_->refresh(broad_phase_input(), pool_);
  queries_are_current_ = true;
}

ContactEvent NativeSimulator::event(const Contact& c) const {
  return {bodies.id(std::min(c.a, c.b)), bodies.id(std::max(c.a, c.b))};
}

// What the narrow phase found, in the order of contacts.
void NativeSimulator::take_over_changes() {
  const auto size = static_cast<std::uint32_t>(changes_.size());
  const std::size_t chunks = (size + contact_grain - 1) / contact_grain;
  profile.counts.recycled = 0;
  for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
    profile.counts.recycled += chunks_of_changes_[chunk].recycled;
    if (!chunks_of_changes_[chunk].any_ended) continue;
    const auto begin = static_cast<std::uint32_t>(chunk * contact_grain);
    for (std::uint32_t i = begin; i < std::min(size, begin + static_cast<std::uint32_t>(contact_grain)); ++i) {
      if (changes_[i] == Change::ended)
        end_touching(i);
      else if (changes_[i] == Change::gone)
        drop_contact(i, ended_);
    }
  }
  for (std::size_t chunk = 0; chunk < chunks; ++chunk)
    for (const NewManifold& fresh : chunks_of_changes_[chunk].begun) begin_touching(fresh);
}

void NativeSimulator::begin_touching(const NewManifold& fresh) {
  const std::uint32_t index = fresh.contact;
  graph_.begin(index);
  const Contact& c = graph_[index];
  set_manifold(graph_.manifold(c), fresh.manifold, fresh.b_in_a);
  for (const std::uint32_t slot : {c.a, c.b})
    if (!(state_.flags[slot] & (awake | isolated)) && bodies[slot].motion == MotionType::dynamic) {
      islands_.wake(slot);
      active_is_current_ = false;
    }
  if (c.colour == no_colour) graph_.colour(index);
  in_contact_is_current_ = false;
  begun_.push_back(event(c));
  report_hit(c);
}

void NativeSimulator::end_touching(std::uint32_t index) {
  if (graph_[index].colour != no_colour) graph_.uncolour(index);
  in_contact_is_current_ = false;
  ended_.push_back(event(graph_[index]));
  graph_.end(index);
}

void NativeSimulator::drop_contact(std::uint32_t index, std::vector<ContactEvent>& ended) {
  if (graph_[index].touching()) {
    ended.push_back(event(graph_[index]));
    in_contact_is_current_ = false;
  }
  graph_.remove(index);
}

void NativeSimulator::report_hit(const Contact& c) {
  const ContactManifold& m = graph_.manifold(c);
  const Pose &pa = state_.poses[c.a], &pb = state_.poses[c.b];
  const Velocity &va = state_.velocities[c.a], &vb = state_.velocities[c.b];
  const Vec3 normal = rotate(pa.rotation, m.normal);
  float fastest = 0;
  Vec3 where;
  for (int i = 0; i < m.point_count(); ++i) {
    const Vec3 arm_a = rotate(pa.rotation, m.points[i].anchor_a), arm_b = rotate(pb.rotation, m.points[i].anchor_b);
    const Vec3 speed = (vb.linear + cross(vb.angular, arm_b)) - (va.linear + cross(va.angular, arm_a));
    if (-dot(speed, normal) > fastest) fastest = -dot(speed, normal), where = pa.position + arm_a;
  }
  if (fastest <= def.solver.restitution_threshold) return;
  const bool swapped = c.b < c.a;
  const ContactEvent ids = event(c);
  hits_.push_back({ids.a, ids.b, where, swapped ? -normal : normal, fastest});
}

void NativeSimulator::place(std::uint32_t slot, const Pose& pose, const Velocity& v) {
  const BodyInfo& info = bodies[slot];
  state_.poses[slot] = pose;
  state_.velocities[slot] = v;
  const Aabb box = motion_box(info, pose, v, def.dt);
  state_.boxes[slot] = box;
  if (!contains(state_.fat_boxes[slot], box)) {
    state_.fat_boxes[slot] = fat_box(info, box, v.linear, def.dt);
    state_.flags[slot] |= box_changed;
  }
}

void NativeSimulator::quarantine_failed() {
  for (const std::uint32_t slot : active_) {
    if (!(state_.flags[slot] & isolated)) continue;
    state_.flags[slot] &= static_cast<std::uint8_t>(~awake);
    state_.solver_bodies()[slot] = {};
    graph_.for_each_of(slot, [&](std::uint32_t index) {
      if (!graph_[index].touching()) return;
      ContactManifold& m = graph_.manifold(graph_[index]);
      for (float& impulse : m.impulses) impulse = 0;
      m.friction_impulse[0] = m.friction_impulse[1] = m.twist_impulse = 0;
    });
    quarantined_.push_back({bodies.id(slot), steps + 1});
  }
  active_is_current_ = false;
}

std::size_t NativeSimulator::list_bytes() const {
  std::size_t bytes = changes_.capacity() * sizeof(Change) + chunks_of_changes_.capacity() * sizeof(ChunkOfChanges) +
                      changed_chunks_.capacity();
  for (const auto* list : {&active_, &in_contact_, &free_, &changed_, &edited_, &forced_})
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
    counts.manifolds += static_cast<std::uint32_t>(graph_.of_colour(colour).size());
  if (cell_solver_) {
    counts.points = static_cast<std::uint32_t>(cell_solver_->point_count());
    counts.work_groups = static_cast<std::uint32_t>(cell_solver_->cell_count());
  } else {
    counts.points = static_cast<std::uint32_t>(solver_.point_count());
    counts.colours = static_cast<std::uint32_t>(solver_.colours_in_use());
    counts.overflow = static_cast<std::uint32_t>(graph_.of_colour(overflow_colour).size());
  }
  counts.islands = islands_.count();
  counts.quarantined = static_cast<std::uint32_t>(quarantined_.size());
  counts.memory_bytes = bodies.memory_bytes() + state_.memory_bytes() + graph_.memory_bytes() +
                        broad_phase_->memory_bytes() + solver_.memory_bytes() +
                        (cell_solver_ ? cell_solver_->memory_bytes() : 0) + list_bytes();
}

// --- changes by the application --------------------------------------------------------------------------------

void NativeSimulator::body_added(std::uint32_t slot, const Pose& pose, const Velocity& velocity) {
  queries_are_current_ = false;
  if (slot >= state_.size()) state_.resize(slot + 1);
  state_.clear(slot);
  const BodyInfo& info = bodies[slot];
  state_.poses[slot] = pose;
  state_.velocities[slot] = velocity;
  state_.boxes[slot] = motion_box(info, pose, velocity, def.dt);
  state_.fat_boxes[slot] = fat_box(info, state_.boxes[slot], velocity.linear, def.dt);
  state_.flags[slot] = static_cast<std::uint8_t>(box_changed | (info.motion == MotionType::fixed ? 0 : awake));
  edited_.push_back(slot);
  set_changed_ = true;
  active_is_current_ = false;
}

void NativeSimulator::body_removed(std::uint32_t slot) {
  queries_are_current_ = false;
  graph_.for_each_of(slot, [&](std::uint32_t index) {
    const Contact& c = graph_[index];
    const std::uint32_t other = c.a == slot ? c.b : c.a;
    if (c.touching()) wake(other);
  });
  graph_.for_each_of(slot, [&](std::uint32_t index) { drop_contact(index, ended_by_removal_); });
  islands_.forget(slot);
  state_.clear(slot);
  std::erase(forced_, slot);
  set_changed_ = true;
  active_is_current_ = false;
}

void NativeSimulator::set_pose(std::uint32_t slot, const Pose& pose) {
  queries_are_current_ = false;
  wake(slot);
  graph_.for_each_of(slot,
                     [&](std::uint32_t index) { wake(graph_[index].a == slot ? graph_[index].b : graph_[index].a); });
  const BodyInfo& info = bodies[slot];
  const Velocity& v = state_.velocities[slot];
  state_.poses[slot] = pose;
  state_.boxes[slot] = motion_box(info, pose, v, def.dt);
  state_.fat_boxes[slot] = fat_box(info, state_.boxes[slot], v.linear, def.dt);
  state_.flags[slot] |= box_changed;
  edited_.push_back(slot);
}

void NativeSimulator::set_velocity(std::uint32_t slot, const Velocity& velocity) {
  queries_are_current_ = false;
  wake(slot);
  place(slot, state_.poses[slot], velocity);
  if (state_.flags[slot] & box_changed) edited_.push_back(slot);
}

void NativeSimulator::material_changed(std::uint32_t slot) {
  wake(slot);
  graph_.for_each_of(slot, [&](std::uint32_t index) { graph_.mix_materials(graph_[index]); });
}

void NativeSimulator::filter_changed(std::uint32_t slot) {
  queries_are_current_ = false;
  wake(slot);
  graph_.for_each_of(slot,
                     [&](std::uint32_t index) { wake(graph_[index].a == slot ? graph_[index].b : graph_[index].a); });
  graph_.for_each_of(slot, [&](std::uint32_t index) { drop_contact(index, ended_by_removal_); });
  state_.flags[slot] |= box_changed;  // so that it looks for pairs again
  edited_.push_back(slot);
}

void NativeSimulator::wake(std::uint32_t slot) {
  state_.slow_time[slot] = 0;
  if (bodies[slot].motion == MotionType::fixed || state_.flags[slot] & awake) return;
  if (state_.flags[slot] & isolated)
    state_.flags[slot] = static_cast<std::uint8_t>((state_.flags[slot] & ~isolated) | awake);
  else
    islands_.wake(slot);
  active_is_current_ = false;
}

void NativeSimulator::apply(std::uint32_t slot, Vec3 force, Vec3 torque) {
  if (bodies[slot].motion != MotionType::dynamic) return;
  wake(slot);
  if (!(state_.flags[slot] & has_force)) forced_.push_back(slot);
  state_.flags[slot] |= has_force;
  state_.forces[slot].force += force;
  state_.forces[slot].torque += torque;
}

// --- results and queries -----------------------------------------------------------------------------------------

Aabb NativeSimulator::bounds(std::uint32_t slot) const {
  return fathom::bounds(bodies[slot].geometry, state_.poses[slot]);
}

void NativeSimulator::for_each_contact(const std::function<void(const ContactInfo&)>& visit) const {
  for (std::uint32_t i = 0; i < graph_.size(); ++i) {
    const Contact& c = graph_[i];
    if (!c.in_use || !c.touching()) continue;
    const ContactManifold& m = graph_.manifold(c);
    const Pose &pa = state_.poses[c.a], &pb = state_.poses[c.b];
    const ContactEvent ids = event(c);
    const Vec3 normal = rotate(pa.rotation, m.normal);
    ContactInfo info{ids.a, ids.b, c.b < c.a ? -normal : normal, m.point_count(), {}};
    if (c.colour < colour_count) info.colour = c.colour;
    for (int p = 0; p < info.point_count; ++p) {
      const Vec3 on_a = transform(pa, m.points[p].anchor_a), on_b = transform(pb, m.points[p].anchor_b);
      info.points[p] = {0.5f * (on_a + on_b), dot(on_b - on_a, normal), m.step_impulse_of(p)};
    }
    visit(info);
  }
}

std::optional<RayHit> NativeSimulator::ray_cast(Vec3 origin, Vec3 translation, std::uint32_t mask) const {
  const_cast<NativeSimulator*>(this)->refresh_for_queries();
  std::vector<std::uint32_t> candidates;
  broad_phase_->ray(origin, translation, candidates);
  std::optional<RayHit> nearest;
  std::sort(candidates.begin(), candidates.end());
  for (const std::uint32_t slot : candidates) {
    if ((bodies[slot].filter.category & mask) == 0) continue;
    const auto hit = fathom::ray_cast(bodies[slot].geometry, state_.poses[slot], origin, translation);
    if (!hit || (nearest && nearest->fraction <= hit->fraction)) continue;
    nearest = RayHit{bodies.id(slot), hit->fraction, mul_add(origin, hit->fraction, translation), hit->normal};
  }
  return nearest;
}

void NativeSimulator::overlap(const Aabb& box, std::uint32_t mask, std::vector<std::uint32_t>& slots) const {
  const_cast<NativeSimulator*>(this)->refresh_for_queries();
  broad_phase_->overlap(box, slots);
  std::erase_if(slots, [&](std::uint32_t slot) {
    return (bodies[slot].filter.category & mask) == 0 || !overlaps(bounds(slot), box);
  });
}

}  // namespace native
}  // namespace fathom
