#include "hybrid/hybrid_simulator.hpp"

#include <algorithm>

#include "world/growth.hpp"

namespace fathom {

std::unique_ptr<Simulator> make_hybrid_simulator(const WorldDef& def) {
  return std::make_unique<hybrid::HybridSimulator>(def);
}

namespace hybrid {

using native::Change;
using native::Contact;
using native::contact_grain;
using native::ContactChanges;

HybridSimulator::HybridSimulator(const WorldDef& definition)
    : NativeSimulator(definition, nullptr), detection_(device::make_detection(definition)) {
  auto broad_phase = std::make_unique<DeviceBroadPhase>(*detection_, [this] { inspect_known(); });
  device_broad_phase_ = broad_phase.get();
  lists_added_ = true;
  set_broad_phase(std::move(broad_phase));
}

void HybridSimulator::step() {
  NativeSimulator::step();
  const exec::Traffic now = detection_->traffic(), of_step = now - counted_;
  counted_ = now;
  profile.counts.launches = of_step.launches;
  profile.counts.bytes_to_device = of_step.bytes_to_device;
  profile.counts.bytes_to_host = of_step.bytes_to_host;
}

void HybridSimulator::restore(ByteReader& in) {
  NativeSimulator::restore(in);
  for (const BodyId id : bodies.living()) detection_->set_body(id.index, bodies[id.index]);
}

void HybridSimulator::body_added(std::uint32_t slot, const Pose& pose, const Velocity& velocity) {
  NativeSimulator::body_added(slot, pose, velocity);
  detection_->set_body(slot, bodies[slot]);
}

void HybridSimulator::body_removed(std::uint32_t slot) {
  NativeSimulator::body_removed(slot);
  device_broad_phase_->forget(slot);
  detection_->remove_body(slot);
}

// --- narrow phase ------------------------------------------------------------------------------------------------

bool HybridSimulator::is_pair_of_boxes(const Contact& c) const {
  return bodies[c.a].geometry.type == ShapeType::box && bodies[c.b].geometry.type == ShapeType::box;
}

void HybridSimulator::inspect(std::uint32_t index) {
  Contact& c = graph_[index];
  native::Inspection& seen = inspections_[index];
  seen = {};
  if (c.is_pair() && !c.in_parts && is_active(c))
    seen = inspect_contact(c, c.touching() ? &graph_.manifold(c) : nullptr, bodies, state_, def.dt, {});
}

void HybridSimulator::inspect_known() {
  grow_to(inspections_, graph_.size());
  pool_.for_each_chunk(graph_.size(), contact_grain, [&](std::size_t begin, std::size_t end) {
    for (auto i = static_cast<std::uint32_t>(begin); i < end; ++i) inspect(i);
  });
}

void HybridSimulator::update_manifolds() {
  find_seams();
  changes_.make_room(graph_);
  grow_to(inspections_, graph_.size());
  grow_to(job_of_, graph_.size());
  // New contacts may reuse free slots.
  for (const std::uint32_t index : added_) inspect(index);
  constexpr std::size_t count = device::Detection::portions;
  const std::size_t chunks = (graph_.size() + changes_.block_size() - 1) / changes_.block_size();
  offsets_.resize(std::max(offsets_.size(), chunks));
  Portion portions[count];
  for (std::uint32_t p = 0; p < count; ++p) {
    portions[p].begin = std::min(graph_.size(), chunks * p / count * changes_.block_size());
    portions[p].end = std::min(graph_.size(), chunks * (p + 1) / count * changes_.block_size());
    submit(portions[p], p);
  }
  for (std::uint32_t p = 0; p < count; ++p) take_over(portions[p], p);
}

void HybridSimulator::submit(Portion& portion, std::uint32_t number) {
  const std::size_t first_chunk = portion.begin / changes_.block_size();
  const auto for_each_chunk = [&](const auto& act) {
    pool_.for_each_chunk(portion.end - portion.begin, changes_.block_size(), [&](std::size_t begin, std::size_t end) {
      act(first_chunk + begin / changes_.block_size(), static_cast<std::uint32_t>(portion.begin + begin),
          static_cast<std::uint32_t>(portion.begin + end));
    });
  };
  for_each_chunk([&](std::size_t chunk, std::uint32_t begin, std::uint32_t end) {
    Offsets& counts = offsets_[chunk] = {};
    for (std::uint32_t i = begin; i < end; ++i)
      if (inspections_[i].collide) ++(is_pair_of_boxes(graph_[i]) ? counts.boxes : counts.others);
  });
  std::uint32_t boxes = 0, others = 0;
  const std::size_t chunks = (portion.end - portion.begin + changes_.block_size() - 1) / changes_.block_size();
  for (std::size_t chunk = first_chunk; chunk < first_chunk + chunks; ++chunk) {
    const Offsets counts = offsets_[chunk];
    offsets_[chunk] = {boxes, others};
    boxes += counts.boxes;
    others += counts.others;
  }
  portion.boxes = boxes;
  portion.jobs = boxes + others;
  if (portion.jobs == 0) return;
  device::CollideJob* const jobs = detection_->jobs(number, portion.jobs);
  for_each_chunk([&](std::size_t chunk, std::uint32_t begin, std::uint32_t end) {
    Offsets next = offsets_[chunk];
    for (std::uint32_t i = begin; i < end; ++i) {
      const native::Inspection& seen = inspections_[i];
      if (!seen.collide) continue;
      const Contact& c = graph_[i];
      job_of_[i] = is_pair_of_boxes(c) ? next.boxes++ : portion.boxes + next.others++;
      jobs[job_of_[i]] = {seen.b_in_a, c.a, c.b, seen.margin, c.axis, seen.load};
    }
  });
  detection_->collide(number, portion.boxes, portion.jobs);
}

void HybridSimulator::take_over(const Portion& portion, std::uint32_t number) {
  const device::CollideResult* const results = portion.jobs > 0 ? detection_->results(number) : nullptr;
  pool_.for_each_chunk(portion.end - portion.begin, changes_.block_size(), [&](std::size_t begin, std::size_t end) {
    const auto first = static_cast<std::uint32_t>(portion.begin + begin);
    ContactChanges::Block& block = changes_.begin_block(first);
    for (std::uint32_t i = first; i < portion.begin + end; ++i) {
      const native::Inspection& seen = inspections_[i];
      Change change = seen.change;
      Contact& c = graph_[i];
      if (c.in_parts && c.is_pair() && is_active(c)) change = update_parts(i, narrow_phase(block));
      if (seen.collide) {
        const device::CollideResult& result = results[job_of_[i]];
        c.axis = result.axis;
        change = narrow_phase(block).take(i, c, result.manifold, seen, c.touching() ? &graph_.manifold(c) : nullptr);
      }
      block.note(graph_, i, change);
    }
    changes_.end_block(first);
  });
}

}  // namespace hybrid
}  // namespace fathom
