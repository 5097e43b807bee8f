#include "native/link_contacts.hpp"

#include <algorithm>
#include <tuple>

#include "dynamics/softness.hpp"

namespace fathom::native {

void LinkContacts::list(const ConstraintLayout& layout, std::span<const MechanismLink> links, std::size_t mechanisms) {
  listed_.clear();
  chosen_.clear();
  links_.assign(links.size(), {});
  of_mechanism_.assign(mechanisms, {});
  is_chosen_.clear();
  clusters_.resize(mechanisms);
  for (std::uint32_t m = 0; m < mechanisms; ++m) clusters_[m] = {m, 1};
  if (links.empty()) return link_of_.clear();
  link_of_.assign(state_.size(), none);
  for (std::uint32_t i = 0; i < links.size(); ++i) {
    if (!links[i].is_copy()) link_of_[links[i].body] = i;
  }
  for (std::uint32_t lane = 0; lane < layout.lane_count(); ++lane) {
    const ConstraintRef ref = layout.lanes()[lane];
    if (ref != none && kind_of(ref) == ConstraintKind::contact) list(ref, lane, links);
  }
  form_clusters();
  std::ranges::sort(listed_, {}, [](const Listed& l) { return std::tuple(l.mechanism, l.link, l.contact); });
}

void LinkContacts::list(std::uint32_t contact, std::uint32_t lane, std::span<const MechanismLink> links) {
  const fathom::native::Contact& c = graph_[contact];
  const std::uint32_t a = c.fixed_a ? none : link_of_[c.a], b = link_of_[c.b];
  if ((a == none) == (b == none)) return;
  const std::uint32_t link = a == none ? b : a, other = a == none ? c.a : c.b;
  if (!c.fixed_a && state_.flags[other] & jointed) return;
  listed_.push_back({links[link].mechanism, link, contact, lane, c.fixed_a ? none : other});
}

// Mechanisms that meet at a free body become one cluster, unless it would be too large: then sweeps alone solve the
// contacts of that body.
void LinkContacts::form_clusters() {
  const auto obstacles = std::partition(listed_.begin(), listed_.end(), [](const Listed& l) { return l.free == none; });
  std::sort(obstacles, listed_.end(), [](const Listed& x, const Listed& y) {
    return std::tuple(x.free, x.mechanism, x.contact) < std::tuple(y.free, y.mechanism, y.contact);
  });
  auto kept = obstacles;
  for (auto next = obstacles; next != listed_.end();) {
    const auto first = next;
    while (next != listed_.end() && next->free == first->free) ++next;
    if (unite({first, next})) kept = std::move(first, next, kept);
  }
  listed_.erase(kept, listed_.end());
  for (std::uint32_t m = 0; m < clusters_.size(); ++m) clusters_[m] = {root_of(m), clusters_[root_of(m)].size};
}

std::uint32_t LinkContacts::root_of(std::uint32_t mechanism) {
  while (clusters_[mechanism].first != mechanism)
    mechanism = clusters_[mechanism].first = clusters_[clusters_[mechanism].first].first;
  return mechanism;
}

/// False if the cluster would be too large; then some of the mechanisms may have been united in vain.
bool LinkContacts::unite(std::span<const Listed> of_body) {
  for (const Listed& l : of_body) {
    const std::uint32_t a = root_of(of_body.front().mechanism), b = root_of(l.mechanism);
    if (a == b) continue;
    const std::uint32_t size = clusters_[a].size + clusters_[b].size;
    if (size > max_cluster) return false;
    clusters_[std::max(a, b)].first = std::min(a, b);
    clusters_[std::min(a, b)].size = size;
  }
  return true;
}

void LinkContacts::choose(std::span<const MechanismLink> links) {
  for (const Chosen& c : chosen_) of_mechanism_[c.at.mechanism] = {};
  for (Link& link : links_) link.contacts = {}, link.leads = false;
  chosen_.clear();
  std::uint32_t end = 0;
  for (const Listed& l : listed_) end = std::max(end, graph_[l.contact].manifold + 1);
  is_chosen_.assign(end, not_chosen);
  for (const Listed& listed : listed_) {
    if (!is_to_choose(listed, links[listed.link])) continue;
    is_chosen_[graph_[listed.contact].manifold] = listed.free == none ? of_obstacle : of_free;
    const auto k = static_cast<std::uint32_t>(chosen_.size());
    chosen_.push_back({listed, {}, {}, 0, {}});
    for (LinkContactRange* range : {&of_mechanism_[listed.mechanism], &links_[listed.link].contacts}) {
      if (range->first == range->end) range->first = k;
      range->end = k + 1;
    }
    for (std::uint32_t i = listed.link; i != none && !links_[i].leads; i = links[i].parent) links_[i].leads = true;
  }
  if (listed_.empty()) return;
  stands_.assign(of_mechanism_.size(), false);
  for (const MechanismLink& link : links)
    if (link.obstacle != none) stands_[link.mechanism] = true;
  for (const Chosen& c : chosen_)
    if (c.at.free == none) stands_[c.at.mechanism] = true;
  for (std::uint32_t i = 0; i < links.size(); ++i) links_[i].stands = stands_[links[i].mechanism];
}

bool LinkContacts::is_to_choose(const Listed& listed, const MechanismLink& link) const {
  const fathom::native::Contact& c = graph_[listed.contact];
  const float impulse = graph_.manifold(c).step_impulse, fall = length(def_.gravity) * def_.dt;
  const float inverse_mass = bodies_[link.body].inverse_mass;
  if (c.ahead) return false;
  return listed.free == none ? is_for_mechanism(link, impulse, inverse_mass, fall)
                             : is_for_mechanism(impulse, inverse_mass + bodies_[listed.free].inverse_mass, fall);
}

static void read_impulses(const LaneFields& f, ContactRows& r) {
  for (int i = 0; i < r.count; ++i) r.impulses.normal[i] = f[point_field(i, point_impulse)];
  r.impulses.slide_1 = f[friction_impulse_1], r.impulses.slide_2 = f[friction_impulse_2];
  r.impulses.twist = f[twist_impulse];
}

void LinkContacts::read(std::uint32_t mechanism, const BlockArray& blocks, float h) {
  for_each(of_mechanism(mechanism), [&](Chosen& chosen) { read(chosen, blocks, h); });
}

void LinkContacts::read(Chosen& chosen, const BlockArray& blocks, float h) {
  const auto width = static_cast<std::size_t>(wide_kernels().width);
  const LaneFields f =
      chosen.fields = {blocks.blocks + chosen.at.lane / width * blocks.stride, width, chosen.at.lane % width};
  const fathom::native::Contact& c = graph_[chosen.at.contact];
  const ContactManifold& m = graph_.manifold(c);
  const auto vec = [&](int field) { return Vec3{f[field], f[field + 1], f[field + 2]}; };
  LinkContact& contact = chosen.contact;
  ContactRows& r = contact.rows;
  r.count = m.point_count();
  r.set_frame(ContactAxes(vec(normal_x), vec(tangent_x), vec(arm_a_x), vec(arm_b_x)));
  r.frame.friction.coefficient = f[friction], r.frame.friction.patch_radius = f[patch_radius];
  for (int i = 0; i < r.count; ++i)
    r.points[i] = {f[point_field(i, point_x)], f[point_field(i, point_y)], f[point_field(i, point_separation)], 0};
  r.bounce.restitution = m.restitution;
  read_impulses(f, r);
  const float inverse_b = bodies_[c.b].inverse_mass,
              inverse_sum = c.fixed_a ? inverse_b : inverse_b + bodies_[c.a].inverse_mass;
  even_out(r, m.step_impulse * inverse_sum / (length(def_.gravity) * def_.dt));
  for (int i = 0; i < r.count; ++i) f[point_field(i, point_impulse)] = r.impulses.normal[i];
  contact.is_pushable = chosen.at.free != none;
  contact.link_is_a = contact.is_pushable && chosen.at.free == c.b;
  contact.soft = link_contact_step(h, def_.solver.push_out_velocity);
  contact.on_surface = c.on_moving_surface || c.by_direction;
  if (contact.on_surface) {
    contact.surface.slide = vec(surface_x);
    contact.surface.grain_1 = f[grain_1], contact.surface.grain_2 = f[grain_2];
  }
  const std::uint32_t slot = contact.link_is_a ? c.b : c.a;
  const SolverBody& other = state_.solver_bodies()[slot];
  contact.other.linear = other.linear, contact.other.angular = other.angular;
  if (!contact.is_pushable) return;
  contact.other.inverse_mass = 1;
  contact.other.inverse_inertia =
      free_response(other.inverse_mass,
                    world_inertia<SymMat3>(state_.inertia.data(), slot, other.inverse_mass, other.inverse_inertia));
}

void LinkContacts::move_obstacles(std::uint32_t mechanism, float h) {
  for_each(of_mechanism(mechanism), [h](Chosen& chosen) {
    if (!chosen.contact.is_pushable) chosen.contact.move_obstacle(h);
  });
}

void LinkContacts::begin(std::uint32_t i, const LinkResponse& response) {
  const ContactBody<LinkResponse> link{{}, {}, 1, response};
  for_each(of_link(i), [&](Chosen& chosen) {
    LinkContact& contact = chosen.contact;
    read_impulses(chosen.fields, contact.rows);
    chosen.sum = contact.rows.impulses.sum();
    if (!contact.is_pushable) return weigh_link_contact<false>(contact, link);
    weigh_link_contact<true>(contact, link);
    const SolverBody& other = state_.solver_bodies()[chosen.at.free];
    chosen.before.linear = other.linear, chosen.before.angular = other.angular;
  });
}

void LinkContacts::take_back(LinkContactRange range) {
  for_each(range, [this](const Chosen& chosen) {
    if (!chosen.contact.is_pushable) return;
    SolverBody& other = state_.solver_bodies()[chosen.at.free];
    other.linear = chosen.before.linear, other.angular = chosen.before.angular;
  });
}

void LinkContacts::store_impulses(LinkContactRange range, bool ends_substep) {
  for_each(range, [ends_substep](const Chosen& chosen) {
    const LaneFields& f = chosen.fields;
    const ContactRows& r = chosen.contact.rows;
    for (int i = 0; i < r.count; ++i) f[point_field(i, point_impulse)] = r.impulses.normal[i];
    f[friction_impulse_1] = r.impulses.slide_1, f[friction_impulse_2] = r.impulses.slide_2;
    f[twist_impulse] = r.impulses.twist;
    if (ends_substep) f[step_impulse] = step_impulse_with(f[step_impulse], chosen.sum, r.impulses.sum());
  });
}

}  // namespace fathom::native
