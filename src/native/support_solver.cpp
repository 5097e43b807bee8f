#include "native/support_solver.hpp"

#include <algorithm>

#include "dynamics/inverse_inertia.hpp"
#include "dynamics/moving_surface.hpp"
#include "native/tuning.hpp"
#include "world/archive.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

Vec3 get3(const LaneFields& f, int field) { return {f[field], f[field + 1], f[field + 2]}; }

bool moves(const Velocity& v) { return length_squared(v.linear) + length_squared(v.angular) > 0; }

constexpr float not_a_member = -1;

}  // namespace

float SupportSolver::contact_stiffness() const {
  const float gravity = length(def_.gravity);
  if (!(gravity > 0)) return 0;
  const float omega = 2 * pi * contact_hertz(def_.solver, def_.dt / static_cast<float>(def_.solver.substeps));
  return omega * omega / gravity;
}

void SupportSolver::update(std::span<const std::uint32_t> in_contact, const ConstraintLayout& layout, bool has_moved,
                           std::uint64_t step) {
  overloads_.resize(state_.size());  // benchmarks fill a state without a simulator
  stiffness_ = contact_stiffness();
  const bool has_weight = stiffness_ > 0;
  // What was found under gravity is not valid without: bodies and contacts come and go.
  if (!has_weight && !support_graph_.is_clear()) support_graph_.clear();
  const bool is_new = has_weight && support_graph_.update(in_contact, overloads_, stiffness_, step);
  const bool any = !support_graph_.empty();
  if (any) {
    if (is_new || has_moved) {
      structures_.assign(support_graph_.structures().size(), {});
      body_.resize(support_graph_.members().size());
      contact_.resize(support_graph_.supports().size());
      find_lanes(layout);
      order_by_group(layout);
    }
    find_bases();
  }
  overloads_.advance([this](std::uint32_t slot) { return (state_.flags[slot] & awake) != 0; }, state_.velocities);
  if (!any) {
    for (const std::uint32_t slot : held_slots_) held_[slot] = not_a_member;
    held_slots_.clear();
    structures_.clear();
    order_.clear();
    return;
  }
  if (may_move()) carry_along(step);
  choose_held();
}

// Bodies that move with their base are settled, whatever its velocity.
void SupportSolver::find_bases() {
  for (std::size_t i = 0; i < structures_.size(); ++i) {
    const SupportGraph::Structure& s = support_graph_.structures()[i];
    StructureState& state = structures_[i];
    state = {};
    state.has_base = find_base(s, state.base);
    if (!state.has_base || (state.base.linear == Vec3{} && state.base.angular == Vec3{})) continue;
    for (std::uint32_t k = s.first; k < s.end; ++k) {
      const std::uint32_t slot = member(k).slot;
      if (is_settled(velocity_against(state.base, slot))) overloads_.settle(slot);
    }
  }
}

// Changes velocities before the solver loads bodies.
void SupportSolver::carry_along(std::uint64_t step) {
  const float fall = length(def_.gravity) * def_.dt;
  for (std::size_t i = 0; i < structures_.size(); ++i) {
    const SupportGraph::Structure& s = support_graph_.structures()[i];
    for (std::uint32_t k = s.first; k < s.end; ++k) {
      body_[k].carried = {};
      if (!structures_[i].has_base) continue;
      const std::uint32_t slot = member(k).slot;
      Vec3& velocity = state_.velocities[slot].linear;
      const Vec3 base = velocity - velocity_against(structures_[i].base, slot);
      const Vec3 change = overloads_.base(slot).change_to(base, velocity, static_cast<std::uint32_t>(step), fall);
      const CarriedAlong carried = carried_along(change, overloads_.inertia_scale(slot), fall, def_.dt);
      velocity += carried.gained;
      body_[k].carried = carried.acceleration;
    }
  }
}

// New members of a structure count as held at once. Otherwise springs that yield to the load a solution gave their
// contacts would release it again.
void SupportSolver::choose_held() {
  make_room(held_, state_.size());
  held_.resize(state_.size(), not_a_member);
  const std::span<const SupportGraph::Member> members = support_graph_.members();
  last_held_.resize(members.size());
  for (std::size_t k = 0; k < members.size(); ++k) last_held_[k] = held_[members[k].slot];
  for (const std::uint32_t slot : held_slots_) held_[slot] = not_a_member;
  held_slots_.clear();
  for (std::size_t i = 0; i < structures_.size(); ++i) {
    const SupportGraph::Structure& s = support_graph_.structures()[i];
    StructureState& state = structures_[i];
    state.is_held = state.has_base && is_calm(s, state.base);
    for (std::uint32_t k = s.first; state.is_held && k < s.end; ++k) {
      held_[members[k].slot] = last_held_[k] < 0 ? 1 : last_held_[k];
      held_slots_.push_back(members[k].slot);
    }
  }
}

