// What the narrow phase found is applied here, in the order of contacts: ends and beginnings of touch, with the
// colours they bring. Three loops, because contacts, bodies and lists lie anywhere in memory, and one thread
// would wait for each of them to come from the cache of the thread that wrote it last:
//
// 1. Every thread gathers what some blocks of contacts have met, into places that were counted out before.
// 2. One thread takes and gives colours, whose choice depends on all that were chosen before. Meanwhile the others
//    forget the pairs that are gone and set up the manifolds of those that begin to touch.
// 3. Colours' lists are brought up to date, each by one thread.
#include <algorithm>

#include "check/check.hpp"
#include "dynamics/manifold_update.hpp"
#include "dynamics/overlap.hpp"
#include "dynamics/rolling.hpp"
#include "dynamics/softness.hpp"
#include "native/native_simulator.hpp"
#include "native/pieces.hpp"
#include "native/prefetch.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

/// Calls each of the acts for all of [begin, end), some turns before the next act: what lies anywhere in memory is
/// fetched, step by step, until the last act has it at hand.
template <class... Acts>
void one_after_the_other(std::size_t begin, std::size_t end, const Acts&... acts) {
  constexpr std::size_t turns = 3, last = turns * (sizeof...(acts) - 1);
  for (std::size_t i = begin; i < end + last; ++i) {
    std::size_t late = 0;
    const auto call = [&](const auto& act) {
      if (i >= begin + late && i - late < end) act(i - late);
      late += turns;
    };
    (call(acts), ...);
  }
}

}  // namespace

void NativeSimulator::take_over_changes() {
  place_changes();
  graph_.make_room_for_touches();
  gather_changes();
  const std::span<GraphEdge> ended(edges_ended_.data(), edges_ended_.size());
  const std::span<GraphEdge> begun(edges_begun_.data(), edges_begun_.size());
  const std::size_t changes = ended.size() + begun.size() + pairs_gone_.size();
  if (ended.size() + begun.size() > 0) in_contact_is_current_ = false;

  const bool wakes_any = def.sleep.enabled && std::any_of(begun.begin(), begun.end(), [&](const GraphEdge& edge) {
                           return is_asleep(edge.a) || is_asleep(edge.b);
                         });
  graph_.make_manifolds(begun.size());
  const auto colour = [&] {
    graph_.uncolour(ended);
    if (!wakes_any) graph_.colour(begun);
  };
  // Many threads do the rest before the one with the colours can help.
  const std::size_t threads = parts_for(pool_, changes), parts = threads > 3 ? threads - 1 : threads;
  pool_.for_each_chunk_beside(colour, parts, 1, [&](std::size_t part, std::size_t) {
    graph_.forget({pairs_gone_.data(), pairs_gone_.size()}, part, parts);
    make_first_manifolds(part, parts, wakes_any);
  });

  for_each_part(pool_, parts, [&](std::size_t part) {
    graph_.relist(ended, wakes_any ? std::span<GraphEdge>() : begun, part, parts);
    const std::size_t first = part * changed_count_ / parts, end = (part + 1) * changed_count_ / parts;
    for (const std::uint32_t slot : changed().subspan(first, end - first))
      state_.flags[slot] &= static_cast<std::uint8_t>(~box_changed);
  });
  if (wakes_any) begin_one_by_one();
}

// Lists the blocks that hold changes, with the places of these.
void NativeSimulator::place_changes() {
  PlacedBlock next{};
  profile.counts.recycled = 0;
  changed_blocks_.clear();
  fast_blocks_.clear();
  for (; next.block < block_counts_.size(); ++next.block) {
    const BlockCounts counts = block_counts_[next.block];
    profile.counts.recycled += counts.recycled;
    if (counts.fast > 0) fast_blocks_.push_back(next.block);
    if (counts.has_new_parts) add_parts(blocks_[next.block]);
    if ((counts.begun | counts.ended | counts.gone) == 0) continue;
    changed_blocks_.push_back(next);
    next.begun += counts.begun;
    next.ended += counts.ended;
    next.gone += counts.gone;
  }
  make_anew(edges_begun_, next.begun);
  make_anew(first_manifolds_, next.begun);
  make_anew(edges_ended_, next.ended);
  make_anew(pairs_gone_, next.gone);
  graph_.expect(next.ended, next.gone);
}

void NativeSimulator::add_parts(BlockOfChanges& block) {
  for (NewManifold& fresh : block.begun)
    if (fresh.contact & NewManifold::new_part)
      fresh.contact = graph_.add_part(fresh.contact & ~NewManifold::new_part, fresh.children);
}

