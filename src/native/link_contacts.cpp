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
  if (links.empty()) return link_of_.clear();
  link_of_.assign(state_.size(), none);
  for (std::uint32_t i = 0; i < links.size(); ++i) {
    if (!links[i].is_copy()) link_of_[links[i].body] = i;
  }
  for (std::uint32_t lane = 0; lane < layout.lane_count(); ++lane) {
    const ConstraintRef ref = layout.lanes()[lane];
    if (ref == none || kind_of(ref) != ConstraintKind::contact) continue;
    const Contact& c = graph_[ref];
    if (!c.fixed_a || link_of_[c.b] == none) continue;
    listed_.push_back({links[link_of_[c.b]].mechanism, link_of_[c.b], ref, lane});
  }
  std::ranges::sort(listed_, {}, [](const Listed& l) { return std::tuple(l.mechanism, l.link, l.contact); });
}

void LinkContacts::choose(std::span<const MechanismLink> links) {
  for (const Chosen& c : chosen_) of_mechanism_[c.at.mechanism] = {};
  for (Link& link : links_) link.contacts = {}, link.leads = false;
  chosen_.clear();
  for (const Listed& listed : listed_) {
    if (!is_chosen(listed, links[listed.link])) continue;
    const auto k = static_cast<std::uint32_t>(chosen_.size());
    chosen_.push_back({listed, {}, {}, 0});
    for (LinkContactRange* range : {&of_mechanism_[listed.mechanism], &links_[listed.link].contacts}) {
      if (range->first == range->end) range->first = k;
      range->end = k + 1;
    }
    for (std::uint32_t i = listed.link; i != none && !links_[i].leads; i = links[i].parent) links_[i].leads = true;
  }
}

bool LinkContacts::is_chosen(const Listed& listed, const MechanismLink& link) const {
  const fathom::native::Contact& c = graph_[listed.contact];
  return !c.ahead && is_for_mechanism(link, graph_.manifold(c).step_impulse, bodies_[link.body].inverse_mass,
                                      length(def_.gravity) * def_.dt);
}

void LinkContacts::read(std::uint32_t mechanism, const BlockArray& blocks, float h) {
  for_each(mechanism, [&](Chosen& chosen) { read(chosen, blocks, h); });
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
  contact.soft = contact_step(1 / h, contact_softness(def_.solver, h).fixed, def_.solver.push_out_velocity);
  contact.on_surface = c.on_moving_surface || c.by_direction;
  if (contact.on_surface) {
    contact.surface.slide = vec(surface_x);
    contact.surface.grain_1 = f[grain_1], contact.surface.grain_2 = f[grain_2];
  }
  const SolverBody& a = state_.solver_bodies()[c.a];
  contact.obstacle.linear = a.linear, contact.obstacle.angular = a.angular;
}

void LinkContacts::move_obstacles(std::uint32_t mechanism, float h) {
  for_each(mechanism, [h](Chosen& chosen) { chosen.contact.move_obstacle(h); });
}

void LinkContacts::load_impulses(std::uint32_t mechanism) {
  for_each(mechanism, [](Chosen& chosen) {
    const LaneFields& f = chosen.fields;
    ContactRows& r = chosen.contact.rows;
    for (int i = 0; i < r.count; ++i) r.impulses.normal[i] = f[point_field(i, point_impulse)];
    r.impulses.slide_1 = f[friction_impulse_1], r.impulses.slide_2 = f[friction_impulse_2];
    r.impulses.twist = f[twist_impulse];
    chosen.sum = r.impulses.sum();
  });
}

void LinkContacts::store_impulses(std::uint32_t mechanism, bool ends_substep) {
  for_each(mechanism, [ends_substep](const Chosen& chosen) {
    const LaneFields& f = chosen.fields;
    const ContactRows& r = chosen.contact.rows;
    for (int i = 0; i < r.count; ++i) f[point_field(i, point_impulse)] = r.impulses.normal[i];
    f[friction_impulse_1] = r.impulses.slide_1, f[friction_impulse_2] = r.impulses.slide_2;
    f[twist_impulse] = r.impulses.twist;
    if (ends_substep) f[step_impulse] = step_impulse_with(f[step_impulse], chosen.sum, r.impulses.sum());
  });
}

}  // namespace fathom::native