void SupportSolver::find_lanes(const ConstraintLayout& layout) {
  const std::size_t count = layout.lane_count();
  grow_to(lane_of_, graph_.size());
  for (std::size_t i = 0; i < count; ++i) {
    const ConstraintRef ref = layout.lanes()[i];
    if (ref != none && kind_of(ref) == ConstraintKind::contact) lane_of_[ref] = static_cast<std::uint32_t>(i);
  }
  lanes_.resize(contact_.size());
  for (std::size_t i = 0; i < lanes_.size(); ++i) lanes_[i] = lane_of_[support_graph_.supports()[i].contact];
}

// A structure is part of an island, hence of one group: that of its first support's block.
void SupportSolver::order_by_group(const ConstraintLayout& layout) {
  const auto lane = [&](std::uint32_t structure) {
    return lanes_[member(support_graph_.structures()[structure].first).first_support];
  };
  order_.resize(structures_.size());
  for (std::uint32_t i = 0; i < order_.size(); ++i) order_[i] = i;
  std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) { return lane(a) < lane(b); });
  first_of_group_.clear();
  std::uint32_t next = 0;
  for (const ConstraintLayout::Group& group : layout.groups()) {
    first_of_group_.push_back(next);
    while (next < order_.size() && lane(order_[next]) < group.blocks.end * layout.width()) ++next;
  }
  first_of_group_.push_back(next);
}

// --- prepare -------------------------------------------------------------------------------------------------

void SupportSolver::prepare(std::uint32_t structure, const SolverKernels& kernels, BlockArray blocks, float h) {
  const SupportGraph::Structure& s = support_graph_.structures()[structure];
  if (may_move())
    for (std::uint32_t i = s.first; i < s.end; ++i) state_.motion[member(i).slot].acceleration += body_[i].carried;
  if (!structures_[structure].is_held) return;
  const auto width = static_cast<std::size_t>(kernels.width);
  structures_[structure].fall = length(def_.gravity) * h;
  for (std::uint32_t i = s.first; i < s.end; ++i) {
    const SupportGraph::Member& m = member(i);
    for (std::uint32_t k = m.first_support; k < m.first_support + m.support_count; ++k)
      contact_[k].fields = {blocks.blocks + lanes_[k] / width * blocks.stride, width, lanes_[k] % width};
    load_body(i, structures_[structure].base);
    load_supports(i, structures_[structure].fall, h);
  }
}

bool SupportSolver::may_move() const { return !bodies_.kinematic().empty() || graph_.any_moving_surface(); }

/// Whether a moving obstacle pushes the body down: nothing rests on it.
bool SupportSolver::is_press(const SupportGraph::Support& support) const {
  if (!moves(state_.velocities[support.base])) return false;
  const fathom::native::Contact& c = graph_[support.contact];
  if (graph_.any_moving_surface() && c.on_moving_surface) return false;
  return dot(rotate(state_.poses[c.a].rotation, graph_.manifold(c).normal), def_.gravity) > 0;
}

/// Whether two bodies move as one.
bool SupportSolver::moves_along(const Base& a, const Base& b) {
  const Vec3 expected = b.linear + cross(b.angular, a.position - b.position);
  const float speed = length(a.linear) + length(b.linear);
  return a.angular == b.angular && length(a.linear - expected) <= same_motion * speed;
}

/// False if a structure stands on bodies that move differently, or touches an isolated body.
bool SupportSolver::find_base(const SupportGraph::Structure& s, Base& base) const {
  bool any = false;
  for (std::uint32_t i = s.first; i < s.end; ++i) {
    const SupportGraph::Member& m = member(i);
    for (std::uint32_t k = m.first_support; k < m.first_support + m.support_count; ++k) {
      const SupportGraph::Support& support = support_graph_.supports()[k];
      if (support.lower == none && may_move() && !support_graph_.touches(support.contact)) continue;
      if (support.lower == none && is_press(support)) continue;
      const bool on_surface = graph_.any_moving_surface() && graph_[support.contact].on_moving_surface;
      if (support.lower != none && on_surface) return false;  // its bodies do not move as one
      if (support.lower != none) continue;
      if (state_.flags[support.base] & isolated) return false;
      const Velocity& v = state_.velocities[support.base];
      Base found = moves(v) ? Base{state_.poses[support.base].position, v.linear, v.angular} : Base{};
      if (on_surface && !goes_along(support.contact, found)) return false;
      if (any && !moves_along(found, base)) return false;
      if (!any) base = found;
      any = true;
    }
  }
  return any;
}

