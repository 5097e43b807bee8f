// Steps in which the device simulator asks the application (ask.hpp): it submits them in parts and waits in between.
#pragma once

#include <algorithm>
#include <tuple>
#include <utility>

#include "check/check.hpp"
#include "device/device_simulator.hpp"
#include "native/asked_contact.hpp"

namespace fathom::device {

template <exec::Device D>
bool DeviceSimulator<D>::asks() const {
  return shapes_ & questions_bit && (callbacks.pre_solve || callbacks.filter);
}

/// The bits of a body about which the application is asked.
template <exec::Device D>
std::uint32_t DeviceSimulator<D>::question_bits(const BodyInfo& info) const {
  return (callbacks.pre_solve && info.pre_solve ? 1u * asks_bit : 0u) |
         (callbacks.filter && info.custom_filter ? 1u * filters_bit : 0u);
}

/// Only where something changes, because a change of constants wakes the body.
template <exec::Device D>
void DeviceSimulator<D>::callbacks_changed() {
  for (const BodyId id : bodies.living()) {
    const std::uint32_t known = id.index < question_bits_.size() ? question_bits_[id.index] : 0;
    if (question_bits(bodies[id.index]) != known) constants_changed(id.index, 0);
  }
}

template <exec::Device D>
void DeviceSimulator<D>::submit_asking(const PendingStep& pending, Stop after) {
  StepBuffers& buffers = buffers_of(pending.number);
  Step<D> step = step_of(buffers);
  // The application sees the number of the step before, also where the step is repaired.
  const std::uint64_t now = std::exchange(steps, pending.number - 1);
  const auto launch = [&](std::optional<typename D::Graph>& graph, const auto& submissions) {
    if (!graph) graph.emplace(device_.record(submissions));
    device_.launch(*graph);
  };
  refused_in_step_.clear();
  if (after == no_stop) {
    launch(buffers.pairs_graphs[pending.set_changed], [&] { step.submit_pairs(pending.set_changed); });
    ask_about_pairs(step);
    launch(buffers.manifolds_graph, [&] { step.submit_manifolds(); });
  } else {
    buffers.repeat_graph.emplace(device_.record([&] { step.submit_deferred_manifolds(); }));
    device_.launch(*buffers.repeat_graph);
  }
  ask_about_contacts(step);
  upload_refused();
  launch(buffers.bodies_graph, [&] { step.submit_bodies(); });
  steps = now;
}

/// Counts after `list` has listed questions.
template <exec::Device D>
template <class List>
Counters DeviceSimulator<D>::count_questions(const List& list) {
  device_.zero(&counters_.data()->asked, 1);
  list();
  return download(counters_.data(), 1).front();
}

/// About each new pair of bodies once, in the order of their slots.
template <exec::Device D>
void DeviceSimulator<D>::ask_about_pairs(Step<D>& step) {
  if (!callbacks.filter || !bodies.any_custom_filter()) return;
  FilterQuestion* const listed = contact_memory_.filter_questions();
  const Counters counters = count_questions([&] { step.list_filtered_pairs(listed); });
  std::vector<FilterQuestion> questions = download(listed, counters.asked);
  for (FilterQuestion& q : questions) {
    q.a = indices_.slot(q.a), q.b = indices_.slot(q.b);
    if (q.b < q.a) std::swap(q.a, q.b);
  }
  std::ranges::sort(questions, {}, [](const FilterQuestion& q) { return std::tuple(q.a, q.b, q.contact); });
  std::vector<std::uint32_t> refused;
  bool lets = true;
  is_asking_ = true;
  for (std::size_t i = 0; i < questions.size(); ++i) {
    const FilterQuestion& q = questions[i];
    const bool is_same = i > 0 && questions[i - 1].a == q.a && questions[i - 1].b == q.b;
    if (!is_same) lets = callbacks.lets_collide(bodies.id(q.a), bodies.id(q.b));
    if (!lets) refused.push_back(q.contact);
    const std::uint64_t key = refused_key(indices_.of(q.a), indices_.of(q.b));
    if (lets)
      kept_out_.erase(key);
    else
      kept_out_.insert(key);
  }
  is_asking_ = false;
  if (refused.empty()) return;
  upload(contact_memory_.refused_contacts(), refused);
  step.refuse_pairs(contact_memory_.refused_contacts(), static_cast<std::uint32_t>(refused.size()));
  // Some of them have parted.
  if (kept_out_.size() > counters.contacts)
    note_kept_out(download(contact_memory_.contacts().contacts, counters.contacts));
}

template <exec::Device D>
void DeviceSimulator<D>::note_kept_out(std::span<const Contact> contacts) {
  kept_out_.clear();
  for (const Contact& c : contacts)
    if (c.in_use() && c.kept_out()) kept_out_.insert(refused_key(c.a, c.b));
}

/// In an order that does not depend on the device's.
template <exec::Device D>
void DeviceSimulator<D>::ask_about_contacts(Step<D>& step) {
  if (!callbacks.pre_solve || bodies.pre_solvers().empty()) return;
  ContactQuestion* const listed = contact_memory_.contact_questions();
  const Counters counters = count_questions([&] { step.list_contacts_that_ask(listed); });
  // A step that lacks room for manifolds asks once it has them all.
  if (counters.needed_manifolds() > 0) return;
  std::vector<ContactQuestion> questions = download(listed, counters.asked);
  std::ranges::sort(questions, {}, [&](const ContactQuestion& q) {
    const std::uint32_t a = indices_.slot(q.a), b = indices_.slot(q.b);
    const Vec3 at = q.points[0].position;
    return std::tuple(std::min(a, b), std::max(a, b), q.child_a, q.child_b, q.normal.x, q.normal.y, q.normal.z, at.x,
                      at.y, at.z);
  });
  std::vector<ContactAnswer> answers;
  answers.reserve(questions.size());
  is_asking_ = true;
  for (const ContactQuestion& q : questions) answers.push_back(answer(q));
  is_asking_ = false;
  std::unordered_set<std::uint64_t> enabled;
  for (std::size_t i = 0; i < questions.size(); ++i)
    (answers[i].enabled ? enabled : refused_in_step_).insert(refused_key(questions[i].a, questions[i].b));
  std::erase_if(refused_in_step_, [&](std::uint64_t key) { return enabled.contains(key); });
  if (answers.empty()) return;
  upload(contact_memory_.answers(), answers);
  step.apply_answers(contact_memory_.answers(), static_cast<std::uint32_t>(answers.size()));
}

/// What fast bodies may pass, beside contacts: they may be deflected towards bodies that they have none with.
template <exec::Device D>
void DeviceSimulator<D>::upload_refused() {
  std::vector<std::uint64_t> keys(kept_out_.begin(), kept_out_.end());
  keys.insert(keys.end(), refused_in_step_.begin(), refused_in_step_.end());
  std::ranges::sort(keys);
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  FATHOM_ASSERT(keys.size() <= contact_memory_.capacity() + contact_memory_.manifold_capacity());
  upload(contact_memory_.refused(), keys);
  device_.fill(&counters_.data()->refused, 1, static_cast<std::uint32_t>(keys.size()));
}

template <exec::Device D>
ContactAnswer DeviceSimulator<D>::answer(const ContactQuestion& q) {
  const native::AskedContact asked{indices_.slot(q.a), indices_.slot(q.b), {q.child_a, q.child_b}};
  const BodyInfo &a = bodies[asked.a], &b = bodies[asked.b];
  const native::ContactMaterials mixed =
      native::mixed_materials(a, b, asked.children, poses_[asked.a].rotation, poses_[asked.b].rotation);
  PreSolveContact contact = native::question_about(asked, bodies, q.normal, mixed);
  contact.point_count = static_cast<int>(q.point_count);
  for (std::uint32_t i = 0; i < q.point_count; ++i)
    contact.points[i] = {q.points[i].position, q.points[i].separation, q.points[i].impulse};
  const Vec3 slide = contact.surface_velocity;
  callbacks.ask(contact);
  const native::ContactMaterials given = native::materials_of(asked, contact);
  return {.contact = q.contact,
          .enabled = contact.enabled,
          .has_own_slide = !(contact.surface_velocity == slide),
          .friction = given.friction,
          .restitution = given.restitution,
          .slide = given.slide};
}

}  // namespace fathom::device
