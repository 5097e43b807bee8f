// What the narrow phase met, by blocks of contacts, until it is applied (apply_changes.cpp).
//
// Each block is one thread's while contacts are looked at. Few blocks hold anything, so counts of each lie in an array
// of their own, which one thread looks through; then all threads gather what the blocks list, in the order of contacts.
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
    std::vector<std::uint32_t> ended, gone;  // contacts; those that are gone and touched are in both
    std::vector<FastPair> fast;
    std::uint32_t recycled = 0;
    bool has_new_parts = false;  // in `begun`

    /// What a contact has met; a first manifold is in `begun` already.
    void note(const ContactGraph& graph, std::uint32_t index, Change change) {
      recycled += change == Change::recycled;
      if (change != Change::ended && change != Change::gone) return;
      if (graph[index].touching()) ended.push_back(index);
      if (change == Change::gone) gone.push_back(index);
    }
  };

  /// Makes room for what the graph's contacts meet. A pair in parts may take a hundred times as long as another one:
  /// where most are, blocks are smaller, or a few trees on a mesh would all be one thread's. Pairs of boxes are tested
  /// side by side, which takes large ones.
  void make_room(const ContactGraph& graph);
  /// Contacts of a block.
  std::size_t block_size() const { return block_size_; }
  /// The block that begins with this contact, empty.
  Block& begin_block(std::size_t first_contact);
  /// Counts what it lists now.
  void end_block(std::size_t first_contact);

  // Before they are gathered, by one thread.

  /// Whether the contact ends touch.
  bool ends(std::uint32_t contact) const {
    const std::vector<std::uint32_t>& ended = blocks_[contact / block_size_].ended;
    return std::ranges::find(ended, contact) != ended.end();
  }
  /// A contact that touched ends that, whatever it has met.
  void end(std::uint32_t contact) {
    blocks_[contact / block_size_].ended.push_back(contact);
    ++counts_[contact / block_size_].ended;
  }
  /// Of what begins nothing is left but what lets_begin(manifold), which may change it, is true of; asked in the order
  /// of blocks.
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

  /// Gathers what all blocks list, in the order of contacts: parts of pairs are made, contacts that end give up their
  /// edges, and pairs that are gone leave the graph.
  void gather(ContactGraph& graph, ThreadPool& pool);

  // Of the last call of `gather`.
  std::span<GraphEdge> begun() { return {edges_begun_.data(), edges_begun_.size()}; }
  std::span<GraphEdge> ended() { return {edges_ended_.data(), edges_ended_.size()}; }
  std::span<Pair> gone() { return {pairs_gone_.data(), pairs_gone_.size()}; }
  /// Of what begins, by index in `begun`.
  std::span<const NewManifold* const> first_manifolds() const {
    return {first_manifolds_.data(), first_manifolds_.size()};
  }
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
  /// A block with changes, and where these begin among those of all blocks.
  struct PlacedBlock {
    std::uint32_t block, begun, ended, gone;
  };
  void list_changed_blocks(ContactGraph& graph);
  static void add_parts(ContactGraph& graph, Block& block);
  void gather(ContactGraph& graph, PlacedBlock next);

  std::size_t block_size_ = contact_grain;
  std::vector<Block> blocks_;
  std::vector<Counts> counts_;  // by block
  std::vector<PlacedBlock> changed_blocks_;
  std::vector<std::size_t> fast_blocks_;  // that list fast pairs
  std::uint32_t recycled_ = 0;
  LargeArray<GraphEdge> edges_begun_, edges_ended_;
  LargeArray<Pair> pairs_gone_;
  LargeArray<const NewManifold*> first_manifolds_;
};

}  // namespace fathom::native