/// Adds the surface's motion to that of what stands on it. False if that motion is not tangential to the contact.
bool SupportSolver::goes_along(std::uint32_t contact, Base& base) const {
  const fathom::native::Contact& c = graph_[contact];
  const Vec3 slide = graph_.surface_slide(contact);
  base.linear = base.linear - slide;
  return is_along_surface(slide, rotate(state_.poses[c.a].rotation, graph_.manifold(c).normal));
}

Vec3 SupportSolver::velocity_against(const Base& base, std::uint32_t slot) const {
  const Vec3 arm = state_.poses[slot].position - base.position;
  return state_.velocities[slot].linear - (base.linear + cross(base.angular, arm));
}

bool SupportSolver::is_calm(const SupportGraph::Structure& s, const Base& base) const {
  float energy = 0, mass = 0;
  for (std::uint32_t i = s.first; i < s.end; ++i) {
    const std::uint32_t slot = member(i).slot;
    const float m = bodies_[slot].mass;
    energy = fma(0.5f * m, length_squared(velocity_against(base, slot)), energy);
    mass += m;
  }
  return energy <= calm_energy * mass;
}

void SupportSolver::load_body(std::uint32_t i, const Base& base) {
  const std::uint32_t slot = member(i).slot;
  const SolverBody& body = state_.solver_bodies()[slot];
  Body& b = body_[i];
  b.is_held = false;
  b.mass = 0;
  if (!(body.inverse_mass > 0)) return;
  b.mass = 1 / body.inverse_mass;
  // Along the chord of the step's path.
  const Vec3 arm = state_.poses[slot].position - base.position;
  b.target_linear =
      base.linear + cross(base.angular, arm) + carried_speed<float>(arm, (0.5f * def_.dt) * base.angular, base.angular);
  b.target_angular = base.angular;
  const float inverse = body.inverse_inertia;
  if (inverse > 0) {
    const float inertia = 1 / inverse;
    b.inertia = {{inertia, 0, 0}, {0, inertia, 0}, {0, 0, inertia}};
    b.inverse_inertia = tensor(inverse);
  } else {
    b.inverse_inertia = tensor(state_.inertia[slot]);
    const float scale = b.mass * bodies_[slot].inverse_mass;
    b.inertia = to_matrix(rotated(to_matrix(state_.poses[slot].rotation), scale * bodies_[slot].inertia));
  }
}

float SupportSolver::speed_of(std::uint32_t i, Vec3 arm) const {
  const SolverBody& body = state_.solver_bodies()[member(i).slot];
  return support_speed(body.linear - body_[i].target_linear, body.angular - body_[i].target_angular, arm);
}

void SupportSolver::load_supports(std::uint32_t i, float fall, float h) {
  const SupportGraph::Member& m = member(i);
  Body& b = body_[i];
  if (!(b.mass > 0)) return;
  const float body_weight = b.mass * length(state_.motion[m.slot].acceleration) * h;
  Triangle6 rows;
  bool any = false;
  for (std::uint32_t k = m.first_support; k < m.first_support + m.support_count; ++k) {
    const std::uint32_t lower = support_graph_.supports()[k].lower;
    contact_[k].acts =
        (lower == none ? !is_press(support_graph_.supports()[k]) : body_[lower].is_held) && load_rows(k, body_weight);
    if (!contact_[k].acts) continue;
    SupportRows& r = contact_[k].rows;
    const float own_speed = speed_of(i, r.arm_upper);
    const float speed = lower == none ? own_speed : max(own_speed, speed_of(lower, r.arm_lower));
    r.max_load = max_load(inverse_mass(i), r.arm_upper, speed, fall, h);
    if (lower != none) r.max_load = min(r.max_load, max_load(inverse_mass(lower), r.arm_lower, speed, fall, h));
    add_support(rows, r, 0);
    any = true;
  }
  b.is_held = any && factorise(rows, b.factor);
  for (std::uint32_t k = m.first_support; !b.is_held && k < m.first_support + m.support_count; ++k)
    contact_[k].acts = false;
}

