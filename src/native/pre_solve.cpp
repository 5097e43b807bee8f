#include "native/pre_solve.hpp"

#include <algorithm>
#include <utility>

namespace fathom::native {

void PreSolve::ask(ContactChanges& changes) {
  answers_.clear();
  if (!callbacks_.pre_solve || bodies_.pre_solvers().empty()) return;
  graph_.drop_old_slides();
  list_touching();
  changes.list_ended(ended_);
  for (const std::uint32_t index : touching_)
    if (!std::ranges::binary_search(ended_, index) && !keeps(index)) changes.end(index);
  changes.filter_begun([this](NewManifold& fresh) { return lets_begin(fresh); });
}

void PreSolve::give_materials(std::span<const NewManifold* const> begun) {
  if (answers_.empty()) return;
  for (const NewManifold* const fresh : begun)
    if (fresh->answer != none) graph_.give(fresh->contact, answers_[fresh->answer].materials);
}

/// Lists contacts of awake bodies, ascending.
void PreSolve::list_touching() {
  touching_.clear();
  for (const std::uint32_t slot : bodies_.pre_solvers())
    graph_.for_each_of(slot, [&](std::uint32_t index) {
      const Contact& c = graph_[index];
      if (c.touching() && (state_.flags[c.a] | state_.flags[c.b]) & awake) touching_.push_back(index);
    });
  std::ranges::sort(touching_);
  touching_.erase(std::unique(touching_.begin(), touching_.end()), touching_.end());
}

PreSolveContact PreSolve::question(const Answer& pair, Vec3 normal) const {
  return question_about(pair, bodies_, normal, graph_.mixed_materials(pair.a, pair.b, pair.children));
}

PreSolve::Answer& PreSolve::answered(PreSolveContact& contact, Answer pair) {
  callbacks_.ask(contact);
  pair.enabled = contact.enabled;
  pair.materials = materials_of(pair, contact);
  return answers_.emplace_back(pair);
}

bool PreSolve::keeps(std::uint32_t index) {
  Contact& c = graph_[index];
  const ContactManifold& m = graph_.manifold(c);
  const Answer pair{{c.a, c.b, graph_.children(index)}, true, {}};
  const Pose &a = state_.poses[c.a], &b = state_.poses[c.b];
  const Vec3 normal = rotate(a.rotation, m.normal);
  PreSolveContact contact = question(pair, normal);
  contact.point_count = m.point_count();
  for (int i = 0; i < contact.point_count; ++i) {
    const Vec3 on_a = transform(a, m.points[i].anchor_a), on_b = transform(b, m.points[i].anchor_b);
    // Manifolds made where bodies will meet store a time in place of the step's impulse.
    contact.points[i] = {0.5f * (on_a + on_b), dot(on_b - on_a, normal), c.ahead ? 0.0f : m.step_impulse_of(i)};
  }
  const Answer& answer = answered(contact, pair);
  if (!answer.enabled) return false;
  graph_.mix_materials(c);
  graph_.give(index, answer.materials);
  return true;
}

bool PreSolve::lets_begin(NewManifold& fresh) {
  const bool is_new = fresh.contact & NewManifold::new_part;
  const std::uint32_t index = fresh.contact & ~NewManifold::new_part;
  const Contact& c = graph_[index];
  if (!asks(c.a, c.b)) return true;
  const Answer pair{{c.a, c.b, is_new ? fresh.children : graph_.children(index)}, true, {}};
  const Pose& a = state_.poses[c.a];
  PreSolveContact contact = question(pair, rotate(a.rotation, fresh.manifold.normal));
  contact.point_count = fresh.manifold.count;
  for (int i = 0; i < contact.point_count; ++i) {
    const ManifoldPoint& point = fresh.manifold.points[i];
    contact.points[i] = {transform(a, point.position), point.separation, 0};
  }
  fresh.answer = static_cast<std::uint32_t>(answers_.size());
  return answered(contact, pair).enabled;
}

bool PreSolve::may_stop(const FastPair& pair, Vec3 normal) {
  if (!callbacks_.pre_solve || !asks(pair.a, pair.b)) return true;
  bool is_known = false;
  for (const Answer& answer : answers_) {
    const bool is_turned = answer.a == pair.b && answer.b == pair.a;
    if (!is_turned && !(answer.a == pair.a && answer.b == pair.b)) continue;
    const std::uint32_t of_a = is_turned ? answer.children.b : answer.children.a;
    const std::uint32_t of_b = is_turned ? answer.children.a : answer.children.b;
    // A surface is swept as a whole, whatever its materials.
    const bool any_material = bodies_[pair.a].geometry.is_surface();
    if ((of_a != pair.children.a && !any_material) || of_b != pair.children.b) continue;
    if (answer.enabled) return true;
    is_known = true;
  }
  if (is_known) return false;
  const Answer asked{{pair.a, pair.b, pair.children}, true, {}};
  PreSolveContact contact = question(asked, normal);
  return answered(contact, asked).enabled;
}

}  // namespace fathom::native
