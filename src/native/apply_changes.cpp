// Applies what the narrow phase found: touches that begin or end, and their colours. It takes three loops, because
// contacts, bodies and lists are scattered in memory, and a single thread would wait for each cache line to arrive from
// the core that last wrote it:
//
// 1. Each thread gathers the changes of some blocks of contacts into slots counted out beforehand.
// 2. One thread assigns and releases colours, as each choice depends on all earlier ones. Meanwhile the others forget
//    pairs that are gone and set up the manifolds of contacts that begin to touch.
// 3. The lists of colours are updated, each by one thread.
#include <algorithm>

#include "check/check.hpp"
#include "dynamics/manifold_update.hpp"
#include "dynamics/overlap.hpp"
#include "dynamics/rolling.hpp"
#include "dynamics/softness.hpp"
#include "native/native_simulator.hpp"
#include "native/pieces.hpp"
#include "native/prefetch.hpp"

namespace fathom::native {

void NativeSimulator::apply_changes() {
  changes_.gather(graph_, pool_);
  profile.counts.recycled = changes_.recycled();
  const std::span<GraphEdge> ended = changes_.ended(), begun = changes_.begun();
  const std::span<const Pair> gone = changes_.gone();
  if (ended.size() + begun.size() > 0) active_.outdate_in_contact();

  const bool wakes_any = def.sleep.enabled && std::any_of(begun.begin(), begun.end(), [&](const GraphEdge& edge) {
                           return is_asleep(edge.a) || is_asleep(edge.b);
                         });
  graph_.make_manifolds(begun.size());
  const auto colour = [&] {
    graph_.uncolour(ended);
    changes_.order_begun(graph_);
    if (!wakes_any) graph_.colour(begun, changes_.begun_by_bodies());
  };
  // With many threads, the others finish before the colouring thread could help.
  const std::size_t threads = parts_for(pool_, changes_.count()), parts = threads > 3 ? threads - 1 : threads;
  pool_.for_each_chunk_beside(colour, parts, 1, [&](std::size_t part, std::size_t) {
    graph_.forget(gone, part, parts);
    make_first_manifolds(part, parts, wakes_any);
  });

  const std::span<const std::uint32_t> changed = changed_.slots();
  for_each_part(pool_, parts, [&](std::size_t part) {
    graph_.relist(ended, wakes_any ? std::span<GraphEdge>() : begun, part, parts);
    const std::size_t first = part * changed.size() / parts, end = (part + 1) * changed.size() / parts;
    for (const std::uint32_t slot : changed.subspan(first, end - first))
      state_.flags[slot] &= static_cast<std::uint8_t>(~box_changed);
  });
  if (wakes_any) begin_one_by_one();
  pre_solve_.give_materials(changes_.first_manifolds());
}

void NativeSimulator::make_first_manifolds(std::size_t part, std::size_t parts, bool wakes_any) {
  const std::span<const NewManifold* const> manifolds = changes_.first_manifolds();
  const std::span<const GraphEdge> begun = changes_.begun();
  const std::size_t count = manifolds.size();
  const auto fetch = [&](std::size_t i) {
    prefetch_to_read(&manifolds[i]->contact);
    prefetch_to_read(&manifolds[i]->manifold.points[2]);
    graph_.prefetch(begun[i].contact);
    for (const std::uint32_t slot : {begun[i].a, begun[i].b}) {
      prefetch_to_read(&bodies[slot]);
      prefetch_to_read(&bodies[slot].material);
    }
  };
  const auto make = [&](std::size_t i) {
    first_manifold(*manifolds[i], graph_.manifold_at(graph_.new_manifold(i)));
    if (!wakes_any) graph_.begin(i, manifolds[i]->contact);
  };
  one_after_the_other(part * count / parts, (part + 1) * count / parts, fetch, make);
}

// When an island wakes, its contacts that touch by then get colours.
void NativeSimulator::begin_one_by_one() {
  const std::span<const GraphEdge> begun = changes_.begun();
  for (const std::uint32_t i : changes_.begun_by_bodies()) {
    const GraphEdge& edge = begun[i];
    graph_.begin(i, edge.contact);
    for (const std::uint32_t slot : {edge.a, edge.b})
      if (is_asleep(slot)) {
        islands_.wake(slot);
        active_.outdate();
      }
    if (graph_[edge.contact].colour == no_colour) graph_.colour(edge.contact);
  }
}

bool NativeSimulator::is_asleep(std::uint32_t slot) const {
  return !(state_.flags[slot] & (awake | isolated)) && bodies[slot].motion == MotionType::dynamic;
}

void NativeSimulator::first_manifold(const NewManifold& fresh, ContactManifold& manifold) {
  Contact& c = graph_[fresh.contact];
  manifold = {};
  const Children children = graph_.children(fresh.contact);
  const Piece a = piece_of(bodies[c.a], children.a), b = piece_of(bodies[c.b], children.b);
  c.round = is_round(a.geometry.type) || is_round(b.geometry.type);
  if (c.in_parts) c.axis = fresh.axis;
  FATHOM_ASSERT(!c.round || fresh.manifold.count <= 2);  // rolling data occupies the other points' memory
  graph_.mix_materials(c, manifold);
  const bool of_compound = bodies[c.a].geometry.is_compound() || bodies[c.b].geometry.is_compound();
  const float overlap = first_overlap(fresh.manifold, manifold.restitution, a.half, b.half,
                                      contact_sag(def) * length(def.gravity), of_compound);
  c.ahead = fresh.ahead >= 0;
  c.slack =
      overlap > 0 && !c.ahead ? Slack::of_overlap(overlap) : Slack::of_distance(recycle_distance(c, children, bodies));
  set_manifold(manifold, fresh.manifold, fresh.b_in_a);
  if (c.ahead) manifold.step_impulse = fresh.ahead;
}

void NativeSimulator::drop_contact(std::uint32_t index, std::vector<ContactEvent>& ended) {
  Contact& c = graph_[index];
  // Only the last part of a pair to end reports the end of touch.
  bool others_touch = false;
  if (c.in_parts)
    for (std::uint32_t part = graph_.next_part(index); part != index; part = graph_.next_part(part))
      others_touch |= graph_[part].in_use && graph_[part].in_touch;
  if (c.in_touch && !others_touch) ended.push_back(event(c.a, c.b));
  if (graph_[index].touching()) active_.outdate_in_contact();
  graph_.remove(index);
}

}  // namespace fathom::native
