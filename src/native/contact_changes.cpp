#include "native/contact_changes.hpp"

#include <algorithm>
#include <bit>

#include "native/prefetch.hpp"
#include "native/radix_sort.hpp"
#include "native/tuning.hpp"
#include "world/growth.hpp"

namespace fathom::native {

void ContactChanges::make_room(const ContactGraph& graph) {
  const std::size_t contacts = graph.size();
  const std::size_t chunks = (contacts + contact_grain - 1) / contact_grain;
  block_size_ = std::clamp<std::size_t>(chunks / max_blocks, 1, max_chunks_a_block) * contact_grain;
  if (graph.is_mostly_parts()) block_size_ = std::clamp<std::size_t>(contacts / max_blocks, 1, block_size_);
  const std::size_t blocks = (contacts + block_size_ - 1) / block_size_;
  grow_to(blocks_, blocks);
  grow_to(counts_, blocks);
}

ContactChanges::Block& ContactChanges::begin_block(std::size_t first_contact) {
  Block& block = blocks_[first_contact / block_size_];
  block.begun.clear();
  block.ended.clear();
  block.gone.clear();
  block.fast.clear();
  block.recycled = 0;
  block.has_new_parts = false;
  return block;
}

void ContactChanges::end_block(std::size_t first_contact) {
  const std::size_t number = first_contact / block_size_;
  const Block& block = blocks_[number];
  const auto counted = [](std::size_t n) { return static_cast<std::uint16_t>(n); };
  // Written once: the counts of other threads' blocks are adjacent.
  counts_[number] = {counted(block.recycled),    counted(block.begun.size()), counted(block.ended.size()),
                     counted(block.gone.size()), counted(block.fast.size()),  block.has_new_parts};
}

void ContactChanges::gather(ContactGraph& graph, ThreadPool& pool) {
  list_changed_blocks(graph);
  graph.make_room_for_touches();
  const std::size_t parts = parts_for(pool, count());
  for_each_part(pool, parts, [&](std::size_t part) {
    const auto block = [&](std::size_t i) -> const Block& { return blocks_[changed_blocks_[i].block]; };
    const auto fetch_block = [&](std::size_t i) { prefetch_to_read(&block(i)); };
    const auto fetch_lists = [&](std::size_t i) {
      prefetch_to_read(block(i).begun.data());
      prefetch_to_read(block(i).ended.data());
      prefetch_to_read(block(i).gone.data());
    };
    const auto fetch_contacts = [&](std::size_t i) {
      for (const NewManifold& fresh : block(i).begun) graph.prefetch(fresh.contact);
      for (const std::uint32_t index : block(i).ended) graph.prefetch(index);
      for (const std::uint32_t index : block(i).gone) graph.prefetch(index);
    };
    const auto take = [&](std::size_t i) { gather(graph, changed_blocks_[i]); };
    const std::size_t blocks = changed_blocks_.size();
    one_after_the_other(part * blocks / parts, (part + 1) * blocks / parts, fetch_block, fetch_lists, fetch_contacts,
                        take);
  });
}

// Lists the blocks with changes, and where their changes go.
void ContactChanges::list_changed_blocks(ContactGraph& graph) {
  PlacedBlock next{};
  recycled_ = 0;
  changed_blocks_.clear();
  fast_blocks_.clear();
  for (; next.block < counts_.size(); ++next.block) {
    const Counts counts = counts_[next.block];
    recycled_ += counts.recycled;
    if (counts.fast > 0) fast_blocks_.push_back(next.block);
    if (counts.has_new_parts) add_parts(graph, blocks_[next.block]);
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
  graph.expect(next.ended, next.gone);
}

void ContactChanges::add_parts(ContactGraph& graph, Block& block) {
  for (NewManifold& fresh : block.begun)
    if (fresh.contact & NewManifold::new_part)
      fresh.contact = graph.add_part(fresh.contact & ~NewManifold::new_part, fresh.children);
}

void ContactChanges::gather(ContactGraph& graph, PlacedBlock next) {
  const Block& block = blocks_[next.block];
  for (const NewManifold& fresh : block.begun) {
    const GraphEdge edge = graph.edge_of(fresh.contact);
    first_manifolds_[next.begun] = &fresh;
    edges_begun_[next.begun++] = edge;
  }
  for (const std::uint32_t index : block.ended) {
    if (graph[index].in_touch) graph.touch_changes().note(index, false);
    edges_ended_[next.ended] = graph.end(next.ended, index);
    ++next.ended;
  }
  for (const std::uint32_t index : block.gone) {
    pairs_gone_[next.gone] = graph.leave(next.gone, index);
    ++next.gone;
  }
}

void ContactChanges::order_begun(const ContactGraph& graph) {
  const std::size_t count = edges_begun_.size();
  for (std::vector<OfBodies>* list : {&by_bodies_, &scratch_}) give_back_room(*list, count);
  give_back_room(order_, count);
  std::uint32_t last = 0;
  for (const GraphEdge& edge : begun()) last = std::max({last, edge.a, edge.b});
  const int bits = std::bit_width(last);
  grow_to(by_bodies_, count);
  for (std::uint32_t i = 0; i < count; ++i)
    by_bodies_[i] = {std::uint64_t{edges_begun_[i].a} << bits | edges_begun_[i].b, i};
  radix_sort(by_bodies_, scratch_, 2 * bits, [](const OfBodies& of) { return of.bodies; });
  if (graph.any_parts()) order_parts(graph);
  grow_to(order_, count);
  for (std::size_t i = 0; i < count; ++i) order_[i] = by_bodies_[i].begun;
}

void ContactChanges::order_parts(const ContactGraph& graph) {
  const auto children = [&](const OfBodies& of) {
    const Children c = graph.children(edges_begun_[of.begun].contact);
    return std::uint64_t{c.a} << 32 | c.b;
  };
  for (auto first = by_bodies_.begin(); first != by_bodies_.end();) {
    const auto end =
        std::find_if(first, by_bodies_.end(), [&](const OfBodies& of) { return of.bodies != first->bodies; });
    if (end - first > 1) std::ranges::stable_sort(first, end, {}, children);
    first = end;
  }
}

std::size_t ContactChanges::memory_bytes() const {
  const auto bytes_of = [](const auto&... array) { return (... + (array.capacity() * sizeof(*array.begin()))); };
  return bytes_of(blocks_, counts_, changed_blocks_, fast_blocks_, edges_begun_, edges_ended_, pairs_gone_,
                  first_manifolds_, by_bodies_, scratch_, order_);
}

}  // namespace fathom::native
