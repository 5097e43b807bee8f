// What the narrow phase found, by blocks of contacts, until apply_changes.cpp applies it.
//
// One thread processes each block of contacts. Few blocks hold changes, so their counts are in a separate array, which
// one thread scans; then all threads gather the blocks' lists, in the order of contacts.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "native/contact_graph.hpp"
#include "native/narrow_phase.hpp"
#include "threads/thread_pool.hpp"
#include "world/large_array.hpp"

namespace fathom::native {

class ContactChanges {
 public:
  struct alignas(128) Block {
    std::vector<NewManifold> begun;
    std::vector<std::uint32_t> ended, gone;  // contacts; one that is gone and touched is in both
    std::vector<FastPair> fast;
    std::uint32_t recycled = 0;
    bool has_new_parts = false;  // in `begun`

    /// Records a contact's change. A first manifold is already in `begun`.
    void note(const ContactGraph& graph, std::uint32_t index, Change change) {
      recycled += change == Change::recycled;
      if (change != Change::ended && change != Change::gone) return;
      if (graph[index].touching()) ended.push_back(index);
      if (change == Change::gone) gone.push_back(index);
    }
  };

  /// Makes room for changes of the graph's contacts. A pair in parts may take a hundred times as long as another. If
  /// most pairs are in parts, blocks are smaller; otherwise a few trees on a mesh would all go to one thread. Pairs of
  /// boxes are tested side by side, which needs large blocks.
  void make_room(const ContactGraph& graph);
  /// Contacts per block.
  std::size_t block_size() const { return block_size_; }
  /// The block that begins with this contact, emptied.
  Block& begin_block(std::size_t first_contact);
  /// Counts the block's lists.
  void end_block(std::size_t first_contact);

  // Before `gather`, by one thread.

  /// Lists the contacts that end touch, ascending. A part is in the block of its pair, wherever its own index is.
  void list_ended(std::vector<std::uint32_t>& ended) const {
    ended.clear();
    for (std::size_t i = 0; i < counts_.size(); ++i)
      if (counts_[i].ended > 0) ended.insert(ended.end(), blocks_[i].ended.begin(), blocks_[i].ended.end());
    std::ranges::sort(ended);
  }
  /// Ends the touch of a touching contact, whatever the narrow phase found.
  void end(std::uint32_t contact) {
    blocks_[contact / block_size_].ended.push_back(contact);
    ++counts_[contact / block_size_].ended;
  }
  /// Keeps only those manifolds in `begun` for which lets_begin(manifold) is true; it may change the manifold. Called
  /// in the order of blocks.
  template <class Predicate>
  void filter_begun(const Predicate& lets_begin) {
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      if (counts_[i].begun == 0) continue;
      std::vector<NewManifold>& begun = blocks_[i].begun;
      std::size_t left = 0;
      for (NewManifold& fresh : begun)
        if (lets_begin(fresh)) begun[left++] = fresh;
      begun.resize(left);
      counts_[i].begun = static_cast<std::uint16_t>(left);
    }
  }

  /// Gathers all blocks' lists, in the order of contacts: makes parts of pairs, removes the edges of contacts that end,
  /// and removes pairs that are gone from the graph.
  void gather(ContactGraph& graph, ThreadPool& pool);

  /// Orders the touches that begin by their bodies, and by children where two bodies touch in several parts. Choices
  /// that depend on earlier ones are made in this order. That of contacts depends on what ended elsewhere, because
  /// their indices are reused.
  void order_begun(const ContactGraph& graph);

  // Results of the last `gather`.
  std::span<GraphEdge> begun() { return {edges_begun_.data(), edges_begun_.size()}; }
  std::span<GraphEdge> ended() { return {edges_ended_.data(), edges_ended_.size()}; }
  std::span<Pair> gone() { return {pairs_gone_.data(), pairs_gone_.size()}; }
  /// By index in `begun`.
  std::span<const NewManifold* const> first_manifolds() const {
    return {first_manifolds_.data(), first_manifolds_.size()};
  }
  /// Indices in `begun`, as the last `order_begun` has ordered them.
  std::span<const std::uint32_t> begun_by_bodies() const { return order_; }
  std::size_t count() const { return edges_begun_.size() + edges_ended_.size() + pairs_gone_.size(); }
  /// Manifolds that were kept.
  std::uint32_t recycled() const { return recycled_; }

  template <class Act>
  void for_each_fast_pair(const Act& act) const {
    for (const std::size_t block : fast_blocks_)
      for (const FastPair& pair : blocks_[block].fast) act(pair);
  }

  std::size_t memory_bytes() const;

 private:
  struct Counts {
    std::uint16_t recycled = 0, begun = 0, ended = 0, gone = 0, fast = 0;
    bool has_new_parts = false;
  };
  /// A block with changes, and where they begin among those of all blocks.
  struct PlacedBlock {
    std::uint32_t block, begun, ended, gone;
  };
  /// A touch that begins, by its bodies.
  struct OfBodies {
    std::uint64_t bodies;
    std::uint32_t begun;  // index
  };
  void list_changed_blocks(ContactGraph& graph);
  static void add_parts(ContactGraph& graph, Block& block);
  void gather(ContactGraph& graph, PlacedBlock next);
  /// Orders parts of the same bodies by children.
  void order_parts(const ContactGraph& graph);

  std::size_t block_size_ = contact_grain;
  std::vector<Block> blocks_;
  std::vector<Counts> counts_;  // by block
  std::vector<PlacedBlock> changed_blocks_;
  std::vector<std::size_t> fast_blocks_;  // blocks with fast pairs
  std::uint32_t recycled_ = 0;
  LargeArray<GraphEdge> edges_begun_, edges_ended_;
  LargeArray<Pair> pairs_gone_;
  LargeArray<const NewManifold*> first_manifolds_;
  std::vector<OfBodies> by_bodies_, scratch_;
  std::vector<std::uint32_t> order_;
};

}  // namespace fathom::native