bool SupportSolver::load_rows(std::uint32_t support, float body_weight) {
  const SupportGraph::Support& s = support_graph_.supports()[support];
  const LaneFields& f = contact_[support].fields;
  SupportRows& r = contact_[support].rows;
  const int count = graph_.manifold(graph_[s.contact]).point_count();
  contact_[support].count = count;
  r.n = get3(f, normal_x), r.t1 = get3(f, tangent_x);
  r.arm_upper = get3(f, s.b_is_upper ? arm_b_x : arm_a_x);
  r.arm_lower = get3(f, s.b_is_upper ? arm_a_x : arm_b_x);
  r.up = s.b_is_upper ? 1.0f : -1.0f;
  r.friction = f[friction], r.twist_radius = f[patch_radius];
  if (graph_.any_by_direction() && graph_[s.contact].by_direction)
    r.friction *= smallest_friction(f[grain_1], f[grain_2]);
  SupportPoints points;
  points.count = count;
  for (int i = 0; i < max_manifold_points; ++i) {
    r.x[i] = points.x[i] = i < count ? f[point_field(i, point_x)] : 0;
    r.y[i] = points.y[i] = i < count ? f[point_field(i, point_y)] : 0;
    points.separation[i] = i < count ? f[point_field(i, point_separation)] : 0;
  }
  const ContactImpulses now = impulses(f, count);
  weigh_points(r, now, touching_points(points, now, r.arm_upper), body_weight);
  return r.holds();
}

ContactImpulses SupportSolver::impulses(const LaneFields& f, int count) {
  ContactImpulses p;
  for (int i = 0; i < count; ++i) p.normal[i] = f[point_field(i, point_impulse)];
  p.slide_1 = f[friction_impulse_1], p.slide_2 = f[friction_impulse_2], p.twist = f[twist_impulse];
  p.step = f[step_impulse];
  return p;
}

// --- solve ---------------------------------------------------------------------------------------------------

/// The active supports of a member.
class SupportSolver::SupportsOf {
 public:
  SupportsOf(SupportSolver& solver, const SupportGraph::Member& m) : s_(solver) {
    for (std::uint32_t k = m.first_support; k < m.first_support + m.support_count && count_ < most; ++k)
      if (s_.contact_[k].acts) index_[count_++] = k;
  }
  static constexpr int most = colour_count;  // a body has one contact of each colour

  int count() const { return count_; }
  Contact& contact(int k) const { return s_.contact_[index_[k]]; }
  const SupportRows& rows(int k) const { return contact(k).rows; }
  SupportChange& change(int k) const { return contact(k).change; }
  ContactImpulses impulses(int k) const { return SupportSolver::impulses(contact(k).fields, contact(k).count); }

 private:
  SupportSolver& s_;
  std::uint32_t index_[most];
  int count_ = 0;
};