void NativeSimulator::gather_changes() {
  const std::size_t changes = edges_begun_.size() + edges_ended_.size() + pairs_gone_.size();
  const std::size_t parts = parts_for(pool_, changes);
  for_each_part(pool_, parts, [&](std::size_t part) {
    const auto block = [&](std::size_t i) -> const BlockOfChanges& { return blocks_[changed_blocks_[i].block]; };
    const auto fetch_block = [&](std::size_t i) { prefetch_to_read(&block(i)); };
    const auto fetch_lists = [&](std::size_t i) {
      prefetch_to_read(block(i).begun.data());
      prefetch_to_read(block(i).ended.data());
      prefetch_to_read(block(i).gone.data());
    };
    const auto fetch_contacts = [&](std::size_t i) {
      for (const NewManifold& fresh : block(i).begun) graph_.prefetch(fresh.contact);
      for (const std::uint32_t index : block(i).ended) graph_.prefetch(index);
      for (const std::uint32_t index : block(i).gone) graph_.prefetch(index);
    };
    const auto take = [&](std::size_t i) { gather(block(i), changed_blocks_[i]); };
    const std::size_t blocks = changed_blocks_.size();
    one_after_the_other(part * blocks / parts, (part + 1) * blocks / parts, fetch_block, fetch_lists, fetch_contacts,
                        take);
  });
}

void NativeSimulator::gather(const BlockOfChanges& block, PlacedBlock place) {
  for (const NewManifold& fresh : block.begun) {
    const GraphEdge edge = graph_.edge_of(fresh.contact);
    first_manifolds_[place.begun] = &fresh;
    edges_begun_[place.begun++] = edge;
  }
  for (const std::uint32_t index : block.ended) {
    if (graph_[index].in_touch) graph_.touch_changes().note(index, false);
    edges_ended_[place.ended] = graph_.end(place.ended, index);
    ++place.ended;
  }
  for (const std::uint32_t index : block.gone) {
    pairs_gone_[place.gone] = graph_.leave(place.gone, index);
    ++place.gone;
  }
}

void NativeSimulator::make_first_manifolds(std::size_t part, std::size_t parts, bool wakes_any) {
  const std::size_t count = first_manifolds_.size();
  const auto fetch = [&](std::size_t i) {
    prefetch_to_read(&first_manifolds_[i]->contact);
    prefetch_to_read(&first_manifolds_[i]->manifold.points[2]);
    graph_.prefetch(edges_begun_[i].contact);
    for (const std::uint32_t slot : {edges_begun_[i].a, edges_begun_[i].b}) {
      prefetch_to_read(&bodies[slot]);
      prefetch_to_read(&bodies[slot].material);
    }
  };
  const auto make = [&](std::size_t i) {
    first_manifold(*first_manifolds_[i], graph_.manifold_at(graph_.new_manifold(i)));
    if (!wakes_any) graph_.begin(i, first_manifolds_[i]->contact);
  };
  one_after_the_other(part * count / parts, (part + 1) * count / parts, fetch, make);
}

// An island that wakes up has those of its contacts coloured that touch by then.
void NativeSimulator::begin_one_by_one() {
  for (std::size_t i = 0; i < edges_begun_.size(); ++i) {
    const GraphEdge& edge = edges_begun_[i];
    graph_.begin(i, edge.contact);
    for (const std::uint32_t slot : {edge.a, edge.b})
      if (is_asleep(slot)) {
        islands_.wake(slot);
        active_is_current_ = false;
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
  FATHOM_ASSERT(!c.round || fresh.manifold.count <= 2);  // other points' room has what rolls
  graph_.mix_materials(c, manifold);
  const float overlap =
      first_overlap(fresh.manifold, manifold.restitution, a.half, b.half, contact_sag(def) * length(def.gravity));
  c.ahead = fresh.ahead >= 0;
  c.slack = overlap > 0 && !c.ahead ? Slack::of_overlap(overlap) : Slack::of_distance(recycle_distance(a, b));
  set_manifold(manifold, fresh.manifold, fresh.b_in_a);
  if (c.ahead) manifold.step_impulse = fresh.ahead;
}

void NativeSimulator::drop_contact(std::uint32_t index, std::vector<ContactEvent>& ended) {
  Contact& c = graph_[index];
  // Of the parts of a pair the last one to go tells of it.
  bool others_touch = false;
  if (c.in_parts)
    for (std::uint32_t part = graph_.next_part(index); part != index; part = graph_.next_part(part))
      others_touch |= graph_[part].in_use && graph_[part].in_touch;
  if (c.in_touch && !others_touch) ended.push_back(event(c.a, c.b));
  if (graph_[index].touching()) in_contact_is_current_ = false;
  graph_.remove(index);
}

}  // namespace fathom::native
