// When a large heap is divided into domains, and when they are drawn again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "native/body_state.hpp"
#include "native/contact_graph.hpp"
#include "threads/thread_pool.hpp"

namespace fathom::native {

/// Domains are drawn again when bodies have moved so much that a sweep has become a quarter longer, or there are twice
/// or half as many contacts.
class HeapDivision {
 public:
  /// Of `active` bodies the solver moves `in_contact`.
  void update(ContactGraph& graph, std::span<const std::uint32_t> active, std::size_t in_contact,
              const BodyState& state, ThreadPool& pool);

  template <class Self, class Archive>
  static void archive(Self& self, Archive& archive) {
    archive(self.cost_when_divided_);
  }

 private:
  struct Cost {
    std::uint64_t sweep = 0, contacts = 0;
  };
  static Cost cost_of(const ContactGraph& graph);
  void divide(ContactGraph& graph, std::span<const std::uint32_t> active, const BodyState& state, ThreadPool& pool);

  Cost cost_when_divided_;
};

}  // namespace fathom::native