void SupportSolver::solve(std::uint32_t structure) {
  const SupportGraph::Structure& s = support_graph_.structures()[structure];
  StructureState& state = structures_[structure];
  if (!state.is_held || state.is_left_alone) return;
  SolverBody* const bodies = state_.solver_bodies();
  float slope = 0, curvature = 0, energy = 0, mass = 0, calm = 1;
  for (std::uint32_t i = s.end; i-- > s.first;) {
    Body& b = body_[i];
    if (!b.is_held) continue;
    const SupportGraph::Member& m = member(i);
    const SolverBody& body = bodies[m.slot];
    const Vec3 linear = body.linear - b.target_linear, angular = body.angular - b.target_angular;
    Wrench passed_on;
    for (const std::uint32_t k : support_graph_.loads(m))
      if (contact_[k].acts) passed_on += about_centre(contact_[k].given, contact_[k].rows.arm_lower);
    const Wrench excess{b.mass * linear, b.inertia * angular};
    const float own_energy = dot(linear, excess.force) + dot(angular, excess.torque);
    Wrench demand = passed_on;
    demand += -excess;
    SupportsOf supports(*this, m);
    b.gained = ask_supports(supports, b.factor, demand);
    b.gained += -passed_on;
    for (int k = 0; k < supports.count(); ++k)
      supports.contact(k).given = wrench_of(supports.rows(k), supports.change(k));
    b.linear_change = body.inverse_mass * b.gained.force;
    b.angular_change = b.inverse_inertia * b.gained.torque;
    const float own_slope = dot(linear, b.gained.force) + dot(angular, b.gained.torque);
    const float own_curvature = dot(b.linear_change, b.gained.force) + dot(b.angular_change, b.gained.torque);
    calm = min(calm, calm_part(own_energy, own_slope, own_curvature, b.mass));
    energy += own_energy, slope += own_slope, curvature += own_curvature, mass += b.mass;
  }
  if (!is_finite(energy) || !is_finite(slope) || !is_finite(curvature)) return;  // some body will be isolated
  state.part = min(best_part(slope, curvature), calm);
  state.held = part_held(energy_left(state.part, slope, curvature, energy), mass, state.fall);
  if (!is_worth_making(state.part, slope, curvature, energy)) {
    state.is_left_alone = !state.was_made;
    return;
  }
  state.was_made = true;
  for (std::uint32_t i = s.first; i < s.end; ++i) {
    const Body& b = body_[i];
    if (!b.is_held) continue;
    const SupportGraph::Member& m = member(i);
    SolverBody& body = bodies[m.slot];
    body.linear = mul_add(body.linear, state.part, b.linear_change);
    body.angular = mul_add(body.angular, state.part, b.angular_change);
    for (std::uint32_t k = m.first_support; k < m.first_support + m.support_count; ++k) {
      if (!contact_[k].acts) continue;
      const LaneFields& f = contact_[k].fields;
      ContactImpulses p = impulses(f, contact_[k].count);
      apply_change(contact_[k].rows, contact_[k].change, state.part, p);
      for (int j = 0; j < max_manifold_points; ++j)
        if (contact_[k].rows.weight[j] > 0) f[point_field(j, point_impulse)] = p.normal[j];
      f[friction_impulse_1] = p.slide_1, f[friction_impulse_2] = p.slide_2, f[twist_impulse] = p.twist;
      f[step_impulse] = p.step;
    }
  }
}

void SupportSolver::let_go(std::span<const std::uint32_t> isolated_slots) {
  for (std::size_t i = 0; i < structures_.size(); ++i) {
    const SupportGraph::Structure& s = support_graph_.structures()[i];
    const auto is_gone = [&](const SupportGraph::Member& m) {
      return std::find(isolated_slots.begin(), isolated_slots.end(), m.slot) != isolated_slots.end();
    };
    const auto members = support_graph_.members().subspan(s.first, s.end - s.first);
    if (std::none_of(members.begin(), members.end(), is_gone)) continue;
    structures_[i].is_held = false;
    for (const SupportGraph::Member& m : members) held_[m.slot] = not_a_member;
  }
}

void SupportSolver::finish(std::uint32_t structure) {
  const SupportGraph::Structure& s = support_graph_.structures()[structure];
  if (!structures_[structure].is_held) return;
  for (std::uint32_t i = s.first; i < s.end; ++i)
    held_[member(i).slot] = body_[i].is_held ? structures_[structure].held : 0;
}

// Out of line: in most scenes no load adds inertia.
void SupportSolver::give_back() {
  overloads_.give_back([this](std::uint32_t slot) { return is_free(slot); }, bodies_, state_.velocities,
                       length(def_.gravity) * def_.dt);
}

void SupportSolver::take_up() {
  overloads_.take_up([this](std::uint32_t slot) { return is_free(slot); }, state_.velocities, -normalize(def_.gravity));
}

void SupportSolver::rest_if_none_is_held(std::uint64_t step, bool any_isolated) {
  if (any_isolated) support_graph_.forget_levels();
  if (empty()) return;
  const auto is_held = [](const StructureState& s) { return s.is_held; };
  if (std::none_of(structures_.begin(), structures_.end(), is_held)) support_graph_.rest_until(step + steps_to_resume);
}

// --- the remainder -------------------------------------------------------------------------------------------

void SupportSolver::restore(ByteReader& in, std::size_t slots) {
  archive(*this, in);
  in.require(held_.size() <= slots);
  held_slots_.clear();
  for (std::uint32_t slot = 0; slot < held_.size(); ++slot)
    if (held_[slot] != not_a_member) held_slots_.push_back(slot);
  overloads_.restored(in, slots);
  support_graph_.restored(in, slots);
}

std::size_t SupportSolver::memory_bytes() const {
  const auto bytes_of = [](const auto&... array) { return (... + (array.capacity() * sizeof(*array.data()))); };
  return bytes_of(held_, held_slots_, last_held_, structures_, body_, contact_, lane_of_, lanes_, order_,
                  first_of_group_) +
         overloads_.memory_bytes() + support_graph_.memory_bytes();
}

}  // namespace fathom::native
