// Questions to the application within a step: whether two bodies may collide (`BodyDef::custom_filter`), and how their
// contacts are to be solved (`BodyDef::pre_solve`). The device lists them, the host asks, and the device applies the
// answers before it goes on. A refused contact ends or does not begin, as on the CPU (native/pre_solve.hpp).
#pragma once

#include "device/update_manifolds.hpp"
#include "exec/kernel.hpp"

namespace fathom::device {

/// Lists pairs of bodies with custom filters that are new, and refused ones whose boxes have been renewed.
struct ListFilteredPairs {
  Bodies<> bodies;
  Contacts<contact_list> contacts;
  FilterQuestion* questions;
  Counters* counters;

  FATHOM_HD void operator()(std::uint32_t k) const {
    Contact& c = contacts.contacts[k];
    if (!c.in_use() || c.is_patch() || !has_custom_filter(bodies, c)) return;
    if (!bodies.constants[c.a].is_living() || !bodies.constants[c.b].is_living()) return;  // removed since
    const TouchingPieces pieces = pieces_of(bodies, c);
    const bool is_renewed = c.kept_out() && bodies.fat[pieces.a].changes | bodies.fat[pieces.b].changes;
    if (!(c.bits & fresh_bit) && !is_renewed) return;
    c.bits &= ~static_cast<std::uint32_t>(kept_out_bit);
    questions[exec::atomic_add(counters->asked, 1u)] = {k, c.a, c.b, 0};
  }
};

/// Keeps the refused pairs from colliding for as long as they last.
struct RefusePairs {
  Contacts<contact_list> contacts;
  const std::uint32_t* refused;

  FATHOM_HD void operator()(std::uint32_t k) const { contacts.contacts[refused[k]].bits |= kept_out_bit; }
};

/// Lists contacts that touch and ask, and forgets the answers of the last step.
struct ListContactsThatAsk {
  Bodies<> bodies;
  Contacts<contact_list> contacts;
  ContactQuestion* questions;
  Counters* counters;

  FATHOM_HD void operator()(std::uint32_t k) const {
    Contact& c = contacts.contacts[k];
    if (!c.in_use()) return;
    c.bits &= ~static_cast<std::uint32_t>(refused_bit);
    if (!c.touching() || !asks(bodies, c) || !((bodies.flags[c.a] | bodies.flags[c.b]) & awake_flag)) return;
    ContactQuestion q;
    q.contact = k, q.a = c.a, q.b = c.b;
    q.child_a = c.is_patch() ? c.patch_material() : c.child_a(), q.child_b = c.child_b();
    const ContactManifold& m = contacts.manifolds[c.manifold];
    const Pose &a = bodies.poses[c.a], &b = bodies.poses[c.b];
    q.normal = rotate(a.rotation, m.normal);
    q.point_count = static_cast<std::uint32_t>(m.point_count());
    for (int i = 0; i < max_manifold_points; ++i) {
      if (i >= m.point_count()) continue;
      const Vec3 on_a = transform(a, m.points[i].anchor_a), on_b = transform(b, m.points[i].anchor_b);
      // Manifolds made where bodies will meet store a time in place of the step's impulse.
      q.points[i] = {0.5f * (on_a + on_b), dot(on_b - on_a, q.normal), c.ahead() ? 0.0f : m.step_impulse_of(i)};
    }
    questions[exec::atomic_add(counters->asked, 1u)] = q;
  }
};

/// Applies the answers.
struct ApplyAnswers {
  ContactChanges changes;
  const ContactAnswer* answers;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const ContactAnswer answer = answers[k];
    Contact& c = changes.contacts.contacts[answer.contact];
    const bool is_new = c.bits & unanswered_bit;
    c.bits &= ~static_cast<std::uint32_t>(unanswered_bit);
    if (!answer.enabled) {
      changes.end(c);
      c.bits |= refused_bit;
      return;
    }
    ContactManifold& m = changes.contacts.manifolds[c.manifold];
    changes.mix(c, m);
    if (m.friction != answer.friction) c.bits &= ~static_cast<std::uint32_t>(by_direction_bit);
    m.friction = answer.friction, m.restitution = answer.restitution;
    if (m.restitution > 0) exec::atomic_store(changes.counters->may_bounce, 1u);
    if (answer.has_own_slide) {
      c.bits &= ~static_cast<std::uint32_t>(on_moving_surface_bit);
      c.bits |= answer.slide == Vec3{} ? 1u * own_slide_bit : own_slide_bit | on_moving_surface_bit;
      changes.contacts.own_slides[answer.contact] = answer.slide;
    }
    if (is_new) changes.begin_between(c, m);
  }
};

}  // namespace fathom::device
